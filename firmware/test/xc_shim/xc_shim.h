/* What a test sees of the shim: the log, and the far ends of UART, converters and reset. */
#ifndef PULSETRAINER_XC_SHIM_TEST_H
#define PULSETRAINER_XC_SHIM_TEST_H

#include <stdint.h>

#include "xc.h"

struct xc_shim_entry {
    const char *name;
    uint16_t value;
};

void xc_shim_reset(uint16_t rcon); /* all registers as after that reset; memory stays; the log is empty */
void xc_shim_forget(void);         /* empties the log */
int32_t xc_shim_count(void);
const struct xc_shim_entry *xc_shim_entry(int32_t at);
void xc_shim_wait_for_ever(volatile uint16_t *reg); /* this flag never comes up */
void xc_shim_lock_pwm(void); /* as with PWMLOCK = ON: writes to IOCON1 and FCLCON1 are ignored */

void xc_shim_receive(const uint8_t *bytes, uint16_t count); /* into the receiver, then its interrupt */
uint16_t xc_shim_sent(uint8_t *bytes, uint16_t most);       /* runs the sender's interrupt while enabled */
void xc_shim_overrun(void);
void xc_shim_tick(uint16_t current, uint16_t force);        /* a pair of conversions, then its interrupt */
void xc_shim_no_tick(void);                 /* one and a half ticks without a conversion */
void xc_shim_unready(void);                 /* the current's converter has no new value any more */
void xc_shim_next_conversion_early(void); /* the next one ends while the tick is still at work */

#endif
