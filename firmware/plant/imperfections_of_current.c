/* Between the coil current and the field that the static hysteresis sees. */
#include "plant.h"

void plant_before_init(struct plant_before *b, const struct solenoid_params *is)
{
    real ticks = is->delay / PLANT_TICK_S;
    b->delay_whole = (int32_t)ticks;
    b->delay_part = ticks - (real)b->delay_whole;
    b->ring_at = 0;
    for (int32_t k = 0; k < PLANT_DELAY_TICKS; k++) {
        b->ring[k] = R(0);
    }
    plant_lag_init(&b->field_lag, is->field_lag, R(0));
    b->widening_rate =
        is->rate_widening > R(0) ? PLANT_TICK_S / (is->rate_widening * is->rate_widening) : R(0);
    b->widening_input = R(0);
    b->widening_output = R(0);
}

static real delay(struct plant_before *b, real current)
{
    const uint32_t wrap = PLANT_DELAY_TICKS - 1U; /* a power of two less one */
    b->ring_at = (int32_t)(((uint32_t)b->ring_at + 1U) & wrap);
    b->ring[b->ring_at] = current;
    uint32_t at = (uint32_t)(b->ring_at - b->delay_whole);
    real late = b->ring[at & wrap];
    real later = b->ring[(at - 1U) & wrap];
    return late + b->delay_part * (later - late);
}

/* Excess loss: the inner field h trails the applied u by u - h = k sgn(h') sqrt|h'|, that is
 * h' = sgn(e) (e/k)^2 with e = u - h. Over a tick with u held at its middle value this has the exact
 * solution e/(1 + |e| tick/k^2): no root to take and nothing that could become unstable. */
static real widen(struct plant_before *b, real applied)
{
    real middle = R(0.5) * (applied + b->widening_input);
    real excess = middle - b->widening_output;
    real size = excess < R(0) ? -excess : excess;
    b->widening_output = middle - excess / (R(1) + size * b->widening_rate);
    b->widening_input = applied;
    return b->widening_output;
}

real plant_before_step(struct plant_before *b, const struct solenoid_params *is, real current, real force)
{
    real field = current;
    if (is->delay > R(0)) {
        field = delay(b, field);
    }
    if (is->field_lag > R(0)) {
        field = plant_lag_step(&b->field_lag, field);
    }
    if (is->rate_widening > R(0)) {
        field = widen(b, field);
    }
    /* The force pulls the plunger into another place in the field: feedback, one tick late. */
    return field + is->load_dependence * force;
}
