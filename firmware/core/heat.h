/* How hot the coil is: the squared current, averaged over 2^20 ticks (105 s), as first-order copper does.
 *
 * Kept over every reset but power-on, after which it is assumed to be at the limit until a host tells. */
#ifndef PULSETRAINER_HEAT_H
#define PULSETRAINER_HEAT_H

#include <stdbool.h>
#include <stdint.h>

#include "hal.h"

/* (1.25 A)^2 in (100 uA)^2: what the coil bears for ever. The full 1.5 A from cold reaches it after two
 * minutes: 104.86 s * ln(2.25 / (2.25 - 1.5625)) = 124 s. */
#define HEAT_LIMIT 156250000L
#define HEAT_PER_MILLE (HEAT_LIMIT / 1000)
#define HEAT_MOST_PER_MILLE 2000u /* more than the current trip for ever: (1.65 / 1.25)^2 = 1742 per mille */

struct heat {
    int32_t average;       /* shared: the tick, and a host that tells */
    int32_t sum;           /* tick only: of the present 1024 ticks */
    uint16_t ticks;        /* tick only: how many of them there were */
    struct hal_kept *kept; /* main only */
};

void heat_init(struct heat *h, struct hal_kept *kept, bool power_on);
void heat_tick(struct heat *h, int16_t current);
static inline bool heat_is_too_much(const struct heat *h)
{
    return h->average > HEAT_LIMIT;
}
void heat_keep(struct heat *h); /* main loop, in a critical section: over the next reset */
bool heat_is_assumed(const struct heat *h);
uint16_t heat_per_mille(const struct heat *h); /* of the limit, rounded up */

/* What a host knows; false: less than the model has, which is taken only while that is assumed. */
bool heat_tell(struct heat *h, uint16_t per_mille);

#endif
