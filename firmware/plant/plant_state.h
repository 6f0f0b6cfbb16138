/* What the simulated device is (solenoid_params) and where it stands (solenoid).
 * Included by solenoid.h; only the files of firmware/plant look inside. */
#ifndef PULSETRAINER_PLANT_STATE_H
#define PULSETRAINER_PLANT_STATE_H

#ifdef __FAST_MATH__
#error "the plant promises the same bits on every machine: build it without -ffast-math"
#endif

/* A literal of the plant's own precision: a bare 0.5 would drag a float build into double. */
#define R(literal) ((real)(literal))

#define PLANT_TICK_S R(1e-4)

/* 233 intervals over -0.07..1.70 A: more than four times finer than 48 levels over 1.5 A, and no node
 * but chance falls on theirs, so that a fitted model never has the truth's own grid. */
#define PLANT_NODES 234
#define PLANT_FIELD_LOW_A R(-0.07)
#define PLANT_FIELD_HIGH_A R(1.70)
#define PLANT_TURNS 512 /* a demagnetising spiral of 250 swings fits */

#define PLANT_DELAY_TICKS 512
#define PLANT_CREEP_ELEMENTS 3
#define PLANT_FRICTION_ELEMENTS 6

/* One member per row of the table in solenoid_params.c, which holds units, ranges and meanings. */
struct solenoid_params {
    real seed, noise_seed;
    real supply, supply_sag, resistance, inductance;
    real coil;
    real ambient;
    real noise, current_noise;

    real delay;
    real field_lag;
    real rate_widening;
    real load_dependence;
    real accommodation, accommodation_path;
    real thermal_drift, thermal_tau;
    real coulomb;
    real stick_slip;
    real resonance, resonance_zeta;
    real creep, creep_tau;
    real viscous;
    real output_lag;
    real periodic, periodic_frequency;
    real offset_drift;
    real step, step_gain, step_time;
    real condition_gain, condition_offset;
    real outliers, outlier_size;
    real saturation;
    real quantisation;
};

struct plant_random {
    uint64_t state;
};

/* First-order lag, exact for an input that is straight between ticks. */
struct plant_lag {
    real loss;  /* 1 - exp(-tick/tau) */
    real slope; /* weight of the last input increment */
    real input, output;
};

struct plant_preisach {
    real everett[PLANT_NODES * (PLANT_NODES + 1) / 2]; /* row alpha, column beta <= alpha */
    real reversible, bend;                             /* N at full current; its magnetic saturation */
    real turn_field[PLANT_TURNS];                      /* alternately a minimum and a maximum */
    real turn_force[PLANT_TURNS];
    int32_t turns;
    real field, force; /* irreversible part only */
    real tare;
};

struct plant_before {
    real ring[PLANT_DELAY_TICKS];
    int32_t ring_at, delay_whole;
    real delay_part;
    struct plant_lag field_lag;
    real widening_rate; /* tick / k^2 */
    real widening_input, widening_output;
};

struct plant_after {
    real path_input, path_force;
    real friction[PLANT_FRICTION_ELEMENTS];
    real stuck;
    real ring_position, ring_velocity; /* relative to the equilibrium; velocity over omega_n */
    real ring_force;
    real ring_step[4];
    real creep_strain[PLANT_CREEP_ELEMENTS], creep_loss[PLANT_CREEP_ELEMENTS];
    struct plant_lag output_lag;
    real viscous_input;
    real periodic_cos, periodic_sin, turn_cos, turn_sin;
};

struct plant_electronics {
    real pole_state;
    real section_gain[2], section_feedback[2], section_state[2][2];
    struct plant_random noise, wild;
    uint16_t adc_current, adc_force;
};

struct solenoid {
    struct solenoid_params is;
    uint32_t tick;
    real coil_loss;       /* 1 - exp(-tick R/L) */
    real heat, heat_loss; /* low-passed square of the current, A^2; 1 - exp(-tick/tau) */
    real ambient_loss;    /* of force, relative, by the room */
    real current;         /* A, true */
    real field;           /* A, what the static hysteresis sees */
    real magnetic;        /* N, static hysteresis alone */
    real force;           /* N, on the finger */
    real sensed;          /* N, what the force sensor makes of it, before noise and conversion */
    struct plant_preisach preisach;
    struct plant_before before;
    struct plant_after after;
    struct plant_electronics electronics;
};

#endif
