/* A HAL for tests: the current follows the PWM through a small coil, everything can be overridden. */
#ifndef PULSETRAINER_FAKE_HAL_H
#define PULSETRAINER_FAKE_HAL_H

#include <stdbool.h>
#include <stdint.h>

#include "frame.h"

struct fake {
    bool pwm_enabled;
    uint16_t pwm;
    int32_t current;       /* 100 uA times 256 */
    int32_t force_current; /* >= 0: what the current converter reads instead */
    int32_t force_force;   /* the same for the force converter */
    uint32_t kills;
    uint32_t fed;
    bool overrun;
    bool comparator; /* has cut the current in each tick */
    bool tick_lost;
    bool stale;      /* no new readings */
    bool nest_read;  /* a tick breaks into the next tick as it reads */
    bool nest_set;   /* the same, just before it writes the duty */
    uint16_t tx_space;
    uint8_t reset_cause;
    uint32_t nonce;
};
extern struct fake fake;
extern void (*fake_after_tick)(void);        /* NULL: nobody cares */
extern void (*fake_on_critical)(bool enter); /* NULL: nobody cares */

void fake_reset(void);                  /* power on, the coil cold and known to be: also calls app_init */
void fake_ticks(uint32_t n);            /* n ticks, the main loop after each */
void fake_ticks_without_main(uint32_t n);
bool fake_output_on(void);

void fake_wire(const uint8_t *bytes, uint16_t count);    /* as fake_receive, but nobody looks yet */
void fake_receive(const uint8_t *bytes, uint16_t count); /* raw bytes, at most 270 */

/* Sends a command and returns the reply (its payload valid until the next call); type 0: none came. */
struct frame fake_command(uint8_t type, const uint8_t *payload, uint8_t length);
struct frame fake_command_seq(uint8_t type, uint8_t seq, const uint8_t *payload, uint8_t length);
struct frame fake_beat(void);        /* a heartbeat with the next counter */
struct frame fake_clear_fault(void); /* names what is latched */
uint16_t fake_telemetry(uint8_t *payload); /* oldest telemetry block received, its length; 0: none */

#endif
