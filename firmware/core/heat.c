#include "heat.h"

static void keep(struct heat *h, bool assumed)
{
    h->kept->heat = (uint32_t)h->average;
    h->kept->assumed = assumed ? 1u : 0u;
    h->kept->check = ~(h->kept->heat ^ (h->kept->assumed << 31));
}

static bool is_kept(const struct hal_kept *k)
{
    return k->heat <= HEAT_MOST_PER_MILLE * (uint32_t)HEAT_PER_MILLE && k->assumed <= 1u &&
           k->check == ~(k->heat ^ (k->assumed << 31));
}

void heat_init(struct heat *h, struct hal_kept *kept, bool power_on)
{
    h->kept = kept;
    h->sum = 0;
    h->ticks = 0;
    if (!power_on && is_kept(kept)) {
        h->average = (int32_t)kept->heat;
        return;
    }
    h->average = HEAT_LIMIT;
    keep(h, true);
}

void heat_tick(struct heat *h, int16_t current)
{
    h->sum += (int32_t)((uint32_t)((int32_t)current * current) >> 10);
    if (++h->ticks < 1024u)
        return;
    h->average += (h->sum - h->average) >> 10;
    h->ticks = 0;
    h->sum = 0;
}

void heat_keep(struct heat *h)
{
    if (h->kept->heat != (uint32_t)h->average)
        keep(h, heat_is_assumed(h));
}

bool heat_is_assumed(const struct heat *h)
{
    return h->kept->assumed != 0;
}

uint16_t heat_per_mille(const struct heat *h)
{
    return (uint16_t)((h->average + HEAT_PER_MILLE - 1) / HEAT_PER_MILLE);
}

bool heat_tell(struct heat *h, uint16_t per_mille)
{
    int32_t told = (int32_t)per_mille * HEAT_PER_MILLE;
    if (told < h->average && !heat_is_assumed(h))
        return false;
    h->average = told;
    keep(h, false);
    return true;
}
