/* The tick and the states: what is driven, what is latched, and the one place where the state changes. */
#ifndef PULSETRAINER_CONTROL_H
#define PULSETRAINER_CONTROL_H

#include <stdbool.h>
#include <stdint.h>

#include "pid.h"
#include "protocol.h"
#include "safety.h"
#include "telemetry.h"
#include "wave.h"

/* The way to zero, whatever the parameters say: 1.5 A in 100 ms, ten times slower than the slew limit and still
 * no jerk, and within the 300 ms that a finger may be pressed after the last sign of life. */
#define CONTROL_RAMP_100UA_PER_TICK 15
#define CONTROL_RAMP_TICKS 1001u

/* What a host may choose for a run; in force from ARM on. */
struct control_settings {
    struct safety_limits limits;
    struct pid_gains gains;
    int16_t slew_100uA_per_tick;
};

struct control_snapshot {
    uint32_t tick;
    int16_t reference_100uA;
    int16_t current_100uA;
    int16_t force_mN;
    uint16_t duty_counts;
    uint8_t state;
};

/* "Shared": written by both contexts, by the main loop in critical sections only. "Tick": written by the tick
 * only, read by the main loop in critical sections where it is wider than the processor reads at once. */
struct control {
    volatile uint8_t state;           /* shared, through transition() only: PT_STATE_... */
    volatile uint8_t fault;           /* shared: the first cause, latched until it is cleared by name */
    volatile uint8_t worst;           /* shared: the gravest since then */
    struct control_snapshot snapshot; /* shared: at the first cause */
    volatile uint32_t tick;           /* shared: of the session */
    uint8_t session;                  /* main */
    volatile bool in_tick;            /* tick */
    volatile bool nested;             /* tick: another one broke into it and has switched off */
    volatile bool ticked;             /* shared: since the main loop last looked */
    struct safety_input now;          /* shared: the readings, the reference, the duty of this tick */
    int16_t slew_100uA_per_tick;      /* main, at ARM */
    struct wave wave;                 /* shared: see wave.h */
    struct pid pid;                   /* shared */
    struct pid_gains ramp_gains;      /* main, at ARM */
    struct safety safety;             /* shared: see safety.h */
    struct telemetry telemetry;       /* shared: see telemetry.h */
};
extern struct control control;

void control_init(void);
void control_tick(void); /* 10 kHz, interrupt context */

/* Main loop. The commands check and change the state in one critical section; they return a NAK code or 0. */
void control_watch(void); /* acts where no tick comes any more */
bool control_is_alive(void); /* a tick has come since the last call */
uint8_t control_wave_begin(uint32_t total, uint16_t ticks_per_sample, uint32_t crc);
uint8_t control_wave_publish(uint8_t count);
uint8_t control_wave_commit(uint32_t count, uint32_t crc);
uint8_t control_wave_check(uint32_t count, uint32_t crc, bool end);
void control_wave_forget(void);
uint8_t control_arm(const struct control_settings *settings);
uint8_t control_start(void);
void control_stop(void);
uint8_t control_clear(uint8_t fault, uint8_t worst);
uint8_t control_coil_heat(uint16_t per_mille);

#endif
