#include "breaks.h"

#define STUCK_CURRENT 125u /* 61 mA */
#define HIGH_FORCE 3800u   /* 15.7 N */
#define NO_FORCE 228u      /* and a count of dither: a living converter */

const char *const breaks_names[BREAKS_COUNT] = {
    "current-rail", "current-zero",  "current-frozen", "force-high",  "force-rail", "force-zero",
    "force-frozen", "tick-overrun",  "reset",          "hang",        "current-low", "current-stuck",
    "shunt-half",   "force-half",    "stuck-on",       "comparator",  "tick-lost",  "converter",
};

static uint32_t sets_in[BREAKS_COUNT]; /* tick of the play plus 1; 0: never */
static bool struck[BREAKS_COUNT];
static bool any; /* has ever struck: a sound device shall not pay for what could break */
static bool has_read;
static uint16_t last_current;
static uint16_t last_force;
static uint16_t dither;

void breaks_at(enum breaks_what what, uint32_t tick_plus_one)
{
    sets_in[what] = tick_plus_one;
    struck[what] = false;
}

void breaks_play(bool running, uint32_t tick)
{
    for (int k = 0; k < BREAKS_COUNT; k++)
        if (running && sets_in[k] != 0 && tick + 1u >= sets_in[k])
            struck[k] = any = true;
}

bool breaks_is(enum breaks_what what)
{
    return struck[what];
}

bool breaks_once(enum breaks_what what)
{
    bool is = struck[what];
    if (is)
        breaks_at(what, 0);
    return is;
}

static uint16_t halved(uint16_t counts, uint16_t rest)
{
    return (uint16_t)(rest + (counts - rest) / 2);
}

bool breaks_sensors(uint16_t *current, uint16_t *force)
{
    dither ^= 1u;
    if (!any) {
        has_read = true;
        last_current = *current;
        last_force = *force;
        return true;
    }
    if (struck[BREAKS_SHUNT_HALF])
        *current = halved(*current, 0);
    if (struck[BREAKS_FORCE_HALF])
        *force = halved(*force, NO_FORCE);
    /* Frozen is what was read last; the very first reading has nothing before it. */
    if (struck[BREAKS_CONVERTER] || (struck[BREAKS_CURRENT_FROZEN] && has_read))
        *current = last_current;
    if (struck[BREAKS_CONVERTER] || (struck[BREAKS_FORCE_FROZEN] && has_read))
        *force = last_force;
    if (struck[BREAKS_CURRENT_LOW])
        *current = last_current;
    has_read = true;
    last_current = *current;
    last_force = *force;
    if (struck[BREAKS_CURRENT_LOW])
        *current = (uint16_t)(last_current > 2u ? last_current - 2u : 0u);
    if (struck[BREAKS_CURRENT_STUCK])
        *current = STUCK_CURRENT;
    if (struck[BREAKS_CURRENT_RAIL])
        *current = 4095;
    if (struck[BREAKS_CURRENT_ZERO])
        *current = 0;
    if (struck[BREAKS_FORCE_HIGH])
        *force = HIGH_FORCE;
    if (struck[BREAKS_FORCE_RAIL])
        *force = 0;
    if (struck[BREAKS_FORCE_ZERO])
        *force = (uint16_t)(NO_FORCE + dither);
    return !struck[BREAKS_CONVERTER];
}
