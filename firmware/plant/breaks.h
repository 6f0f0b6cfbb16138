/* What a test or a sceptic can break in the simulated device, at a tick of the play. Broken it stays, whatever the
 * firmware does then, until the program ends; what happens once (overrun, reset) happens once. */
#ifndef PULSETRAINER_BREAKS_H
#define PULSETRAINER_BREAKS_H

#include <stdbool.h>
#include <stdint.h>

enum breaks_what {
    BREAKS_CURRENT_RAIL,
    BREAKS_CURRENT_ZERO,
    BREAKS_CURRENT_FROZEN,
    BREAKS_FORCE_HIGH,
    BREAKS_FORCE_RAIL,
    BREAKS_FORCE_ZERO,
    BREAKS_FORCE_FROZEN,
    BREAKS_TICK_OVERRUN,
    BREAKS_RESET,
    BREAKS_HANG,
    BREAKS_CURRENT_LOW,   /* stands still two counts below what it last was */
    BREAKS_CURRENT_STUCK, /* stands still at 61 mA */
    BREAKS_SHUNT_HALF,    /* the shunt's amplifier has lost half its gain; the comparator sees it too */
    BREAKS_FORCE_HALF,
    BREAKS_STUCK_ON,      /* the transistor conducts, whatever its gate says */
    BREAKS_COMPARATOR,    /* it cuts the current although there is none too much */
    BREAKS_TICK_LOST,     /* the control interrupt comes no more */
    BREAKS_CONVERTER,     /* no new readings */
    BREAKS_COUNT
};
extern const char *const breaks_names[BREAKS_COUNT]; /* the same as BREAKS in pulsetrainer/simulation/options.py */

void breaks_at(enum breaks_what what, uint32_t tick_plus_one); /* 0: never; mends it */
void breaks_play(bool running, uint32_t tick);                 /* where the play is; before the others, each tick */
bool breaks_is(enum breaks_what what);                         /* broken by now */
bool breaks_once(enum breaks_what what);                       /* the same, once */

/* What the converters give: the truth in, the reading out. False: no new one. */
bool breaks_sensors(uint16_t *current, uint16_t *force);

#endif
