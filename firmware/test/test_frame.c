#include <string.h>

#include "check.h"
#include "frame.h"

/* A small generator of our own, so that a failure is the same everywhere. */
static uint32_t seed = 12345;
static uint8_t random_byte(void)
{
    seed = seed * 1664525u + 1013904223u;
    return (uint8_t)(seed >> 24);
}

static bool decode_all(const uint8_t *bytes, uint16_t count, struct frame_decoder *d, struct frame *f)
{
    bool found = false;
    for (uint16_t k = 0; k < count; k++)
        found = frame_decode(d, bytes[k], f) || found;
    return found;
}

static void crc_known_value(void)
{
    /* CRC-16/CCITT-FALSE of "123456789" is 0x29B1; ours is its complement. */
    CHECK_EQUAL(frame_crc16((const uint8_t *)"123456789", 9), 0xFFFF ^ 0x29B1);
}

static void round_trip_every_length(void)
{
    for (int style = 0; style < 3; style++) { /* zeros, no zeros, mixed */
        for (uint8_t length = 0; length <= PT_MAX_PAYLOAD; length++) {
            uint8_t payload[PT_MAX_PAYLOAD];
            uint8_t wire[FRAME_MAX_ENCODED];
            struct frame_decoder d;
            struct frame f = {0};
            for (uint8_t k = 0; k < length; k++)
                payload[k] = style == 0 ? 0 : style == 1 ? (uint8_t)(random_byte() | 1u) : (uint8_t)(random_byte() & 3u);
            uint16_t n = frame_encode(wire, 0x42, length, payload, length, true);
            CHECK(n <= FRAME_MAX_ENCODED);
            CHECK(wire[0] == 0 && wire[n - 1u] == 0 && memchr(wire + 1, 0, n - 2u) == NULL);
            frame_decoder_init(&d);
            CHECK(decode_all(wire, n, &d, &f));
            CHECK(f.type == 0x42 && f.seq == length && f.length == length);
            CHECK(memcmp(f.payload, payload, length) == 0);
        }
    }
}

static void survives_noise_before_a_frame(void)
{
    uint8_t wire[FRAME_MAX_ENCODED];
    struct frame_decoder d;
    struct frame f = {0};
    frame_decoder_init(&d);
    for (int k = 0; k < 100000; k++) {
        uint8_t byte = random_byte();
        CHECK(!frame_decode(&d, byte, &f));
    }
    uint16_t n = frame_encode(wire, 1, 2, NULL, 0, true);
    CHECK(decode_all(wire, n, &d, &f));
}

static void no_single_damage_passes(void)
{
    uint8_t payload[20];
    uint8_t wire[FRAME_MAX_ENCODED];
    for (uint8_t k = 0; k < 20; k++)
        payload[k] = random_byte();
    uint16_t n = frame_encode(wire, 7, 9, payload, 20, false);
    for (uint16_t at = 0; at + 1u < n; at++) {
        for (uint16_t flip = 1; flip < 256; flip++) {
            struct frame_decoder d;
            struct frame f = {0};
            frame_decoder_init(&d);
            wire[at] = (uint8_t)(wire[at] ^ flip);
            CHECK(!decode_all(wire, n, &d, &f));
            wire[at] = (uint8_t)(wire[at] ^ flip);
        }
    }
}

static void over_long_is_dropped_and_the_next_is_read(void)
{
    uint8_t wire[FRAME_MAX_ENCODED];
    struct frame_decoder d;
    struct frame f = {0};
    frame_decoder_init(&d);
    for (int k = 0; k < 1000; k++)
        CHECK(!frame_decode(&d, 0x55, &f));
    CHECK(!frame_decode(&d, 0, &f));
    uint16_t n = frame_encode(wire, 3, 4, NULL, 0, false);
    CHECK(decode_all(wire, n, &d, &f));
    CHECK_EQUAL(f.type, 3);
}

int main(void)
{
    RUN(crc_known_value);
    RUN(round_trip_every_length);
    RUN(survives_noise_before_a_frame);
    RUN(no_single_damage_passes);
    RUN(over_long_is_dropped_and_the_next_is_read);
    CHECK_DONE();
}
