/* Samples on their way to the host: a ring filled by the tick, emptied into blocks by the main loop. */
#ifndef PULSETRAINER_TELEMETRY_H
#define PULSETRAINER_TELEMETRY_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol.h"

#define TELEMETRY_RING 128u
#define TELEMETRY_MAX_AGE 500u /* ticks: a slow stream still shows signs of life */

struct telemetry_sample {
    uint32_t tick; /* bit 31: the slew limit was at work */
    int16_t reference;
    int16_t current;
    int16_t force;
    uint16_t duty; /* counts: of the tick that ends with this sample */
};

struct telemetry {
    struct telemetry_sample ring[TELEMETRY_RING]; /* tick: the main loop reads what lies between tail and head */
    volatile uint16_t head; /* tick */
    volatile uint16_t tail; /* main */
    volatile bool ended;    /* shared: the session's last sample is in the ring, its LAST block not yet sent */
    uint16_t decimation;    /* main, not in RUNNING */
    uint16_t countdown;     /* tick only */
    bool slewed;            /* tick only */
    bool with_duty;         /* main: the host knows blocks that carry it */
    uint8_t session;        /* main, at START */
    uint32_t produced;      /* tick: samples due since the session began, lost ones included */
    uint32_t dropped;       /* tick */
};

void telemetry_init(struct telemetry *t);
void telemetry_begin(struct telemetry *t, uint8_t session);

/* Each tick. NULL, or what the tick has to fill in, but for the slew's bit of `tick`, which is set: it is in the ring
 * already, but the main loop reads nothing before the tick is over. */
struct telemetry_sample *telemetry_tick(struct telemetry *t, bool slewed);

void telemetry_end(struct telemetry *t);
uint16_t telemetry_waiting(const struct telemetry *t);

/* Packs the next block into `payload` (PT_MAX_PAYLOAD bytes) when one is due at tick `now`; returns its
 * length or 0. Needs no critical section: the tick writes head and `ended`, this writes tail. */
uint8_t telemetry_pack(struct telemetry *t, uint32_t now, uint32_t dropped, uint8_t *payload);

#endif
