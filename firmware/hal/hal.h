/* What the core asks of the hardware; each port defines these functions (link time, no pointers).
 *
 * Two contexts: app_tick() runs in the 10 kHz interrupt, app_poll() in the main loop. */
#ifndef PULSETRAINER_HAL_H
#define PULSETRAINER_HAL_H

#include <stdbool.h>
#include <stdint.h>

/* 120 kHz from the auxiliary clock of the real device (117.92 MHz * 8 / 120 kHz - 8). The published
 * device ran at 115 kHz, 11.5 periods a tick; at 120 kHz a tick is exactly 12 periods, so the ADC
 * samples every tick at the same phase of the current ripple. */
#define HAL_PWM_PERIOD 7853u

struct hal_adc {
    uint16_t current; /* 12 bits: 0..2 A */
    uint16_t force;   /* 12 bits: -1..17 N */
};

/* Interrupt context. */
bool hal_adc_read(struct hal_adc *out); /* valid from app_init on; false: not a new pair since the last tick */
void hal_pwm_set(uint16_t on_counts);   /* of HAL_PWM_PERIOD; does not switch the output on */
void hal_pwm_kill(void);                /* output off by the shortest way, stays off until hal_pwm_enable */
bool hal_tick_overrun(void);            /* true once for each missed tick */
bool hal_comparator(void);              /* the hardware has cut the current since the last call */

/* Both contexts. */
void hal_pwm_enable(void);
bool hal_tick_lost(void); /* true once when no tick came in time and the port has switched off by itself */

/* Main loop. */
bool hal_uart_rx(uint8_t *byte);                         /* false: nothing there */
uint16_t hal_uart_tx_space(void);                        /* bytes that hal_uart_tx will take */
bool hal_uart_tx_idle(void);                             /* nothing left to send */
void hal_uart_tx(const uint8_t *bytes, uint16_t count);  /* at most hal_uart_tx_space() */
void hal_watchdog_feed(void);

/* Hold the tick interrupt off; not nested. Both are compiler barriers. */
void hal_critical_enter(void);
void hal_critical_exit(void);

/* Outlives every reset but power-on; after that it holds anything. */
struct hal_kept {
    uint32_t heat;    /* (100 uA)^2 */
    uint32_t assumed; /* 1: nobody has told */
    uint32_t check;
};
struct hal_kept *hal_kept(void);

/* Identity. */
uint8_t hal_reset_cause(void);  /* PT_RESET_... */
uint32_t hal_boot_nonce(void);  /* another value at each start */
uint32_t hal_build_hash(void);  /* of the sources; 0: unknown */
const char *hal_serial(void);   /* at most 16 characters */

#endif
