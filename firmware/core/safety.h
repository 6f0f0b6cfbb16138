/* What may never happen to a finger: limits, plausibility of the sensors, the latch.
 *
 * Runs in the tick before the PID output is applied. A hard fault kills the output in the same tick;
 * a soft one ramps the reference to zero first. */
#ifndef PULSETRAINER_SAFETY_H
#define PULSETRAINER_SAFETY_H

#include <stdbool.h>
#include <stdint.h>

#include "heat.h"
#include "protocol.h"

/* Debounce and plausibility, in ticks of 100 us, 100 uA and mN. */
#define SAFETY_FORCE_DEBOUNCE 3u
#define SAFETY_RAIL_DEBOUNCE 3u
#define SAFETY_RAIL_LOW 1u
#define SAFETY_RAIL_HIGH 4093u
#define SAFETY_FROZEN_CURRENT_SPAN 500   /* the reference moved by 50 mA ... */
#define SAFETY_FROZEN_CURRENT_TICKS 100u /* ... within at least 10 ms, the reading by not one count */
#define SAFETY_FROZEN_FORCE_SPAN 13000   /* the current moved by 1.3 A ... */
#define SAFETY_FROZEN_FORCE_TICKS 100u   /* ... within at least 10 ms: a lost current reading falls in one tick */
#define SAFETY_NO_CURRENT_LEVEL 500      /* 50 mA at a quarter of the full drive, for 5 ms: a dead shunt */
#define SAFETY_NO_CURRENT_TICKS 50u
#define SAFETY_WEAK_TICKS 300u           /* half the reference at full drive, for 30 ms: a weak supply */
#define SAFETY_NO_FORCE_CURRENT 12000
#define SAFETY_NO_FORCE_LEVEL 300
#define SAFETY_NO_FORCE_TICKS 5000u
#define SAFETY_STRAY_CURRENT 1000
#define SAFETY_STRAY_TICKS 2000u

struct safety_input {
    int16_t reference; /* after the slew limit */
    int16_t current;
    int16_t force;
    uint16_t current_counts;
    uint16_t force_counts;
    uint16_t duty; /* applied since the last tick */
    uint16_t full; /* the largest duty */
    bool armed;    /* ARMED, RUNNING or RAMPING */
    bool awaited;  /* ARMED or RUNNING: without signs of life from the host this ends */
    bool driving;  /* RUNNING or RAMPING: the output is on */
};

/* A reading, and how far what should move it has moved since it last changed. */
struct safety_still {
    uint16_t counts;
    uint16_t ticks;
    int16_t low;
    int16_t high;
};

struct safety {
    /* Limits: set from the parameters while idle. */
    int16_t current_trip;
    int16_t force_trip;
    uint16_t heartbeat_ticks;
    uint32_t on_ticks_limit;
    /* Counters. */
    volatile uint16_t silent_ticks;
    uint32_t on_ticks;
    uint16_t over_force;
    uint16_t current_rail;
    uint16_t force_rail;
    uint16_t no_current;
    uint16_t weak_current;
    uint16_t no_force;
    uint16_t stray;
    struct safety_still current_still;
    struct safety_still force_still;
    struct heat heat;
};

void safety_init(struct safety *s, struct hal_kept *kept, bool power_on);
void safety_begin(struct safety *s); /* at ARM: counters of the run to zero; the heat stays */
void safety_alive(struct safety *s); /* a sign of life came from the host */

/* The first fault found in this tick, or PT_FAULT_NONE. */
uint8_t safety_tick(struct safety *s, const struct safety_input *in);

/* True for a fault that ramps down before the output goes off. */
bool safety_is_soft(uint8_t fault);

#endif
