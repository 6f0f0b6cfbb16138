#include "driver.h"

#include "breaks.h"

#define CUT_A R(1.8) /* as BOARD_CHOP_COUNTS of the real board */

static volatile bool enabled;
static volatile uint16_t on;
static volatile bool cut;

void driver_reset(void)
{
    enabled = false;
    on = 0;
    cut = false;
}

void driver_enable(void)
{
    enabled = true;
}

void driver_off(void)
{
    enabled = false;
    on = 0;
}

void driver_set(uint16_t on_counts)
{
    on = on_counts;
}

bool driver_cut(void)
{
    bool was = cut;
    cut = false;
    return was;
}

void driver_step(struct solenoid *plant, uint16_t period_counts)
{
    uint16_t counts = enabled ? on : 0;
    real seen = breaks_is(BREAKS_SHUNT_HALF) ? plant->current / R(2) : plant->current;
    if (breaks_is(BREAKS_COMPARATOR) || seen > CUT_A) {
        cut = true;
        counts = 0;
    }
    if (breaks_is(BREAKS_STUCK_ON))
        counts = period_counts;
    solenoid_step(plant, counts, period_counts);
}
