/* The chain: PWM, coil, true current, field, magnetic force, finger, electronics. */
#include "plant.h"

/* Copper warms while the iron weakens: relative rise of resistance over relative loss of force. */
#define COPPER_RATIO R(2)
#define COPPER_PER_K R(0.0039)
#define DIODE_V R(0.6)

/* Coils and adapters as they are bought, whatever the device around them is. */
static void draw_coil(struct solenoid_params *p)
{
    struct plant_random r;
    plant_random_init(&r, (uint32_t)p->coil, 4U);
    p->resistance = R(2) + R(8) * plant_random_uniform(&r);
    p->inductance = R(0.005) + R(0.095) * plant_random_uniform(&r);
    p->supply = R(9) + R(15) * plant_random_uniform(&r);
}

void solenoid_init(struct solenoid *s, const struct solenoid_params *p)
{
    s->is = *p;
    if (p->coil > R(0))
        draw_coil(&s->is);
    s->ambient_loss = COPPER_PER_K / COPPER_RATIO * p->ambient;
    s->tick = 0;
    s->coil_loss = plant_exp_loss(PLANT_TICK_S * s->is.resistance / s->is.inductance);
    s->heat = R(0);
    s->heat_loss = plant_exp_loss(PLANT_TICK_S / p->thermal_tau);
    s->current = R(0);
    s->field = R(0);
    s->magnetic = R(0);
    s->force = R(0);
    s->sensed = R(0);
    plant_preisach_init(&s->preisach, (uint32_t)p->seed);
    plant_before_init(&s->before, p);
    plant_after_init(&s->after, p);
    plant_electronics_init(&s->electronics, p);
}

/* Share of the force that is lost by the heat of the current and by that of the room. */
static real lost_to_heat(const struct solenoid *s)
{
    return s->is.thermal_drift * s->heat + s->ambient_loss;
}

/* L i' + R i = v with the voltage averaged over the PWM period, exact over the tick. While the
 * transistor is off the current free-wheels through the diode, which never lets it turn round. */
static real coil(const struct solenoid *s, real duty)
{
    real supply = s->is.supply - s->is.supply_sag * duty * s->current; /* its mean current over the PWM period */
    real volts = duty * supply - (R(1) - duty) * DIODE_V;
    real extra_ohms = COPPER_RATIO * lost_to_heat(s) * s->is.resistance;
    real settles_at = (volts - extra_ohms * s->current) / s->is.resistance;
    real current = s->current + s->coil_loss * (settles_at - s->current);
    return current > R(0) ? current : R(0);
}

void plant_step_current(struct solenoid *s, real current)
{
    s->tick++;
    s->current = current;
    s->heat = s->heat + s->heat_loss * (current * current - s->heat);
    s->field = plant_before_step(&s->before, &s->is, current, s->force);
    s->magnetic = plant_preisach_step(&s->preisach, s->field);
    real weakened = s->magnetic * (R(1) - lost_to_heat(s));
    s->force = plant_after_step(&s->after, &s->is, current, weakened);
    s->sensed = plant_sense(&s->after, &s->is, s->tick, s->force);
    plant_electronics_step(&s->electronics, &s->is, current, s->sensed);
}

void solenoid_step(struct solenoid *s, uint16_t pwm_on, uint16_t pwm_period)
{
    real duty = pwm_on < pwm_period ? (real)pwm_on / (real)pwm_period : R(1);
    plant_step_current(s, coil(s, duty));
}
