/* Between the magnetic force and the finger (mechanics), then between the finger and the amplifier
 * (disturbances). Friction comes before the finger's creep, so that a slow creep is not hidden in it. */
#include "plant.h"

#define TWO_PI R(6.283185307179586)

static const real creep_tau_ratio[PLANT_CREEP_ELEMENTS] = {R(0.25), R(1), R(4)};
static const real creep_share[PLANT_CREEP_ELEMENTS] = {R(0.3), R(0.4), R(0.3)};

/* Widths of the friction elements over the Coulomb force; their mean is 1. */
static const real friction_ratio[PLANT_FRICTION_ELEMENTS] = {R(0.1), R(0.3), R(0.6), R(1), R(1.6), R(2.4)};

/* Wiggles of the current smaller than this are no path: a noisy current at rest wears nothing in. */
#define PATH_THRESHOLD_A R(0.005)

/* Kinetic over static friction: what is left of the imbalance after a jump. */
#define KINETIC_RATIO R(0.4)

static real play(real follower, real leader, real half_width)
{
    if (leader - follower > half_width) {
        return leader - half_width;
    }
    if (follower - leader > half_width) {
        return leader + half_width;
    }
    return follower;
}

void plant_after_init(struct plant_after *a, const struct solenoid_params *is)
{
    a->path_input = R(0);
    a->path_force = R(0);
    for (int k = 0; k < PLANT_FRICTION_ELEMENTS; k++) {
        a->friction[k] = R(0);
    }
    a->stuck = R(0);
    a->ring_position = R(0);
    a->ring_velocity = R(0);
    a->ring_force = R(0);
    real turn = TWO_PI * is->resonance * PLANT_TICK_S;
    const real oscillator[4] = {R(0), turn, -turn, R(-2) * is->resonance_zeta * turn};
    plant_exp_2x2(oscillator, a->ring_step);
    for (int k = 0; k < PLANT_CREEP_ELEMENTS; k++) {
        a->creep_strain[k] = R(0);
        a->creep_loss[k] = plant_exp_loss(PLANT_TICK_S / (is->creep_tau * creep_tau_ratio[k]));
    }
    a->viscous_input = R(0);
    plant_lag_init(&a->output_lag, is->output_lag, R(0));
    a->periodic_cos = R(1);
    a->periodic_sin = R(0);
    plant_cos_sin(TWO_PI * is->periodic_frequency * PLANT_TICK_S, &a->turn_cos, &a->turn_sin);
}

/* The hysterons settle with every cycle rather than with time: a slow state follows the force along
 * the path of the current, and the force leans towards it. */
static real accommodate(struct plant_after *a, const struct solenoid_params *is, real current, real force)
{
    real before = a->path_input;
    a->path_input = play(before, current, PATH_THRESHOLD_A);
    real path = a->path_input - before;
    path = path < R(0) ? -path : path;
    a->path_force = a->path_force + (force - a->path_force) * (path / (is->accommodation_path + path));
    return (force + is->accommodation * a->path_force) / (R(1) + is->accommodation);
}

/* Coulomb friction against an elastic finger: the finger's force follows as a play of half-width F_c.
 * Asperities let go one after another (Maxwell slip), so it is a bank of plays of spread widths. */
static real rub(struct plant_after *a, const struct solenoid_params *is, real force)
{
    real sum = R(0);
    for (int k = 0; k < PLANT_FRICTION_ELEMENTS; k++) {
        a->friction[k] = play(a->friction[k], force, is->coulomb * friction_ratio[k]);
        sum = sum + a->friction[k];
    }
    return sum / (real)PLANT_FRICTION_ELEMENTS;
}

static real stick(struct plant_after *a, const struct solenoid_params *is, real force)
{
    real imbalance = force - a->stuck;
    if (imbalance > is->stick_slip) {
        a->stuck = force - KINETIC_RATIO * is->stick_slip;
    } else if (imbalance < -is->stick_slip) {
        a->stuck = force + KINETIC_RATIO * is->stick_slip;
    }
    return a->stuck;
}

/* Plunger and finger as mass and spring: the distance to the equilibrium turns and shrinks by one exact
 * step of the free oscillation, with the force held over the tick. */
static real ring(struct plant_after *a, real force)
{
    real position = a->ring_position + a->ring_force - force;
    real velocity = a->ring_velocity;
    a->ring_position = a->ring_step[0] * position + a->ring_step[1] * velocity;
    a->ring_velocity = a->ring_step[2] * position + a->ring_step[3] * velocity;
    a->ring_force = force;
    return force + a->ring_position;
}

/* The finger as a spring in series with Kelvin-Voigt elements. Divided by 1 + creep, so that the force
 * after a long hold is the same as without. */
static real creep(struct plant_after *a, const struct solenoid_params *is, real force)
{
    real strain = R(0);
    for (int k = 0; k < PLANT_CREEP_ELEMENTS; k++) {
        a->creep_strain[k] = a->creep_strain[k] + a->creep_loss[k] * (force - a->creep_strain[k]);
        strain = strain + creep_share[k] * a->creep_strain[k];
    }
    return (force + is->creep * strain) / (R(1) + is->creep);
}

real plant_after_step(struct plant_after *a, const struct solenoid_params *is, real current, real magnetic)
{
    real force = magnetic;
    if (is->accommodation > R(0)) {
        force = accommodate(a, is, current, force);
    }
    if (is->coulomb > R(0)) {
        force = rub(a, is, force);
    }
    if (is->stick_slip > R(0)) {
        force = stick(a, is, force);
    }
    if (is->resonance > R(0)) {
        force = ring(a, force);
    }
    if (is->creep > R(0)) {
        force = creep(a, is, force);
    }
    force = force + is->viscous * ((current - a->viscous_input) / PLANT_TICK_S);
    a->viscous_input = current;
    if (is->output_lag > R(0)) {
        force = plant_lag_step(&a->output_lag, force);
    }
    return force;
}

/* A rotating pointer; the correction keeps its length at 1 over any number of ticks. */
static real hum(struct plant_after *a, real amplitude)
{
    real c = a->periodic_cos * a->turn_cos - a->periodic_sin * a->turn_sin;
    real s = a->periodic_sin * a->turn_cos + a->periodic_cos * a->turn_sin;
    real correction = R(1.5) - R(0.5) * (c * c + s * s);
    a->periodic_cos = c * correction;
    a->periodic_sin = s * correction;
    return amplitude * a->periodic_sin;
}

real plant_sense(struct plant_after *a, const struct solenoid_params *is, uint32_t tick, real force)
{
    real seconds = (real)tick * PLANT_TICK_S;
    real sensed = force * (R(1) + is->condition_gain) + is->condition_offset;
    if (seconds >= is->step_time) {
        sensed = sensed * (R(1) + is->step_gain) + is->step;
    }
    if (is->periodic > R(0)) {
        sensed = sensed + hum(a, is->periodic);
    }
    return sensed + is->offset_drift * seconds;
}
