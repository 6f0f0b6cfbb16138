#include "wave.h"

#include "units.h"

#define MASK (PT_WAVE_BUFFER_SAMPLES - 1u)
typedef char wave_ring_is_power_of_two[(PT_WAVE_BUFFER_SAMPLES & MASK) == 0 ? 1 : -1];

uint32_t wave_crc32(uint32_t crc, const uint8_t *data, uint16_t count)
{
    /* Half a byte at a time: 64 bytes of table instead of 1024. */
    static const uint32_t table[16] = {
        0x00000000u, 0x1DB71064u, 0x3B6E20C8u, 0x26D930ACu, 0x76DC4190u, 0x6B6B51F4u, 0x4DB26158u, 0x5005713Cu,
        0xEDB88320u, 0xF00F9344u, 0xD6D6A3E8u, 0xCB61B38Cu, 0x9B64C2B0u, 0x86D3D2D4u, 0xA00AE278u, 0xBDBDF21Cu,
    };
    crc = ~crc;
    for (uint16_t k = 0; k < count; k++) {
        crc ^= data[k];
        crc = (crc >> 4) ^ table[crc & 15u];
        crc = (crc >> 4) ^ table[crc & 15u];
    }
    return ~crc;
}

void wave_reset(struct wave *w)
{
    w->head = 0;
    w->tail = 0;
    w->total = 0;
    w->received = 0;
    w->crc_announced = 0;
    w->crc = 0;
    w->ticks_per_sample = 1;
    w->begun = false;
    w->committed = false;
    w->corrupt = false;
    w->index = 0;
    w->phase = 0;
    w->from = 0;
    w->to = 0;
}

void wave_begin(struct wave *w, uint32_t total, uint16_t ticks_per_sample, uint32_t crc)
{
    wave_reset(w);
    w->total = total;
    w->ticks_per_sample = ticks_per_sample;
    w->crc_announced = crc;
    w->begun = true;
}

static uint16_t used(const struct wave *w)
{
    return (uint16_t)(w->head - w->tail);
}

uint16_t wave_free(const struct wave *w)
{
    return (uint16_t)(PT_WAVE_BUFFER_SAMPLES - used(w));
}

void wave_append(struct wave *w, const uint8_t *samples, uint8_t count)
{
    uint16_t head = w->head;
    for (uint8_t k = 0; k < count; k++)
        w->ring[(uint16_t)(head + k) & MASK] = get_i16(samples + 2u * k);
    w->crc = wave_crc32(w->crc, samples, (uint16_t)(2u * count));
}

void wave_publish(struct wave *w, uint8_t count)
{
    w->received += count;
    w->head = (uint16_t)(w->head + count);
    w->corrupt = w->received == w->total && w->crc != w->crc_announced;
}

bool wave_end(struct wave *w)
{
    if (w->total != PT_WAVE_OPEN)
        return false;
    w->total = w->received;
    return true;
}

uint32_t wave_ticks_left(const struct wave *w)
{
    if (w->received >= w->total)
        return UINT32_MAX;
    return (uint32_t)used(w) * w->ticks_per_sample + (uint32_t)(w->ticks_per_sample - w->phase);
}

static bool pop(struct wave *w, int16_t *sample)
{
    if (used(w) == 0)
        return false;
    *sample = w->ring[w->tail & MASK];
    w->tail = (uint16_t)(w->tail + 1u);
    return true;
}

void wave_forget(struct wave *w)
{
    w->begun = false;
    w->committed = false;
}

void wave_start(struct wave *w)
{
    w->index = 0;
    w->phase = 0;
    (void)pop(w, &w->from);
    w->to = w->from;
}

enum wave_result wave_tick(struct wave *w, int16_t *reference)
{
    enum wave_result result = WAVE_OK;
    if (w->phase == 0) {
        if (w->index + 1u >= w->total)
            result = WAVE_LAST;
        else if (!pop(w, &w->to))
            result = WAVE_UNDERRUN;
    }
    /* |to - from| <= 15000 and phase < 10000: the product fits. */
    int32_t step = ((int32_t)w->to - w->from) * (int32_t)w->phase / (int32_t)w->ticks_per_sample;
    *reference = (int16_t)(w->from + step);
    if (result == WAVE_OK) {
        w->phase++;
        if (w->phase == w->ticks_per_sample) {
            w->phase = 0;
            w->from = w->to;
            w->index++;
        }
    }
    return result;
}
