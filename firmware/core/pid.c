#include "pid.h"

void pid_reset(struct pid *p)
{
    p->integral = 0;
    p->last_reference = 0;
}

static int32_t clamp(int32_t v, int32_t low, int32_t high)
{
    return v < low ? low : v > high ? high : v;
}

uint16_t pid_step(struct pid *p, int16_t reference, int16_t measured, uint16_t full)
{
    /* Bounds that keep each product below 2^31: gains are range-checked, |error| <= 20000,
     * 0 <= reference <= 15000, |change| <= the slew limit. */
    int32_t error = (int32_t)reference - measured;
    int32_t change = (int32_t)reference - p->last_reference;
    p->last_reference = reference;

    int32_t out = ((p->gains.kp * error) >> 12) + (p->integral >> 16) + ((p->gains.feed_resistance * reference) >> 16) +
                  ((p->gains.feed_inductance * change) >> 8) + (reference > 0 ? p->gains.feed_offset : 0);
    int32_t high = (int32_t)full;
    if (!((out >= high && error > 0) || (out <= 0 && error < 0)))
        p->integral = clamp(p->integral + p->gains.ki * error, -(high << 16), high << 16);
    return (uint16_t)clamp(out, 0, high);
}
