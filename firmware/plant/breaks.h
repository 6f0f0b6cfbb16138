/* What a test or a sceptic can break in the simulated device, at a tick of the play. */
#ifndef PULSETRAINER_BREAKS_H
#define PULSETRAINER_BREAKS_H

#include <stdbool.h>
#include <stdint.h>

enum breaks_what {
    BREAKS_CURRENT_RAIL, BREAKS_CURRENT_ZERO, BREAKS_CURRENT_FROZEN,
    BREAKS_FORCE_HIGH, BREAKS_FORCE_RAIL, BREAKS_FORCE_ZERO, BREAKS_FORCE_FROZEN,
    BREAKS_TICK_OVERRUN, BREAKS_RESET, BREAKS_HANG, BREAKS_COUNT
};
extern const char *const breaks_names[BREAKS_COUNT]; /* the same as BREAKS in pulsetrainer/simulation/options.py */

void breaks_at(enum breaks_what what, uint32_t tick_plus_one); /* 0: never */
void breaks_play(bool running, uint32_t tick);                 /* where the play is; before the others, each tick */
bool breaks_is(enum breaks_what what);                         /* broken in this tick */
bool breaks_once(enum breaks_what what);                       /* the same, once */

/* What the converters give: the truth in, the reading out. */
void breaks_sensors(uint16_t *current, uint16_t *force);

#endif
