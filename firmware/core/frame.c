#include "frame.h"

static uint16_t crc16_step(uint16_t crc, uint8_t byte)
{
    /* Polynomial 0x1021 without a table: the byte-wise form of its three taps. */
    uint16_t x = (uint16_t)((crc >> 8) ^ byte);
    x = (uint16_t)(x ^ (x >> 4));
    return (uint16_t)((uint32_t)(uint16_t)(crc << 8) ^ (uint32_t)(uint16_t)(x << 12) ^
                      (uint32_t)(uint16_t)(x << 5) ^ x);
}

uint16_t frame_crc16(const uint8_t *data, uint16_t count)
{
    uint16_t crc = 0xFFFFu;
    for (uint16_t k = 0; k < count; k++)
        crc = crc16_step(crc, data[k]);
    return (uint16_t)~crc;
}

void frame_decoder_init(struct frame_decoder *d)
{
    d->used = 0;
    d->left = 0;
    d->started = false;
    d->zero_pending = false;
    d->broken = false;
}

static void append(struct frame_decoder *d, uint8_t byte)
{
    if (d->used < FRAME_BODY)
        d->body[d->used++] = byte;
    else
        d->broken = true;
}

static bool finish(const struct frame_decoder *d, struct frame *out)
{
    if (!d->started || d->broken || d->left != 0 || d->used < 4u)
        return false;
    uint8_t body = (uint8_t)(d->used - 2u);
    uint16_t sent = (uint16_t)(((uint16_t)d->body[body] << 8) | d->body[body + 1u]);
    if (sent != frame_crc16(d->body, body))
        return false;
    out->type = d->body[0];
    out->seq = d->body[1];
    out->length = (uint8_t)(body - 2u);
    out->payload = d->body + 2;
    return true;
}

bool frame_decode(struct frame_decoder *d, uint8_t byte, struct frame *out)
{
    if (byte == 0) {
        bool good = finish(d, out);
        frame_decoder_init(d);
        return good;
    }
    if (d->broken)
        return false;
    if (d->left == 0) {
        if (d->zero_pending)
            append(d, 0);
        d->left = (uint8_t)(byte - 1u);
        d->zero_pending = byte != 0xFFu;
        d->started = true;
    } else {
        append(d, byte);
        d->left--;
    }
    return false;
}

uint16_t frame_encode(uint8_t *out, uint8_t type, uint8_t seq, const uint8_t *payload, uint8_t length,
                      bool wake)
{
    uint8_t body[FRAME_BODY];
    body[0] = type;
    body[1] = seq;
    for (uint8_t k = 0; k < length; k++)
        body[2u + k] = payload[k];
    uint16_t crc = frame_crc16(body, (uint16_t)(length + 2u));
    body[length + 2u] = (uint8_t)(crc >> 8);
    body[length + 3u] = (uint8_t)(crc & 0xFFu);

    uint16_t at = 0;
    if (wake)
        out[at++] = 0;
    uint16_t code_at = at++;
    uint8_t code = 1; /* a body is shorter than 254, so no block is ever a full one */
    for (uint16_t k = 0; k < (uint16_t)(length + 4u); k++) {
        if (body[k] == 0) {
            out[code_at] = code;
            code_at = at++;
            code = 1;
        } else {
            out[at++] = body[k];
            code++;
        }
    }
    out[code_at] = code;
    out[at++] = 0;
    return at;
}
