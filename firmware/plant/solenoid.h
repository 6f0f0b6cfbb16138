/* The simulated solenoid, its drive electronics and a finger: one 100 us step at a time.
 *
 * Shared by the host and mps2 ports. Only + - * / are used, in a fixed order, so that
 * every IEEE machine computes the same bits (build with -ffp-contract=off, and on 32-bit x86 with
 * -mfpmath=sse). No malloc, no libm; a freestanding port must supply memcpy for structure copies.
 * Nothing in here is known to the firmware core: it sees PWM counts going out and ADC counts coming in. */
#ifndef PULSETRAINER_SOLENOID_H
#define PULSETRAINER_SOLENOID_H

#include <stdint.h>

#ifndef PLANT_REAL
#define PLANT_REAL double
#endif
typedef PLANT_REAL real;

/* Complete types, so that a port can declare both statically (about 230 kB, half of it with float). */
#include "plant_state.h"

void solenoid_as_built(struct solenoid_params *p); /* the device of the paper: friction, eddy currents, noise */
void solenoid_ideal(struct solenoid_params *p);    /* static hysteresis, electronics and sensor noise only */

/* Everything that can be chosen from outside, by name: see solenoid_params.c for names, units and
 * ranges. An imperfection that is 0 is absent. 0: done; -1: no such parameter; -2: outside its range. */
int solenoid_set(struct solenoid_params *p, const char *name, double value);

void solenoid_init(struct solenoid *s, const struct solenoid_params *p);

/* Advance 100 us with the PWM on for pwm_on of every pwm_period counts. */
void solenoid_step(struct solenoid *s, uint16_t pwm_on, uint16_t pwm_period);

/* 12-bit conversions of the shunt amplifier (0..2 A) and the force amplifier (-1..17 N over 0..4095). */
static inline uint16_t solenoid_adc_current(const struct solenoid *s)
{
    return s->electronics.adc_current;
}

static inline uint16_t solenoid_adc_force(const struct solenoid *s)
{
    return s->electronics.adc_force;
}

#endif
