/* What may never happen to a finger: limits, a silent host, sensors that cannot be true, what
 * follows a kill.
 *
 * Runs in the tick before the PID's output is applied. Units in names: 100 uA, mN, ticks of 100 us, converter counts,
 * counts of the PWM. Every constant says where it comes from. */
#ifndef PULSETRAINER_SAFETY_H
#define PULSETRAINER_SAFETY_H

#include <stdbool.h>
#include <stdint.h>

#include "heat.h"
#include "protocol.h"

/* Over-force: two points a sample above, one back a sample below. Three in a row trip (0.3 ms: a finger feels
 * nothing shorter than a ms), and so does whatever is above for more than a third of the time: 16.5, 16.5, 14.9 N
 * for ever is an over-force, one wild sample in ten is none. */
#define SAFETY_FORCE_UP 2u
#define SAFETY_FORCE_DOWN 1u
#define SAFETY_FORCE_FULL 6u

/* A converter at its end: of 4096 counts the last two on either side, to allow for its offset error of a count or
 * two. The current needs no such check: no count is legitimate, and the other end is beyond every current trip. */
#define SAFETY_RAIL_DEBOUNCE 3u
#define SAFETY_RAIL_LOW 1u
#define SAFETY_RAIL_HIGH 4093u

/* The comparator watches the unfiltered shunt: three ticks in a row (36 chopped periods) are no switching spike. */
#define SAFETY_COMPARATOR_TICKS 3u

/* What takes milliseconds to tell takes turns: each of these checks is made in every fourth tick. */
#define SAFETY_TURNS 4u

/* A reading that does not change by one count in 10 ms while what moves it goes on. 10 ms are four time constants
 * of the coil (12 mH / 5 ohm = 2.4 ms), so the true current has followed by then. Reference: 50 mA are 102
 * counts of the converter. Duty: 400 counts of the PWM are 0.62 V, 0.12 A through 5 ohm; a wrong guess of the diode's
 * drop at the least supply (6 V: 319 counts) may move it by less while no current flows. This finds a reading
 * that stands still under a constant reference: the integral winds up, 0.056 counts a tick for each 100 uA of error. */
#define SAFETY_FROZEN_TICKS 100u
#define SAFETY_FROZEN_REFERENCE_100UA 500
#define SAFETY_FROZEN_DUTY_COUNTS 400
/* Force: what the current has to move by grows with the force trip in force, 0.3 A and 0.04 A for each newton:
 * 0.42 A at 3 N, where 3 N need 0.59 A; 0.9 A at 15 N. An amplifier that clips at 10.5 N repeats itself over 0.81 A of
 * the as-built loop, an honest friction of 0.6 N over 0.3 A: neither is frozen. */
#define SAFETY_FROZEN_FORCE_BASE_100UA 3000
#define SAFETY_FROZEN_FORCE_PER_5_MN 2

/* No current although driven. 50 mA at a quarter of the drive for 5 ms: a quarter is 12.6 V / 4 - 0.6 V = 2.5 V, which
 * gives 0.5 A through 5 ohm within two time constants; a tenth of it is no copper. Half the reference at full
 * drive for 30 ms: full drive gives 2.4 A, and the slew limit lets the reference rise for 10 ms. */
#define SAFETY_NO_CURRENT_100UA 500
#define SAFETY_NO_CURRENT_TICKS 50u
#define SAFETY_WEAK_TICKS 300u

/* Voltage on the coil against the current that is read, averaged over 0.2 s, so that L di/dt falls out: a full
 * stroke within the window is 15000 * 12.5 / 2048 = 91 counts with 20 mH, and SPAN holds 50 mH: where the run takes
 * the coil for one of more, it is that stroke and DIODE.
 * duty = OFFSET + i * OHMS / 65536 with the run's feed-forward of the resistance (compiled: 12 V, 0.6 V, 5 ohm; another
 * where a host has measured the coil). HIGH is 1.55 times the resistive part: copper 80 K warmer 1.31, coil + 5 %,
 * supply - 10 % 1.11, together 1.53. A shunt or gain that lost half reads 2.0. LOW is 0.4: a supply of 24 V instead of
 * 12 V reads 0.51. SPAN is 0.4 V, the spread of a diode's drop and of what a small current rounds to. */
#define SAFETY_VOLTAGE_SHIFT 9u /* of samples, one in every fourth tick */
#define SAFETY_VOLTAGE_TICKS (SAFETY_TURNS << SAFETY_VOLTAGE_SHIFT)
#define SAFETY_VOLTAGE_OFFSET_COUNTS 374
#define SAFETY_VOLTAGE_HIGH_20THS 31
#define SAFETY_VOLTAGE_LOW_20THS 8
#define SAFETY_VOLTAGE_SPAN_COUNTS 250
#define SAFETY_VOLTAGE_DIODE_COUNTS 22

/* Force against current: at least 0.7 of the as-built device's rising branch less MARGIN, at most 1.35 of its
 * falling one plus 1.5 N (tables in safety.c, measured on the simulated device; 40 drawn ones lie within 0.74 and
 * 1.17 of it). MARGIN is a 15th of the force trip, 1 N at 15 N and 0.2 N at 3 N: what a drifting zero may take away must
 * shrink with what the finger was promised. A sensor that reads half is found where the truth passes the trip F:
 * 0.5 F < 0.7 F / s - F / 15 for every device whose force is s <= 1.23 of the nominal. The current is filtered over
 * 256 ticks (26 ms): a force that lags as much is honest. 50 ms in all, two points up and one back, counted across
 * pulses. Where the floor is below 0.3 N nothing is counted: that is two standard deviations of a sensor three times
 * as noisy as built (0.135 N). */
#define SAFETY_PLAUSIBLE_SHIFT 8u
#define SAFETY_PLAUSIBLE_UP 2u
#define SAFETY_PLAUSIBLE_DOWN 1u
#define SAFETY_PLAUSIBLE_FULL 250u /* of looks in every fourth tick */
#define SAFETY_FLOOR_MARGIN_PER_TRIP 15
#define SAFETY_FLOOR_LEAST_MN 300
#define SAFETY_CEILING_MARGIN_MN 1500
#define SAFETY_NO_FORCE_MN 300 /* under the floor and no more than this: none at all */

/* The force before a play, filtered over 32 ticks (3 ms). The FSG15N1A's null is off by up to 15 mV, at
 * 0.24 mV a gram 0.61 N; what is left after a full stroke (remanence and friction 0.63 N, creep after 20 s another
 * 0.2 N, measured on 40 drawn devices) can only add: -0.75 to 1.75 N. */
#define SAFETY_ZERO_SHIFT 5u
#define SAFETY_ZERO_LOW_MN (-750)
#define SAFETY_ZERO_HIGH_MN 1750

/* No current may flow: 0.1 A presses with 0.1 N. While driven with a reference of zero for 200 ms (the integral
 * needs some). After a kill the current falls with L/R, 2.4 ms as built; 100 ms are enough for 0.2 H through 5 ohm,
 * (1.5 + 0.12) * exp(-0.1 / 0.04) - 0.12 = 0.01 A with the diode's 0.6 V. Longer: the output is not off. The
 * force says so as well, where the shunt cannot: it has not once fallen to what is read before a play, in 500 ms. */
#define SAFETY_STRAY_100UA 1000
#define SAFETY_STRAY_TICKS 2000u
#define SAFETY_OFF_TICKS 1000u
#define SAFETY_ARM_TICKS 32u /* before a play: what flowed in the play before it is none of it */
#define SAFETY_RELEASE_TICKS 5000u

struct safety_limits {
    int16_t current_trip_100uA;
    int16_t force_trip_mN;
    uint16_t heartbeat_ticks;
    uint32_t on_ticks;
    int32_t coil_ohms;    /* counts for 65536 * 100 uA: what the run takes for the coil's resistance */
    int32_t coil_henries; /* counts for 256 * 100 uA a tick: and for its inductance */
};

struct safety_input {
    int16_t reference_100uA; /* after the slew limit */
    int16_t current_100uA;
    int16_t force_mN;
    uint16_t current_counts;
    uint16_t force_counts;
    uint16_t duty_counts; /* applied since the last tick */
    uint16_t full_counts; /* the largest duty */
    bool comparator;      /* the hardware has cut the current since the last tick */
    bool armed;           /* ARMED, RUNNING or RAMPING */
    bool awaited;         /* ARMED or RUNNING: without signs of life from the host this ends */
    bool driving;         /* RUNNING or RAMPING: the output is on */
};

/* A reading that stands still, and how far what should move it has moved since. */
struct safety_still {
    uint16_t counts;
    uint16_t ticks;
};
struct safety_span {
    int16_t low;
    int16_t high;
};

/* Tick only, but for what is marked; the main loop writes the rest in critical sections, at ARM and reset. */
struct safety {
    struct safety_limits limits;
    volatile uint16_t silent_ticks; /* shared: the tick counts, a sign of life in the main loop clears */
    uint32_t on_ticks;
    uint16_t over_force;
    uint16_t force_rail;
    uint16_t comparator;
    uint16_t no_current;
    uint16_t weak_current;
    uint16_t too_little_force;
    uint16_t too_much_force;
    uint16_t stray;
    uint16_t not_off;
    uint16_t release_ticks; /* left for the force to fall after a run; 0: it has */
    struct safety_still current_still;
    struct safety_span reference_span;
    struct safety_span duty_span;
    struct safety_still force_still;
    struct safety_span current_span;
    uint8_t turn;
    int16_t floor_margin_mN;    /* from the limits */
    int16_t frozen_force_100uA; /* from the limits */
    int32_t voltage_high_ohms;  /* from the limits */
    int32_t voltage_low_ohms;   /* from the limits */
    int16_t voltage_span;       /* from the limits */
    uint16_t voltage_samples;
    int32_t voltage_duty;    /* sums over the present window */
    int32_t voltage_current;
    int32_t slow_current;    /* 100 uA times 2^SAFETY_PLAUSIBLE_SHIFT */
    int32_t slow_force;      /* mN times 2^SAFETY_ZERO_SHIFT */
    struct heat heat;
};

/* At reset, with the readings of then. */
void safety_init(struct safety *s, struct hal_kept *kept, bool power_on, int16_t force_mN);

/* At ARM: limits, and the counters of the run to zero; the heat stays. */
void safety_begin(struct safety *s, const struct safety_limits *limits);

void safety_alive(struct safety *s);                /* a sign of life came from the host */
uint8_t safety_before_arm(const struct safety *s);  /* PT_FAULT_FORCE_ZERO, _STRAY_CURRENT or _NONE */

/* The gravest fault found in this tick, or PT_FAULT_NONE. */
uint8_t safety_tick(struct safety *s, const struct safety_input *in);

/* 0 none, 1 ramps down before the output goes off, 2 off at once, 3 the output cannot be switched off. */
uint8_t safety_gravity(uint8_t fault);
#define SAFETY_RAMPS 1u

#endif
