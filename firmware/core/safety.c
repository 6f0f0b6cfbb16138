#include "safety.h"

void safety_init(struct safety *s, struct hal_kept *kept, bool power_on)
{
    heat_init(&s->heat, kept, power_on);
    s->stray = 0;
    safety_begin(s);
}

static void still_reset(struct safety_still *m)
{
    m->counts = 0xFFFFu; /* no 12-bit reading: the first one counts as a change */
    m->ticks = 0;
    m->low = 0;
    m->high = 0;
}

void safety_begin(struct safety *s)
{
    s->silent_ticks = 0;
    s->on_ticks = 0;
    s->over_force = 0;
    s->current_rail = 0;
    s->force_rail = 0;
    s->no_current = 0;
    s->weak_current = 0;
    s->no_force = 0;
    still_reset(&s->current_still);
    still_reset(&s->force_still);
}

void safety_alive(struct safety *s)
{
    s->silent_ticks = 0;
}

bool safety_is_soft(uint8_t fault)
{
    return fault == PT_FAULT_HEARTBEAT || fault == PT_FAULT_UNDERRUN || fault == PT_FAULT_COIL_HEAT ||
           fault == PT_FAULT_ON_TIME || fault == PT_FAULT_WAVE_CRC;
}

/* Counts consecutive ticks of a condition; true from the `limit`-th on. */
static bool lasts(uint16_t *counter, bool condition, uint16_t limit)
{
    if (!condition) {
        *counter = 0;
        return false;
    }
    if (*counter < limit)
        (*counter)++;
    return *counter >= limit;
}

/* How far `mover` has gone since the reading last changed. */
static int32_t still_span(struct safety_still *m, uint16_t counts, int16_t mover)
{
    if (counts != m->counts) {
        m->counts = counts;
        m->ticks = 0;
        m->low = mover;
        m->high = mover;
        return 0;
    }
    if (m->ticks < 0xFFFFu)
        m->ticks++;
    if (mover < m->low)
        m->low = mover;
    if (mover > m->high)
        m->high = mover;
    return (int32_t)m->high - m->low;
}

static uint8_t sensors(struct safety *s, const struct safety_input *in)
{
    bool current_rail = in->current_counts >= SAFETY_RAIL_HIGH;
    if (lasts(&s->current_rail, current_rail, SAFETY_RAIL_DEBOUNCE))
        return PT_FAULT_CURRENT_RAIL;
    bool force_rail = in->force_counts <= SAFETY_RAIL_LOW || in->force_counts >= SAFETY_RAIL_HIGH;
    if (lasts(&s->force_rail, force_rail, SAFETY_RAIL_DEBOUNCE))
        return PT_FAULT_FORCE_RAIL;
    if (!in->driving)
        return PT_FAULT_NONE;

    int32_t span = still_span(&s->current_still, in->current_counts, in->reference);
    if (span >= SAFETY_FROZEN_CURRENT_SPAN && s->current_still.ticks >= SAFETY_FROZEN_CURRENT_TICKS)
        return PT_FAULT_CURRENT_FROZEN;
    span = still_span(&s->force_still, in->force_counts, in->current);
    if (span >= SAFETY_FROZEN_FORCE_SPAN && s->force_still.ticks >= SAFETY_FROZEN_FORCE_TICKS)
        return PT_FAULT_FORCE_FROZEN;

    bool dead = in->duty > in->full / 4u && in->current < SAFETY_NO_CURRENT_LEVEL;
    if (lasts(&s->no_current, dead, SAFETY_NO_CURRENT_TICKS))
        return PT_FAULT_NO_CURRENT;
    bool weak = in->duty >= in->full && in->current < in->reference / 2;
    if (lasts(&s->weak_current, weak, SAFETY_WEAK_TICKS))
        return PT_FAULT_NO_CURRENT;
    bool no_force = in->current >= SAFETY_NO_FORCE_CURRENT && in->force < SAFETY_NO_FORCE_LEVEL;
    if (lasts(&s->no_force, no_force, SAFETY_NO_FORCE_TICKS))
        return PT_FAULT_NO_FORCE;
    return PT_FAULT_NONE;
}

uint8_t safety_tick(struct safety *s, const struct safety_input *in)
{
    /* Each counter advances in every tick, whatever else is found: no early return before them. */
    heat_tick(&s->heat, in->current);
    bool over_force = lasts(&s->over_force, in->armed && in->force > s->force_trip, SAFETY_FORCE_DEBOUNCE);
    bool stray = lasts(&s->stray, in->reference == 0 && in->current > SAFETY_STRAY_CURRENT, SAFETY_STRAY_TICKS);
    uint8_t sensor = in->armed ? sensors(s, in) : PT_FAULT_NONE;
    if (in->awaited && s->silent_ticks < 0xFFFFu)
        s->silent_ticks++;
    if (in->driving)
        s->on_ticks++;

    if (in->armed && in->current > s->current_trip)
        return PT_FAULT_OVER_CURRENT;
    if (over_force)
        return PT_FAULT_OVER_FORCE;
    if (sensor != PT_FAULT_NONE)
        return sensor;
    if (stray)
        return PT_FAULT_STRAY_CURRENT;
    if (!in->armed)
        return PT_FAULT_NONE;
    if (in->awaited && s->silent_ticks > s->heartbeat_ticks)
        return PT_FAULT_HEARTBEAT;
    if (heat_is_too_much(&s->heat))
        return PT_FAULT_COIL_HEAT;
    if (s->on_ticks > s->on_ticks_limit)
        return PT_FAULT_ON_TIME;
    return PT_FAULT_NONE;
}
