#include "breaks.h"

#define HIGH_FORCE 3800u /* 15.7 N */
#define NO_FORCE 228u    /* and a count of dither: a living converter */

const char *const breaks_names[BREAKS_COUNT] = {
    "current-rail", "current-zero", "current-frozen", "force-high", "force-rail",
    "force-zero",   "force-frozen", "tick-overrun",   "reset",      "hang",
};

static uint32_t sets_in[BREAKS_COUNT]; /* tick of the play plus 1; 0: never */
static bool playing;
static uint32_t now;
static bool has_read;
static uint16_t last_current;
static uint16_t last_force;
static uint16_t dither;

void breaks_at(enum breaks_what what, uint32_t tick_plus_one)
{
    sets_in[what] = tick_plus_one;
}

void breaks_play(bool running, uint32_t tick)
{
    playing = running;
    now = tick;
}

bool breaks_is(enum breaks_what what)
{
    return sets_in[what] != 0 && playing && now + 1u >= sets_in[what];
}

bool breaks_once(enum breaks_what what)
{
    bool is = breaks_is(what);
    if (is)
        sets_in[what] = 0;
    return is;
}

void breaks_sensors(uint16_t *current, uint16_t *force)
{
    /* Frozen is what was read last; the very first reading has nothing before it. */
    if (breaks_is(BREAKS_CURRENT_FROZEN) && has_read)
        *current = last_current;
    if (breaks_is(BREAKS_FORCE_FROZEN) && has_read)
        *force = last_force;
    has_read = true;
    last_current = *current;
    last_force = *force;
    dither ^= 1u;
    if (breaks_is(BREAKS_CURRENT_RAIL))
        *current = 4095;
    if (breaks_is(BREAKS_CURRENT_ZERO))
        *current = 0;
    if (breaks_is(BREAKS_FORCE_HIGH))
        *force = HIGH_FORCE;
    if (breaks_is(BREAKS_FORCE_RAIL))
        *force = 0;
    if (breaks_is(BREAKS_FORCE_ZERO))
        *force = (uint16_t)(NO_FORCE + dither);
}
