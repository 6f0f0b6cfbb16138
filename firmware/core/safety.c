#include "safety.h"

/* Steps of 1024 * 100 uA from 0 A. The as-built device (seed 0), measured by slow strokes with tests/firmware/plant_harness.py:
 * 0.7 of the force at the first rise to the current, 1.35 of that at the fall from 1.5 A. */
#define STEP_SHIFT 10u
static const int16_t floor_mN[] = {0,    63,   233,  496,  862,  1429, 2351, 3711, 5283, 6640, 7592,
                                   8226, 8677, 9032, 9334, 9603, 9849, 9966, 9966, 9966, 9966};
static const int16_t ceiling_mN[] = {759,   1823,  3565,  6130,  9107,  11669, 13428, 14575, 15397, 16066, 16655,
                                     17194, 17689, 18063, 18306, 18344, 18344, 18344, 18344, 18344, 18344};

/* Linear between the steps; a current of 12 bits over 2 A is at most 20000 and ends between the last two. */
static int16_t at_current(const int16_t *table, int16_t current_100uA)
{
    uint16_t step = (uint16_t)((uint16_t)current_100uA >> STEP_SHIFT);
    int32_t part = current_100uA & ((1 << STEP_SHIFT) - 1);
    return (int16_t)(table[step] + (((int32_t)table[step + 1u] - table[step]) * part >> STEP_SHIFT));
}

void safety_init(struct safety *s, struct hal_kept *kept, bool power_on, int16_t force_mN)
{
    static const struct safety_limits none = {0, 0, 0, 0, 0, 0};
    heat_init(&s->heat, kept, power_on);
    s->not_off = 0;
    s->release_ticks = 0;
    s->slow_current = 0;
    s->slow_force = (int32_t)force_mN * (1 << SAFETY_ZERO_SHIFT);
    safety_begin(s, &none);
}

static void still_reset(struct safety_still *m)
{
    m->counts = 0xFFFFu; /* no 12-bit reading: the first one counts as a change */
    m->ticks = 0;
}

void safety_begin(struct safety *s, const struct safety_limits *limits)
{
    s->limits = *limits;
    s->silent_ticks = 0;
    s->on_ticks = 0;
    s->over_force = 0;
    s->force_rail = 0;
    s->comparator = 0;
    s->no_current = 0;
    s->weak_current = 0;
    s->too_little_force = 0;
    s->too_much_force = 0;
    s->stray = 0;
    still_reset(&s->current_still);
    still_reset(&s->force_still);
    s->voltage_high_ohms = limits->coil_ohms * SAFETY_VOLTAGE_HIGH_20THS / 20;
    s->voltage_low_ohms = limits->coil_ohms * SAFETY_VOLTAGE_LOW_20THS / 20;
    int32_t stroke = limits->coil_henries * 15 / 524 + SAFETY_VOLTAGE_DIODE_COUNTS; /* 15000 / 256 / 2048 */
    s->voltage_span = (int16_t)(stroke > SAFETY_VOLTAGE_SPAN_COUNTS ? stroke : SAFETY_VOLTAGE_SPAN_COUNTS);
    s->voltage_samples = 0;
    s->voltage_duty = 0;
    s->voltage_current = 0;
    s->turn = 0;
    s->floor_margin_mN = (int16_t)(limits->force_trip_mN / SAFETY_FLOOR_MARGIN_PER_TRIP);
    s->frozen_force_100uA = (int16_t)(SAFETY_FROZEN_FORCE_BASE_100UA + limits->force_trip_mN / 5 * SAFETY_FROZEN_FORCE_PER_5_MN);
}

void safety_alive(struct safety *s)
{
    s->silent_ticks = 0;
}

uint8_t safety_gravity(uint8_t fault)
{
    switch (fault) {
    case PT_FAULT_NONE:
        return 0;
    case PT_FAULT_HEARTBEAT:
    case PT_FAULT_UNDERRUN:
    case PT_FAULT_COIL_HEAT:
    case PT_FAULT_ON_TIME:
    case PT_FAULT_WAVE_CRC:
        return SAFETY_RAMPS;
    case PT_FAULT_OUTPUT_NOT_OFF:
        return 3;
    default:
        return 2;
    }
}

uint8_t safety_before_arm(const struct safety *s)
{
    int32_t force_mN = s->slow_force >> SAFETY_ZERO_SHIFT;
    if (force_mN < SAFETY_ZERO_LOW_MN || force_mN > SAFETY_ZERO_HIGH_MN)
        return PT_FAULT_FORCE_ZERO;
    return s->not_off >= SAFETY_ARM_TICKS ? PT_FAULT_STRAY_CURRENT : PT_FAULT_NONE;
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

/* Counts up on a condition and back without it; true once full. */
static bool leaks(uint16_t *counter, bool condition, uint16_t up, uint16_t down, uint16_t full)
{
    if (condition)
        *counter = (uint16_t)(*counter + up);
    else
        *counter = *counter > down ? (uint16_t)(*counter - down) : (uint16_t)0;
    if (*counter < full)
        return false;
    *counter = full;
    return true;
}

/* Counts for how many ticks the reading has stood still. */
static void still(struct safety_still *m, uint16_t counts)
{
    if (counts != m->counts) {
        m->counts = counts;
        m->ticks = 0;
    } else if (m->ticks < SAFETY_FROZEN_TICKS) {
        m->ticks++;
    }
}

/* How far `mover` has gone since the reading last changed. */
static int32_t span(struct safety_span *m, bool is_still, int16_t mover)
{
    if (!is_still) {
        m->low = mover;
        m->high = mover;
        return 0;
    }
    if (mover < m->low)
        m->low = mover;
    if (mover > m->high)
        m->high = mover;
    return (int32_t)m->high - m->low;
}

static uint8_t frozen(struct safety *s, const struct safety_input *in)
{
    bool same = s->current_still.ticks >= SAFETY_TURNS;
    int32_t reference = span(&s->reference_span, same, in->reference_100uA);
    int32_t duty = span(&s->duty_span, same, (int16_t)in->duty_counts);
    if (s->current_still.ticks >= SAFETY_FROZEN_TICKS &&
        (reference >= SAFETY_FROZEN_REFERENCE_100UA || duty >= SAFETY_FROZEN_DUTY_COUNTS))
        return PT_FAULT_CURRENT_FROZEN;
    same = s->force_still.ticks >= SAFETY_TURNS;
    int32_t current = span(&s->current_span, same, in->current_100uA);
    return s->force_still.ticks >= SAFETY_FROZEN_TICKS && current >= s->frozen_force_100uA ? PT_FAULT_FORCE_FROZEN
                                                                                          : PT_FAULT_NONE;
}

static uint8_t no_current(struct safety *s, const struct safety_input *in)
{
    bool dead = in->duty_counts > in->full_counts / 4u && in->current_100uA < SAFETY_NO_CURRENT_100UA;
    bool weak = in->duty_counts >= in->full_counts && in->current_100uA < in->reference_100uA / 2;
    s->release_ticks = SAFETY_RELEASE_TICKS; /* what is looked at once the output is off begins anew */
    s->not_off = 0;
    bool stray = in->reference_100uA == 0 && in->current_100uA > SAFETY_STRAY_100UA;
    stray = lasts(&s->stray, stray, SAFETY_STRAY_TICKS / SAFETY_TURNS);
    weak = lasts(&s->weak_current, weak, SAFETY_WEAK_TICKS / SAFETY_TURNS);
    if (lasts(&s->no_current, dead, SAFETY_NO_CURRENT_TICKS / SAFETY_TURNS) || weak)
        return PT_FAULT_NO_CURRENT;
    return stray ? PT_FAULT_STRAY_CURRENT : PT_FAULT_NONE;
}

/* The mean voltage on the coil against that which the mean current needs. */
static uint8_t voltage(struct safety *s, const struct safety_input *in)
{
    s->voltage_duty += in->duty_counts;
    s->voltage_current += in->current_100uA;
    if (++s->voltage_samples < 1u << SAFETY_VOLTAGE_SHIFT)
        return PT_FAULT_NONE;
    int32_t duty = s->voltage_duty >> SAFETY_VOLTAGE_SHIFT;
    int32_t current = s->voltage_current >> SAFETY_VOLTAGE_SHIFT;
    s->voltage_samples = 0;
    s->voltage_duty = 0;
    s->voltage_current = 0;
    int32_t most = SAFETY_VOLTAGE_OFFSET_COUNTS + s->voltage_span + (current * s->voltage_high_ohms >> 16);
    int32_t least = (current * s->voltage_low_ohms >> 16) - s->voltage_span;
    return duty > most || duty < least ? PT_FAULT_CURRENT_IMPLAUSIBLE : PT_FAULT_NONE;
}

/* The force against the current of now and of a moment ago, whichever is kinder. */
static uint8_t too_little_force(struct safety *s, const struct safety_input *in)
{
    int16_t slow = (int16_t)(s->slow_current >> SAFETY_PLAUSIBLE_SHIFT);
    int32_t least = at_current(floor_mN, slow < in->current_100uA ? slow : in->current_100uA) - s->floor_margin_mN;
    if (least > SAFETY_FLOOR_LEAST_MN && leaks(&s->too_little_force, in->force_mN < least, SAFETY_PLAUSIBLE_UP, SAFETY_PLAUSIBLE_DOWN,
                           SAFETY_PLAUSIBLE_FULL))
        return in->force_mN < SAFETY_NO_FORCE_MN ? PT_FAULT_NO_FORCE : PT_FAULT_FORCE_IMPLAUSIBLE;
    return PT_FAULT_NONE;
}

static uint8_t too_much_force(struct safety *s, const struct safety_input *in)
{
    int16_t slow = (int16_t)(s->slow_current >> SAFETY_PLAUSIBLE_SHIFT);
    int32_t most = at_current(ceiling_mN, slow > in->current_100uA ? slow : in->current_100uA) + SAFETY_CEILING_MARGIN_MN;
    return leaks(&s->too_much_force, in->force_mN > most, SAFETY_PLAUSIBLE_UP, SAFETY_PLAUSIBLE_DOWN,
                 SAFETY_PLAUSIBLE_FULL)
               ? PT_FAULT_FORCE_IMPLAUSIBLE
               : PT_FAULT_NONE;
}

/* While the output is on. What takes milliseconds to tell takes turns. */
static uint8_t driven(struct safety *s, const struct safety_input *in)
{
    still(&s->current_still, in->current_counts);
    still(&s->force_still, in->force_counts);
    if (lasts(&s->comparator, in->comparator, SAFETY_COMPARATOR_TICKS))
        return PT_FAULT_COMPARATOR;
    s->turn = (uint8_t)((s->turn + 1u) % SAFETY_TURNS);
    switch (s->turn) {
    case 0:
        return frozen(s, in);
    case 1:
        return no_current(s, in);
    case 2: {
        uint8_t force = too_much_force(s, in);
        uint8_t current = voltage(s, in);
        return current != PT_FAULT_NONE ? current : force;
    }
    default:
        return too_little_force(s, in);
    }
}

static uint8_t armed(struct safety *s, const struct safety_input *in)
{
    const struct safety_limits *limits = &s->limits;
    bool over_force = leaks(&s->over_force, in->force_mN > limits->force_trip_mN, SAFETY_FORCE_UP, SAFETY_FORCE_DOWN,
                            SAFETY_FORCE_FULL);
    bool at_rail = in->force_counts <= SAFETY_RAIL_LOW || in->force_counts >= SAFETY_RAIL_HIGH;
    bool force_rail = lasts(&s->force_rail, at_rail, SAFETY_RAIL_DEBOUNCE);
    uint8_t sensor = in->driving ? driven(s, in) : PT_FAULT_NONE;
    if (in->driving)
        s->on_ticks++;
    bool silent = in->awaited && s->silent_ticks >= limits->heartbeat_ticks;
    if (!silent)
        s->silent_ticks++;

    if (in->current_100uA > limits->current_trip_100uA)
        return PT_FAULT_OVER_CURRENT;
    if (over_force)
        return PT_FAULT_OVER_FORCE;
    if (force_rail)
        return PT_FAULT_FORCE_RAIL;
    if (sensor != PT_FAULT_NONE)
        return sensor;
    if (silent)
        return PT_FAULT_HEARTBEAT;
    if (heat_is_too_much(&s->heat))
        return PT_FAULT_COIL_HEAT;
    return s->on_ticks > limits->on_ticks ? PT_FAULT_ON_TIME : PT_FAULT_NONE;
}

/* The force of the last run does not fall. */
static bool still_presses(struct safety *s, const struct safety_input *in)
{
    if (s->release_ticks == 0)
        return false;
    if (in->force_mN <= SAFETY_ZERO_HIGH_MN)
        s->release_ticks = 0;
    else if (s->release_ticks > 1u)
        s->release_ticks--;
    return s->release_ticks == 1u;
}

/* While the output is off. */
static bool is_not_off(struct safety *s, const struct safety_input *in)
{
    s->slow_force += ((int32_t)in->force_mN * (1 << SAFETY_ZERO_SHIFT) - s->slow_force) >> SAFETY_ZERO_SHIFT;
    bool flows = lasts(&s->not_off, in->current_100uA > SAFETY_STRAY_100UA, SAFETY_OFF_TICKS);
    return still_presses(s, in) || flows;
}

uint8_t safety_tick(struct safety *s, const struct safety_input *in)
{
    heat_tick(&s->heat, in->current_100uA);
    s->slow_current += (((int32_t)in->current_100uA << SAFETY_PLAUSIBLE_SHIFT) - s->slow_current) >> SAFETY_PLAUSIBLE_SHIFT;
    if (!in->driving && is_not_off(s, in))
        return PT_FAULT_OUTPUT_NOT_OFF;
    return in->armed ? armed(s, in) : PT_FAULT_NONE;
}
