/* The reference: uploaded in pieces into a ring, interpolated linearly to the tick. */
#ifndef PULSETRAINER_WAVE_H
#define PULSETRAINER_WAVE_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol.h"

enum wave_result { WAVE_OK, WAVE_LAST, WAVE_UNDERRUN };

/* Samples in 100 uA. "Main": written by the main loop, while a run reads it in critical sections only. */
struct wave {
    int16_t ring[PT_WAVE_BUFFER_SAMPLES]; /* main: the tick reads what lies between tail and head */
    volatile uint16_t head; /* main; runs freely */
    volatile uint16_t tail; /* tick, and main before the run; runs freely */
    uint32_t total;         /* main */
    uint32_t received;      /* main */
    uint32_t crc_announced; /* main */
    uint32_t crc;           /* main only */
    uint16_t ticks_per_sample; /* main */
    volatile bool begun;    /* shared: the end of a run takes both away */
    volatile bool committed;
    volatile bool corrupt;  /* main: all samples are there and their CRC is not the announced one */
    /* Tick only: the segment from `from` to `to`, sample `index` being `from`. */
    uint32_t index;
    uint16_t phase;
    int16_t from;
    int16_t to;
};

uint32_t wave_crc32(uint32_t crc, const uint8_t *data, uint16_t count); /* zlib's; start with 0 */

void wave_reset(struct wave *w);
void wave_begin(struct wave *w, uint32_t total, uint16_t ticks_per_sample, uint32_t crc);
uint16_t wave_free(const struct wave *w);

/* Put little-endian samples behind the others; the caller has checked the room, the order and the range.
 * The tick sees them only after wave_publish, which belongs into a critical section. */
void wave_append(struct wave *w, const uint8_t *samples, uint8_t count);
void wave_publish(struct wave *w, uint8_t count);

/* A wave begun with a total of PT_WAVE_OPEN has no end until wave_end. False: it is no open one. */
bool wave_end(struct wave *w);

/* Ticks until the ring runs dry; UINT32_MAX when all samples are there. */
uint32_t wave_ticks_left(const struct wave *w);

void wave_forget(struct wave *w); /* nothing is committed any more */
void wave_start(struct wave *w);

/* The reference of this tick. WAVE_LAST: it is the last sample. WAVE_UNDERRUN: it is good, but what
 * follows has not arrived. */
enum wave_result wave_tick(struct wave *w, int16_t *reference);

#endif
