#include "check.h"
#include "units.h"
#include "wave.h"

static struct wave w;

static void feed(const int16_t *samples, uint8_t count)
{
    uint8_t bytes[2 * 64];
    for (uint8_t k = 0; k < count; k++)
        put_i16(bytes + 2u * k, samples[k]);
    wave_append(&w, bytes, count);
    wave_publish(&w, count);
}

static void crc_known_value(void)
{
    CHECK(wave_crc32(0, (const uint8_t *)"123456789", 9) == 0xCBF43926u);
    uint32_t in_pieces = wave_crc32(wave_crc32(0, (const uint8_t *)"1234", 4), (const uint8_t *)"56789", 5);
    CHECK(in_pieces == 0xCBF43926u);
}

static void straight_between_samples(void)
{
    const int16_t samples[3] = {100, 200, 50};
    const int16_t expected[21] = {100, 110, 120, 130, 140, 150, 160, 170, 180, 190, 200,
                                  185, 170, 155, 140, 125, 110, 95, 80, 65, 50};
    int16_t r = 0;
    wave_begin(&w, 3, 10, 0);
    feed(samples, 3);
    wave_start(&w);
    for (int k = 0; k < 20; k++) {
        CHECK(wave_tick(&w, &r) == WAVE_OK);
        CHECK_EQUAL(r, expected[k]);
    }
    CHECK(wave_tick(&w, &r) == WAVE_LAST);
    CHECK_EQUAL(r, 50);
}

static void a_single_sample_is_the_last(void)
{
    const int16_t sample = 7;
    int16_t r = 0;
    wave_begin(&w, 1, 10, 0);
    feed(&sample, 1);
    wave_start(&w);
    CHECK(wave_tick(&w, &r) == WAVE_LAST);
    CHECK_EQUAL(r, 7);
}

static void an_empty_ring_is_an_underrun_at_the_last_known_sample(void)
{
    const int16_t samples[2] = {10, 30};
    int16_t r = 0;
    wave_begin(&w, 5, 2, 0);
    feed(samples, 2);
    wave_start(&w);
    CHECK(wave_tick(&w, &r) == WAVE_OK);
    CHECK(wave_tick(&w, &r) == WAVE_OK);
    CHECK(wave_tick(&w, &r) == WAVE_UNDERRUN);
    CHECK_EQUAL(r, 30);
}

static void a_long_wave_goes_round_the_ring(void)
{
    uint32_t total = 10u * PT_WAVE_BUFFER_SAMPLES + 7u;
    uint32_t sent = 0;
    int16_t r = 0;
    wave_begin(&w, total, 1, 0);
    for (; sent < PT_WAVE_BUFFER_SAMPLES; sent++) {
        int16_t v = (int16_t)(sent % 15000u);
        feed(&v, 1);
    }
    CHECK_EQUAL(wave_free(&w), 0);
    wave_start(&w);
    for (uint32_t k = 0; k < total; k++) {
        enum wave_result result = wave_tick(&w, &r);
        CHECK(result == (k + 1u == total ? WAVE_LAST : WAVE_OK));
        CHECK_EQUAL(r, k % 15000u);
        for (; sent < total && wave_free(&w) > 0; sent++) {
            int16_t v = (int16_t)(sent % 15000u);
            feed(&v, 1);
        }
    }
}

static void ticks_left_never_promises_too_much(void)
{
    const int16_t samples[4] = {1, 2, 3, 4};
    int16_t r = 0;
    wave_begin(&w, 100, 10, 0);
    feed(samples, 4);
    wave_start(&w);
    for (int k = 0; k < 40; k++) {
        uint32_t left = wave_ticks_left(&w);
        enum wave_result result = wave_tick(&w, &r);
        CHECK((result == WAVE_UNDERRUN) == (k == 30));
        if (result == WAVE_UNDERRUN)
            break;
        CHECK(left >= (uint32_t)(30 - k) && left <= (uint32_t)(40 - k));
    }
}

static void a_wrong_checksum_shows_when_all_is_there(void)
{
    const int16_t samples[2] = {10, 30};
    wave_begin(&w, 4, 2, 1234);
    feed(samples, 2);
    CHECK(!w.corrupt);
    feed(samples, 2);
    CHECK(w.corrupt);
}

static void an_open_wave_has_no_last_sample_until_its_end_is_told(void)
{
    const int16_t samples[3] = {10, 30, 20};
    int16_t r = 0;
    wave_begin(&w, PT_WAVE_OPEN, 1, 0);
    feed(samples, 3);
    wave_start(&w);
    CHECK(wave_tick(&w, &r) == WAVE_OK);
    CHECK(wave_tick(&w, &r) == WAVE_OK);
    CHECK_EQUAL(r, 30);
    CHECK(wave_ticks_left(&w) != UINT32_MAX);
    CHECK(wave_end(&w));
    CHECK_EQUAL(wave_ticks_left(&w), UINT32_MAX);
    CHECK(wave_tick(&w, &r) == WAVE_LAST);
    CHECK_EQUAL(r, 20);
    CHECK(!wave_end(&w));
}

static void an_open_wave_runs_dry(void)
{
    const int16_t samples[2] = {10, 30};
    int16_t r = 0;
    wave_begin(&w, PT_WAVE_OPEN, 1, 0);
    feed(samples, 2);
    wave_start(&w);
    CHECK(wave_tick(&w, &r) == WAVE_OK);
    CHECK(wave_tick(&w, &r) == WAVE_UNDERRUN);
    CHECK_EQUAL(r, 30);
    CHECK(!w.corrupt);
}

int main(void)
{
    RUN(crc_known_value);
    RUN(straight_between_samples);
    RUN(a_single_sample_is_the_last);
    RUN(an_empty_ring_is_an_underrun_at_the_last_known_sample);
    RUN(a_long_wave_goes_round_the_ring);
    RUN(ticks_left_never_promises_too_much);
    RUN(a_wrong_checksum_shows_when_all_is_there);
    RUN(an_open_wave_has_no_last_sample_until_its_end_is_told);
    RUN(an_open_wave_runs_dry);
    CHECK_DONE();
}
