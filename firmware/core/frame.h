/* COBS(type, seq, payload, complemented CRC-16/CCITT-FALSE big-endian) between zero bytes. */
#ifndef PULSETRAINER_FRAME_H
#define PULSETRAINER_FRAME_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol.h"

#define FRAME_BODY (PT_MAX_PAYLOAD + 4u)     /* type, seq, payload, CRC */
#define FRAME_MAX_ENCODED (FRAME_BODY + 3u)  /* leading zero, COBS overhead, closing zero */

struct frame_decoder {
    uint8_t body[FRAME_BODY];
    uint8_t used;      /* bytes in body */
    uint8_t left;      /* bytes until the next COBS code byte */
    bool started;      /* a first code byte was read */
    bool zero_pending; /* the block before was not a full one: a zero belongs between */
    bool broken;       /* too long: wait for the next zero */
};

struct frame {
    uint8_t type;
    uint8_t seq;
    uint8_t length;
    const uint8_t *payload;
};

uint16_t frame_crc16(const uint8_t *data, uint16_t count);

void frame_decoder_init(struct frame_decoder *d);

/* True when `byte` completes a good frame; `out` then points into the decoder until the next call. */
bool frame_decode(struct frame_decoder *d, uint8_t byte, struct frame *out);

/* Returns the bytes written to `out` (at least FRAME_MAX_ENCODED). `wake` puts a zero in front, which
 * ends whatever noise an idle line has produced. */
uint16_t frame_encode(uint8_t *out, uint8_t type, uint8_t seq, const uint8_t *payload, uint8_t length,
                      bool wake);

#endif
