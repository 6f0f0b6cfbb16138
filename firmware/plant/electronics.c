/* From the true current and force to the two 12-bit conversions that the firmware reads. */
#include "plant.h"

#define ADC_FULL R(4095)
#define CURRENT_FULL_A R(2) /* shunt times 50 V/V reaches the 3.3 V reference */
#define FORCE_LOW_N R(-1)
#define FORCE_SPAN_N R(18)
#define FORCE_RANGE_N R(15) /* of the sensor: its noise is given in fractions of this */

static uint16_t convert(real fraction)
{
    real code = fraction * ADC_FULL + R(0.5);
    if (code < R(0)) {
        return 0;
    }
    return code > ADC_FULL ? (uint16_t)ADC_FULL : (uint16_t)code;
}

/* Fifth-order Butterworth at 2.5 kHz, a quarter of the sample rate: there the bilinear transform's
 * pre-warped corner tan(pi/4) is 1, and the sections of the analogue prototype
 * 1/(s + 1), 1/(s^2 + b s + 1), b = 2 cos(36 deg), 2 cos(72 deg), turn into
 * (1 + z)/2 and (1 + z)^2 / ((2 + b) + (2 - b) z^2), z the unit delay. */
void plant_electronics_init(struct plant_electronics *e, const struct solenoid_params *is)
{
    const real width[2] = {R(1.6180339887498949), R(0.61803398874989485)};
    for (int k = 0; k < 2; k++) {
        e->section_gain[k] = R(1) / (R(2) + width[k]);
        e->section_feedback[k] = (R(2) - width[k]) / (R(2) + width[k]);
        e->section_state[k][0] = R(0);
        e->section_state[k][1] = R(0);
    }
    e->pole_state = R(0);
    plant_random_init(&e->noise, (uint32_t)is->seed, 2U + (uint32_t)is->noise_seed * 4U);
    plant_random_init(&e->wild, (uint32_t)is->seed, 3U + (uint32_t)is->noise_seed * 4U);
    e->adc_current = convert(R(0));
    e->adc_force = convert(-FORCE_LOW_N / FORCE_SPAN_N);
}

static real low_pass(struct plant_electronics *e, real x)
{
    real y = R(0.5) * (x + e->pole_state);
    e->pole_state = x;
    for (int k = 0; k < 2; k++) {
        /* transposed direct form: two states per section */
        real in = e->section_gain[k] * y;
        real out = in + e->section_state[k][0];
        e->section_state[k][0] = R(2) * in + e->section_state[k][1];
        e->section_state[k][1] = in - e->section_feedback[k] * out;
        y = out;
    }
    return y;
}

static real wild_sample(struct plant_electronics *e, const struct solenoid_params *is, real force)
{
    if (plant_random_uniform(&e->wild) >= is->outliers) {
        return force;
    }
    real side = R(2) * plant_random_uniform(&e->wild) - R(1);
    return force + is->outlier_size * (side < R(0) ? side - R(1) : side + R(1)) * R(0.5);
}

void plant_electronics_step(struct plant_electronics *e, const struct solenoid_params *is, real current,
                            real sensed)
{
    real shunt = low_pass(e, current) + is->current_noise * plant_random_normal(&e->noise);
    e->adc_current = convert(shunt / CURRENT_FULL_A);

    real force = sensed + is->noise * FORCE_RANGE_N * plant_random_normal(&e->noise);
    if (is->outliers > R(0)) {
        force = wild_sample(e, is, force);
    }
    if (is->saturation > R(0) && force > is->saturation) {
        force = is->saturation; /* after the noise: a rail repeats itself exactly */
    }
    if (is->quantisation > R(0)) {
        real steps = (force - FORCE_LOW_N) / is->quantisation + R(0.5);
        force = FORCE_LOW_N + is->quantisation * (real)(steps > R(0) ? (int32_t)steps : 0);
    }
    e->adc_force = convert((force - FORCE_LOW_N) / FORCE_SPAN_N);
}
