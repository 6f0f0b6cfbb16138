#include "telemetry.h"

#include <stddef.h>

#include "units.h"

#define MASK (TELEMETRY_RING - 1u)
#define SLEWED 0x80000000u

void telemetry_init(struct telemetry *t)
{
    t->decimation = 10;
    t->with_duty = false;
    telemetry_begin(t, 0);
}

void telemetry_begin(struct telemetry *t, uint8_t session)
{
    t->head = 0;
    t->tail = 0;
    t->ended = false;
    t->countdown = 1; /* the first tick is a sample */
    t->slewed = false;
    t->session = session;
    t->produced = 0;
    t->dropped = 0;
}

uint16_t telemetry_waiting(const struct telemetry *t)
{
    return (uint16_t)(t->head - t->tail);
}

struct telemetry_sample *telemetry_tick(struct telemetry *t, bool slewed)
{
    t->slewed = t->slewed || slewed;
    if (--t->countdown != 0)
        return NULL;
    t->countdown = t->decimation;
    t->produced++;
    struct telemetry_sample *slot = NULL;
    uint16_t head = t->head; /* once: nobody else writes it */
    if ((uint16_t)(head - t->tail) >= TELEMETRY_RING) {
        t->dropped++;
    } else {
        slot = &t->ring[head & MASK];
        slot->tick = t->slewed ? SLEWED : 0u;
        t->head = (uint16_t)(head + 1u);
    }
    t->slewed = false;
    return slot;
}

void telemetry_end(struct telemetry *t)
{
    t->ended = true;
}

uint8_t telemetry_pack(struct telemetry *t, uint32_t now, uint32_t dropped, uint8_t *payload)
{
    uint16_t most = t->with_duty ? PT_TELEMETRY_DUTY_MAX_ITEMS : PT_TELEMETRY_MAX_ITEMS;
    bool ended = t->ended; /* before the count: when it is set, every sample is in the ring */
    uint16_t waiting = telemetry_waiting(t);
    uint32_t first = waiting ? t->ring[t->tail & MASK].tick & ~SLEWED : now;
    if (!ended && waiting < most && (waiting == 0 || now - first < TELEMETRY_MAX_AGE))
        return 0;

    uint8_t flags = 0;
    uint8_t count = 0;
    uint8_t *item = payload + PT_TELEMETRY_LEN;
    while (count < waiting && count < most) {
        const struct telemetry_sample *s = &t->ring[(uint16_t)(t->tail + count) & MASK];
        /* Samples lost on the device leave a gap; a block holds none. */
        if ((s->tick & ~SLEWED) != first + (uint32_t)count * t->decimation)
            break;
        if (s->tick & SLEWED)
            flags |= PT_FLAG_SLEW;
        put_i16(item, s->reference);
        put_i16(item + 2, s->current);
        put_i16(item + 4, s->force);
        item += PT_TELEMETRY_ITEM;
        if (t->with_duty) {
            put_u16(item, s->duty);
            item += PT_TELEMETRY_DUTY_ITEM - PT_TELEMETRY_ITEM;
        }
        count++;
    }
    t->tail = (uint16_t)(t->tail + count);
    if (ended && count == waiting) {
        flags |= PT_FLAG_LAST;
        t->ended = false;
    }
    payload[PT_TELEMETRY_SESSION] = t->session;
    payload[PT_TELEMETRY_FLAGS] = flags;
    put_u32(payload + PT_TELEMETRY_FIRST_TICK, first);
    put_u16(payload + PT_TELEMETRY_DROPPED, dropped > 0xFFFFu ? 0xFFFFu : (uint16_t)dropped);
    payload[PT_TELEMETRY_COUNT] = count;
    return (uint8_t)(item - payload);
}
