/* Between the files of firmware/plant. */
#ifndef PULSETRAINER_PLANT_H
#define PULSETRAINER_PLANT_H

#include "solenoid.h"

/* One row of the parameter table. */
struct plant_parameter {
    const char *name;
    const char *unit;
    double low, high;
    int zero_absent; /* an imperfection: 0 is always allowed and means absent */
    uint16_t offset; /* of the member in solenoid_params */
    const char *meaning;
};
extern const struct plant_parameter plant_parameters[];
extern const int32_t plant_parameter_count;

/* series.c: the few transcendental numbers that initialisation needs */
real plant_exp_loss(real x); /* 1 - exp(-x), x >= 0 */
void plant_cos_sin(real angle, real *cosine, real *sine);
void plant_exp_2x2(const real a[4], real out[4]);

/* lag.c */
void plant_lag_init(struct plant_lag *lag, real tau_s, real at);
real plant_lag_step(struct plant_lag *lag, real input);

/* random.c */
void plant_random_init(struct plant_random *r, uint32_t seed, uint32_t stream);
real plant_random_uniform(struct plant_random *r); /* 0 <= x < 1 */
real plant_random_normal(struct plant_random *r);  /* mean 0, standard deviation 1, never beyond 4.9 */

/* preisach_plant.c */
void plant_preisach_init(struct plant_preisach *p, uint32_t seed);
real plant_preisach_step(struct plant_preisach *p, real field);

/* imperfections_of_current.c: what lies between the current and the field that the hysteresis sees */
void plant_before_init(struct plant_before *b, const struct solenoid_params *is);
real plant_before_step(struct plant_before *b, const struct solenoid_params *is, real current, real force);

/* imperfections_of_force.c: between the magnetic force and the finger, then between finger and amplifier */
void plant_after_init(struct plant_after *a, const struct solenoid_params *is);
real plant_after_step(struct plant_after *a, const struct solenoid_params *is, real current, real magnetic);
real plant_sense(struct plant_after *a, const struct solenoid_params *is, uint32_t tick, real force);

/* electronics.c */
void plant_electronics_init(struct plant_electronics *e, const struct solenoid_params *is);
void plant_electronics_step(struct plant_electronics *e, const struct solenoid_params *is, real current,
                            real sensed);

/* solenoid.c: a tick with the current imposed, as if the coil had an ideal driver */
void plant_step_current(struct solenoid *s, real current);

#endif
