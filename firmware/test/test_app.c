/* The whole core behind a fake HAL, spoken to in frames: states, refusals and the way to output off. */
#include <string.h>

#include "app.h"
#include "commands.h"
#include "control.h"
#include "check.h"
#include "fake_hal.h"
#include "hal.h"
#include "units.h"

#define SAMPLES 61u

static uint8_t state_of(struct frame f)
{
    CHECK_EQUAL(f.type, PT_ACK);
    return f.type == PT_ACK ? f.payload[PT_ACK_STATE] : 0xFFu;
}

static uint8_t nak_of(struct frame f)
{
    return f.type == PT_NAK ? f.payload[PT_NAK_CODE] : 0;
}

static struct frame hello_of(uint8_t major, uint8_t minor)
{
    uint8_t p[PT_HELLO_LEN];
    put_u32(p + PT_HELLO_MAGIC, PT_MAGIC);
    p[PT_HELLO_MAJOR] = major;
    p[PT_HELLO_MINOR] = minor;
    return fake_command(PT_HELLO, p, sizeof p);
}

static struct frame hello(uint8_t major)
{
    return hello_of(major, 0);
}

static uint32_t crc_of_constant(int16_t value, uint32_t count)
{
    uint8_t bytes[2];
    uint32_t crc = 0;
    put_i16(bytes, value);
    for (uint32_t k = 0; k < count; k++)
        crc = wave_crc32(crc, bytes, 2);
    return crc;
}

static struct frame begin(uint32_t total, uint16_t ticks, uint32_t crc)
{
    uint8_t p[PT_WAVE_BEGIN_LEN];
    put_u32(p + PT_WAVE_BEGIN_TOTAL, total);
    put_u16(p + PT_WAVE_BEGIN_TICKS_PER_SAMPLE, ticks);
    put_u32(p + PT_WAVE_BEGIN_CRC32, crc);
    return fake_command(PT_WAVE_BEGIN, p, sizeof p);
}

static struct frame data(uint32_t offset, int16_t value, uint8_t count)
{
    uint8_t p[PT_WAVE_DATA_LEN + 2u * PT_WAVE_DATA_MAX_ITEMS];
    put_u32(p + PT_WAVE_DATA_OFFSET, offset);
    p[PT_WAVE_DATA_COUNT] = count;
    for (uint8_t k = 0; k < count; k++)
        put_i16(p + PT_WAVE_DATA_LEN + 2u * k, value);
    return fake_command(PT_WAVE_DATA, p, (uint8_t)(PT_WAVE_DATA_LEN + 2u * count));
}

static struct frame commit(uint32_t count, uint32_t crc)
{
    uint8_t p[PT_WAVE_COMMIT_LEN];
    put_u32(p + PT_WAVE_COMMIT_COUNT, count);
    put_u32(p + PT_WAVE_COMMIT_CRC32, crc);
    return fake_command(PT_WAVE_COMMIT, p, sizeof p);
}

static struct frame check_sent(uint32_t count, uint32_t crc, uint8_t end)
{
    uint8_t p[PT_WAVE_CHECK_LEN];
    put_u32(p + PT_WAVE_CHECK_COUNT, count);
    put_u32(p + PT_WAVE_CHECK_CRC32, crc);
    p[PT_WAVE_CHECK_END] = end;
    return fake_command(PT_WAVE_CHECK, p, sizeof p);
}

static struct frame arm(uint32_t nonce)
{
    uint8_t p[PT_ARM_LEN];
    put_u32(p, nonce);
    return fake_command(PT_ARM, p, sizeof p);
}

static struct frame set_param(uint8_t id, int32_t value)
{
    uint8_t p[PT_SET_PARAM_LEN];
    p[PT_SET_PARAM_ID] = id;
    put_i32(p + PT_SET_PARAM_VALUE, value);
    return fake_command(PT_SET_PARAM, p, sizeof p);
}

static struct frame plain(uint8_t type)
{
    return fake_command(type, NULL, 0);
}

static struct frame plain_stream(uint16_t decimation)
{
    uint8_t p[PT_STREAM_LEN];
    put_u16(p, decimation);
    return fake_command(PT_STREAM, p, sizeof p);
}

/* A constant current of `value`, SAMPLES samples of `ticks` ticks; `total` of them announced. */
static void ready(int16_t value, uint16_t ticks, uint32_t total)
{
    fake_reset();
    CHECK_EQUAL(hello(PT_PROTOCOL_MAJOR).type, PT_HELLO_REPLY);
    CHECK_EQUAL(state_of(begin(total, ticks, total == PT_WAVE_OPEN ? 0 : crc_of_constant(value, total))), PT_STATE_IDLE);
    CHECK_EQUAL(state_of(data(0, value, SAMPLES)), PT_STATE_IDLE);
    CHECK_EQUAL(state_of(commit(SAMPLES, crc_of_constant(value, SAMPLES))), PT_STATE_IDLE);
}

static void running(int16_t value, uint16_t ticks)
{
    ready(value, ticks, SAMPLES);
    CHECK_EQUAL(state_of(arm(fake.nonce)), PT_STATE_ARMED);
    CHECK_EQUAL(state_of(plain(PT_START)), PT_STATE_RUNNING);
}

static void alive_ticks(uint32_t n)
{
    while (n > 0) {
        uint32_t piece = n < 500 ? n : 500;
        fake_ticks(piece);
        (void)fake_beat();
        n -= piece;
    }
}

/* Ticks until the output is off, at most `most`. */
static uint32_t off_after(uint32_t most)
{
    for (uint32_t k = 1; k <= most; k++) {
        fake_ticks(1);
        if (!fake.pwm_enabled)
            return k;
    }
    return most + 1u;
}

static void the_output_is_off_until_everything_says_on(void)
{
    fake_reset();
    fake_ticks(10);
    CHECK(!fake.pwm_enabled);
    CHECK_EQUAL(nak_of(plain(PT_START)), PT_NAK_CODE_STATE);
    CHECK_EQUAL(nak_of(arm(fake.nonce)), PT_NAK_CODE_VERSION);
    (void)hello(PT_PROTOCOL_MAJOR);
    CHECK_EQUAL(nak_of(arm(fake.nonce)), PT_NAK_CODE_STATE); /* no waveform */
    (void)begin(SAMPLES, 10, crc_of_constant(100, SAMPLES));
    (void)data(0, 100, SAMPLES);
    CHECK_EQUAL(nak_of(arm(fake.nonce)), PT_NAK_CODE_STATE); /* not committed */
    CHECK_EQUAL(nak_of(commit(SAMPLES, 1)), PT_NAK_CODE_CRC);
    CHECK_EQUAL(nak_of(commit(SAMPLES - 1u, crc_of_constant(100, SAMPLES))), PT_NAK_CODE_CRC);
    (void)commit(SAMPLES, crc_of_constant(100, SAMPLES));
    CHECK_EQUAL(nak_of(arm(fake.nonce + 1u)), PT_NAK_CODE_NONCE);
    CHECK_EQUAL(nak_of(plain(PT_START)), PT_NAK_CODE_STATE); /* not armed */
    CHECK_EQUAL(state_of(arm(fake.nonce)), PT_STATE_ARMED);
    fake_ticks(100);
    CHECK(!fake.pwm_enabled);
    CHECK_EQUAL(state_of(plain(PT_START)), PT_STATE_RUNNING);
    fake_ticks(100);
    CHECK(fake_output_on());
}

static void a_run_ends_disarmed_and_has_every_sample(void)
{
    uint8_t p[PT_MAX_PAYLOAD];
    uint32_t next = 0;
    bool last = false;
    running(8000, 10);
    alive_ticks(10u * (SAMPLES - 1u) + 1u);
    CHECK_EQUAL(control.state, PT_STATE_RAMPING);
    alive_ticks(2000);
    CHECK_EQUAL(control.state, PT_STATE_IDLE);
    CHECK(!fake.pwm_enabled);
    CHECK_EQUAL(control.fault, PT_FAULT_NONE);
    while (fake_telemetry(p) != 0) {
        CHECK(!last);
        CHECK_EQUAL(get_u32(p + PT_TELEMETRY_FIRST_TICK), next);
        CHECK_EQUAL(p[PT_TELEMETRY_SESSION], 1);
        for (uint8_t k = 0; k < p[PT_TELEMETRY_COUNT]; k++)
            CHECK_EQUAL(get_i16(p + PT_TELEMETRY_LEN + 6u * k), 8000);
        next += 10u * p[PT_TELEMETRY_COUNT];
        last = (p[PT_TELEMETRY_FLAGS] & PT_FLAG_LAST) != 0;
    }
    CHECK(last);
    CHECK_EQUAL(next, 10u * SAMPLES);
    CHECK_EQUAL(nak_of(plain(PT_START)), PT_NAK_CODE_STATE);
    CHECK_EQUAL(nak_of(arm(fake.nonce)), PT_NAK_CODE_STATE);
}

static void another_major_version_is_answered_but_never_armed(void)
{
    ready(100, 10, SAMPLES);
    struct frame f = hello(PT_PROTOCOL_MAJOR + 1u);
    CHECK_EQUAL(f.type, PT_HELLO_REPLY);
    CHECK_EQUAL(f.length, PT_HELLO_REPLY_LEN);
    CHECK_EQUAL(f.payload[PT_HELLO_REPLY_MAJOR], PT_PROTOCOL_MAJOR);
    CHECK(memcmp(f.payload + PT_HELLO_REPLY_SERIAL, "SIXTEEN-LETTERS!", 16) == 0);
    CHECK_EQUAL(nak_of(arm(fake.nonce)), PT_NAK_CODE_VERSION);
}

static void a_silent_host_means_off_within_300_ms(void)
{
    running(15000, 1000);
    alive_ticks(3000);
    fake_ticks(2000);
    CHECK_EQUAL(control.state, PT_STATE_RUNNING);
    fake_ticks(1);
    CHECK_EQUAL(control.state, PT_STATE_RAMPING);
    CHECK_EQUAL(control.fault, PT_FAULT_HEARTBEAT);
    CHECK(off_after(2000) <= CONTROL_RAMP_TICKS);
    CHECK_EQUAL(control.state, PT_STATE_FAULT);
    CHECK_EQUAL(nak_of(begin(10, 10, 0)), PT_NAK_CODE_FAULT);
    CHECK_EQUAL(state_of(fake_clear_fault()), PT_STATE_IDLE);
    CHECK_EQUAL(nak_of(begin(10, 10, 0)), 0);
}

static void garbage_is_no_sign_of_life(void)
{
    uint8_t junk[3] = {1, 2, 3};
    running(5000, 1000);
    for (int k = 0; k < 30; k++) {
        fake_ticks(100);
        (void)fake_command(0x7F, junk, 3);      /* unknown */
        (void)fake_command(PT_START, junk, 3);  /* wrong length */
    }
    CHECK_EQUAL(control.fault, PT_FAULT_HEARTBEAT);
}

/* Frames that a stuck wire repeats, and questions that any program may ask, keep nothing alive. */
static void only_what_is_new_is_a_sign_of_life(void)
{
    const uint8_t older[PT_HEARTBEAT_LEN] = {1, 0, 0, 0};
    running(5000, 1000);
    alive_ticks(1000);
    for (uint8_t k = 0; k < 25; k++) {
        fake_ticks(100);
        CHECK_EQUAL(fake_command(PT_HEARTBEAT, older, PT_HEARTBEAT_LEN).type, PT_ACK);
        CHECK_EQUAL(plain(PT_STATUS).type, PT_STATUS_REPLY);
        CHECK_EQUAL(plain(PT_START).type, k < 20 ? PT_ACK : PT_NAK);
        CHECK_EQUAL(data(0, 5000, SAMPLES).type, k < 20 ? PT_ACK : PT_NAK); /* refused once it ramps */
    }
    CHECK_EQUAL(control.fault, PT_FAULT_HEARTBEAT);
    CHECK_EQUAL(control.snapshot.tick, 3000);
}

/* While it ramps down the host is not waited for: it could not do more by being silent. */
static void the_ramp_needs_no_heartbeat(void)
{
    running(15000, 1000);
    alive_ticks(3000);
    fake_ticks(1950);
    CHECK_EQUAL(state_of(plain(PT_STOP)), PT_STATE_RAMPING);
    fake_ticks(2000);
    CHECK_EQUAL(control.fault, PT_FAULT_NONE);
    CHECK_EQUAL(control.state, PT_STATE_IDLE);
}

static void what_a_host_has_not_seen_it_cannot_clear(void)
{
    running(12000, 1000);
    alive_ticks(1000);
    fake_ticks(2001); /* silence, then over-current during the ramp */
    const uint8_t first[] = {PT_FAULT_HEARTBEAT, PT_FAULT_HEARTBEAT};
    const uint8_t both[] = {PT_FAULT_HEARTBEAT, PT_FAULT_OVER_CURRENT};
    CHECK_EQUAL(nak_of(fake_command(PT_CLEAR_FAULT, first, 2)), PT_NAK_CODE_STATE); /* still ramping */
    fake.force_current = 3400;
    fake_ticks(1);
    CHECK_EQUAL(control.state, PT_STATE_FAULT);
    CHECK_EQUAL(nak_of(fake_command(PT_CLEAR_FAULT, first, 2)), PT_NAK_CODE_FAULT);
    CHECK_EQUAL(control.fault, PT_FAULT_HEARTBEAT);
    fake.force_current = -1;
    CHECK_EQUAL(state_of(fake_command(PT_CLEAR_FAULT, both, 2)), PT_STATE_IDLE);
    CHECK_EQUAL(control.fault, PT_FAULT_NONE);
    CHECK_EQUAL(state_of(fake_command(PT_CLEAR_FAULT, both, 2)), PT_STATE_IDLE); /* once more: nothing to do */
}

static void a_greeting_restores_every_parameter(void)
{
    fake_reset();
    (void)hello(PT_PROTOCOL_MAJOR);
    for (uint8_t id = 0; id < PT_PARAM_COUNT; id++)
        CHECK_EQUAL(set_param(id, commands_param_minimum(id)).type, PT_PARAM_REPLY);
    struct frame f = hello(PT_PROTOCOL_MAJOR);
    CHECK_EQUAL(get_i16(f.payload + PT_HELLO_REPLY_FORCE_TRIP), 15000);
    ready(15000, 1000, SAMPLES);
    (void)arm(fake.nonce);
    CHECK_EQUAL(control.safety.limits.force_trip_mN, 15000);
    CHECK_EQUAL(control.pid.gains.kp, 7680);
}

static struct frame coil_heat(uint16_t per_mille)
{
    uint8_t p[PT_COIL_HEAT_LEN];
    put_u16(p, per_mille);
    return fake_command(PT_COIL_HEAT, p, sizeof p);
}

static uint16_t heat(bool assumed)
{
    struct frame f = plain(PT_STATUS);
    CHECK_EQUAL((f.payload[PT_STATUS_REPLY_FLAGS] & PT_STATUS_HEAT_ASSUMED) != 0, assumed);
    return get_u16(f.payload + PT_STATUS_REPLY_HEAT);
}

static void the_coil_is_hot_until_told_and_over_any_reset_but_power_on(void)
{
    fake_reset();
    fake.reset_cause = PT_RESET_POWER;
    app_init();
    CHECK_EQUAL(heat(true), 1000);
    CHECK_EQUAL(nak_of(coil_heat(2001)), PT_NAK_CODE_RANGE);
    CHECK_EQUAL(coil_heat(300).type, PT_ACK);
    CHECK_EQUAL(heat(false), 300);
    CHECK_EQUAL(nak_of(coil_heat(200)), PT_NAK_CODE_RANGE); /* it knows better now */
    CHECK_EQUAL(coil_heat(800).type, PT_ACK);
    static const uint8_t warm[] = {PT_RESET_WATCHDOG, PT_RESET_EXTERNAL, PT_RESET_SOFTWARE, PT_RESET_BROWN_OUT};
    for (uint8_t k = 0; k < sizeof warm; k++) {
        fake.reset_cause = warm[k];
        app_init();
        CHECK_EQUAL(heat(false), 800);
    }
    hal_kept()->heat ^= 1u; /* the memory did not hold */
    app_init();
    CHECK_EQUAL(heat(true), 1000);
    fake.reset_cause = PT_RESET_WATCHDOG;
    app_init();
    CHECK_EQUAL(heat(true), 1000); /* assumed it stays */
}

static void a_hot_coil_stays_hot_over_a_reset(void)
{
    running(15000, 1000);
    control.safety.heat.average = HEAT_LIMIT - 100000;
    for (uint32_t k = 0; k < 200 && control.fault == PT_FAULT_NONE; k++)
        alive_ticks(100);
    CHECK_EQUAL(control.fault, PT_FAULT_COIL_HEAT);
    fake.reset_cause = PT_RESET_WATCHDOG;
    app_init();
    CHECK(control.safety.heat.average > HEAT_LIMIT - 200000);
}

static void over_current_kills_in_the_same_tick(void)
{
    running(10000, 1000);
    alive_ticks(1000);
    fake.force_current = 3400; /* 1.66 A */
    CHECK_EQUAL(off_after(10), 1);
    CHECK_EQUAL(control.fault, PT_FAULT_OVER_CURRENT);
    CHECK_EQUAL(control.state, PT_STATE_FAULT);
}

static void over_force_kills_at_the_third_sample(void)
{
    running(10000, 1000);
    alive_ticks(1000);
    fake.force_force = 3700; /* 15.3 N */
    CHECK_EQUAL(off_after(10), 3);
    CHECK_EQUAL(control.fault, PT_FAULT_OVER_FORCE);
}

/* Off, latched, told, refused until cleared: the same for every fault. */
static void is_off_latched_and_told(uint8_t fault)
{
    CHECK(!fake.pwm_enabled);
    CHECK_EQUAL(control.state, PT_STATE_FAULT);
    struct frame f = plain(PT_STATUS);
    CHECK_EQUAL(f.type, PT_STATUS_REPLY);
    CHECK_EQUAL(f.payload[PT_STATUS_REPLY_FAULT], fault);
    CHECK_EQUAL(f.payload[PT_STATUS_REPLY_FAULT_STATE], PT_STATE_RUNNING);
    CHECK_EQUAL(fake_beat().payload[PT_ACK_FAULT], fault);
    fake.force_current = fake.force_force = -1;
    fake_ticks(3000); /* the cause is gone, the fault is not */
    CHECK_EQUAL(control.fault, fault);
    CHECK_EQUAL(nak_of(begin(10, 10, 0)), PT_NAK_CODE_FAULT);
    CHECK_EQUAL(nak_of(arm(fake.nonce)), PT_NAK_CODE_FAULT);
    CHECK_EQUAL(nak_of(plain(PT_START)), PT_NAK_CODE_STATE);
    CHECK(!fake.pwm_enabled);
    CHECK_EQUAL(state_of(fake_clear_fault()), PT_STATE_IDLE);
}

static void a_broken_sensor_is_off_within_its_time_and_told(void)
{
    static const struct {
        int32_t current; /* what the converter reads from the start on; -1: the truth */
        int32_t force;
        uint8_t fault;
        uint32_t ticks; /* at most until the output is off */
    } rows[] = {
        {-1, 0, PT_FAULT_FORCE_RAIL, 3},        {-1, 4095, PT_FAULT_OVER_FORCE, 3},
        {4095, -1, PT_FAULT_OVER_CURRENT, 1},   {0, -1, PT_FAULT_NO_CURRENT, 150},
        {500, -1, PT_FAULT_CURRENT_FROZEN, 110}, {-1, 500, PT_FAULT_FORCE_FROZEN, 150},
    };
    for (uint16_t k = 0; k < sizeof rows / sizeof rows[0]; k++) {
        running(15000, 1000);
        fake.force_current = rows[k].current;
        fake.force_force = rows[k].force;
        uint32_t ticks = 0;
        while (ticks < 1000 && control.fault == PT_FAULT_NONE) {
            fake_ticks(1);
            ticks++;
        }
        CHECK(ticks <= rows[k].ticks);
        is_off_latched_and_told(rows[k].fault);
    }
}

static void full_current_without_any_force_is_off_within_600_ms(void)
{
    running(14000, 1000);
    uint32_t ticks = 0;
    for (; ticks < 10000 && control.fault == PT_FAULT_NONE; ticks++) {
        fake.force_force = 228 + (int32_t)(ticks & 1u); /* nothing, but alive */
        fake_ticks(1);
        if (ticks % 500 == 0)
            (void)fake_beat();
    }
    CHECK(ticks <= 6000);
    is_off_latched_and_told(PT_FAULT_NO_FORCE);
}

static void every_ramping_fault_is_off_within_100_ms_and_told(void)
{
    running(15000, 1000); /* silence */
    alive_ticks(1000);
    CHECK(off_after(2001u + CONTROL_RAMP_TICKS) <= 2001u + CONTROL_RAMP_TICKS);
    is_off_latched_and_told(PT_FAULT_HEARTBEAT);

    ready(15000, 10, 2u * SAMPLES); /* underrun */
    (void)arm(fake.nonce);
    (void)plain(PT_START);
    alive_ticks(10u * (SAMPLES - 1u) + 1u);
    CHECK(off_after(2000) <= CONTROL_RAMP_TICKS);
    is_off_latched_and_told(PT_FAULT_UNDERRUN);

    running(15000, 1000); /* on-time */
    alive_ticks(1000);
    control.safety.limits.on_ticks = 1500;
    alive_ticks(501);
    CHECK(off_after(2000) <= CONTROL_RAMP_TICKS);
    is_off_latched_and_told(PT_FAULT_ON_TIME);

    running(15000, 1000); /* heat */
    alive_ticks(1000);
    control.safety.heat.average = HEAT_LIMIT + 1000000;
    fake_ticks(1);
    CHECK(off_after(2000) <= CONTROL_RAMP_TICKS);
    control.safety.heat.average = 0;
    is_off_latched_and_told(PT_FAULT_COIL_HEAT);
}

static void a_force_while_only_armed_trips_too(void)
{
    ready(100, 10, SAMPLES);
    (void)arm(fake.nonce);
    fake.force_force = 3700;
    fake_ticks(5);
    CHECK_EQUAL(control.fault, PT_FAULT_OVER_FORCE);
    CHECK_EQUAL(control.state, PT_STATE_FAULT);
}

static void a_missed_tick_is_a_fault(void)
{
    running(10000, 1000);
    alive_ticks(1000);
    fake.overrun = true;
    CHECK_EQUAL(off_after(10), 1);
    CHECK_EQUAL(control.fault, PT_FAULT_TICK_OVERRUN);
}

/* Wherever the inner one comes, the outer one's write does not switch on again what it has killed. */
static void a_tick_that_breaks_into_itself_is_off(void)
{
    for (int at = 0; at < 2; at++) {
        running(10000, 1000);
        alive_ticks(1000);
        fake.nest_read = at == 0;
        fake.nest_set = at == 1;
        fake_ticks_without_main(1);
        CHECK(!fake.pwm_enabled);
        CHECK_EQUAL(control.state, PT_STATE_FAULT);
        CHECK_EQUAL(control.fault, PT_FAULT_TICK_OVERRUN);
        fake_ticks(100);
        CHECK(!fake.pwm_enabled);
    }
}

static void a_tick_that_stays_away_is_told_by_the_main_loop(void)
{
    running(10000, 1000);
    alive_ticks(1000);
    fake.pwm_enabled = false; /* the port's own timer has done it */
    fake.tick_lost = true;
    app_poll();
    CHECK_EQUAL(control.state, PT_STATE_FAULT);
    CHECK_EQUAL(control.fault, PT_FAULT_TICK_LOST);
    fake_ticks(100);
    CHECK(!fake.pwm_enabled);
}

static void readings_that_are_not_new_are_a_fault(void)
{
    running(10000, 1000);
    alive_ticks(1000);
    fake.stale = true;
    CHECK_EQUAL(off_after(10), 1);
    CHECK_EQUAL(control.fault, PT_FAULT_CONVERTER);
}

/* The slowest slew, the weakest and the wildest gains that a host may choose. */
/* What would ring on the compiled gains does not ring on the way down either; what is stronger does not press. */
static void the_way_down_has_the_weaker_gain_of_each_kind(void)
{
    ready(9000, 1000, SAMPLES);
    (void)set_param(PT_PARAM_PID_KP, 500);
    (void)set_param(PT_PARAM_PID_KI, 9000);
    (void)set_param(PT_PARAM_FEED_RESISTANCE, 50000);
    (void)set_param(PT_PARAM_FEED_INDUCTANCE, 7);
    (void)begin(SAMPLES, 1000, crc_of_constant(900, SAMPLES));
    (void)data(0, 900, SAMPLES);
    (void)commit(SAMPLES, crc_of_constant(900, SAMPLES));
    (void)arm(fake.nonce);
    (void)plain(PT_START);
    fake_ticks(20);
    CHECK_EQUAL(control.pid.gains.ki, 9000);
    (void)plain(PT_STOP);
    CHECK_EQUAL(control.state, PT_STATE_RAMPING);
    CHECK_EQUAL(control.pid.gains.kp, 500);
    CHECK_EQUAL(control.pid.gains.ki, PT_DEFAULT_PID_KI);
    CHECK_EQUAL(control.pid.gains.feed_resistance, PT_DEFAULT_FEED_RESISTANCE);
    CHECK_EQUAL(control.pid.gains.feed_inductance, 7);
    CHECK_EQUAL(control.pid.gains.feed_offset, PT_DEFAULT_FEED_OFFSET);
}

static void no_parameter_makes_the_way_down_longer(void)
{
    for (int wild = 0; wild < 2; wild++) {
        fake_reset();
        (void)hello(PT_PROTOCOL_MAJOR);
        for (uint8_t id = PT_PARAM_PID_KP; id < PT_PARAM_COUNT; id++)
            (void)set_param(id, wild ? commands_param_maximum(id) : 1);
        (void)set_param(PT_PARAM_SLEW_LIMIT, 1);
        (void)begin(SAMPLES, 1000, crc_of_constant(9000, SAMPLES));
        (void)data(0, 9000, SAMPLES);
        (void)commit(SAMPLES, crc_of_constant(9000, SAMPLES));
        (void)arm(fake.nonce);
        (void)plain(PT_START);
        for (uint32_t k = 0; k < 100 && control.state == PT_STATE_RUNNING; k++)
            alive_ticks(100);
        (void)plain(PT_STOP);
        CHECK(off_after(2000) <= CONTROL_RAMP_TICKS);
    }
}

static void the_worst_is_told_beside_the_first(void)
{
    running(10000, 1000);
    alive_ticks(1000);
    fake.force_current = 3500; /* 1.71 A, and so it stays */
    CHECK_EQUAL(off_after(10), 1);
    fake_ticks(SAFETY_OFF_TICKS - 1u);
    CHECK_EQUAL(plain(PT_STATUS).payload[PT_STATUS_REPLY_FLAGS] & PT_STATUS_OUTPUT_NOT_OFF, 0);
    fake_ticks(2);
    struct frame f = plain(PT_STATUS);
    CHECK_EQUAL(f.payload[PT_STATUS_REPLY_FAULT], PT_FAULT_OVER_CURRENT);
    CHECK_EQUAL(f.payload[PT_STATUS_REPLY_WORST], PT_FAULT_OUTPUT_NOT_OFF);
    CHECK_EQUAL(f.payload[PT_STATUS_REPLY_FLAGS] & PT_STATUS_OUTPUT_NOT_OFF, PT_STATUS_OUTPUT_NOT_OFF);
    CHECK(get_i16(f.payload + PT_STATUS_REPLY_CURRENT) > 17000);
}

static void a_force_that_does_not_fall_is_an_output_that_is_not_off(void)
{
    running(10000, 1000);
    alive_ticks(1000);
    fake.force_current = 0; /* no shunt any more */
    fake.force_force = 2000; /* 7.8 N */
    fake_ticks(2000);
    CHECK_EQUAL(control.fault, PT_FAULT_NO_CURRENT);
    CHECK_EQUAL(control.worst, PT_FAULT_NO_CURRENT);
    fake_ticks(SAFETY_RELEASE_TICKS);
    CHECK_EQUAL(control.worst, PT_FAULT_OUTPUT_NOT_OFF);
}

static void a_sensor_that_does_not_read_zero_is_not_armed(void)
{
    ready(5000, 1000, SAMPLES);
    fake.force_force = 0; /* -1 N */
    fake_ticks(200);
    CHECK_EQUAL(nak_of(arm(fake.nonce)), PT_NAK_CODE_FAULT);
    CHECK_EQUAL(control.fault, PT_FAULT_FORCE_ZERO);
    CHECK_EQUAL(control.state, PT_STATE_FAULT);
    CHECK(!fake.pwm_enabled);
}

static void an_underrun_ramps_down_and_faults(void)
{
    ready(15000, 10, 2u * SAMPLES);
    (void)arm(fake.nonce);
    (void)plain(PT_START);
    alive_ticks(10u * (SAMPLES - 1u));
    CHECK_EQUAL(control.state, PT_STATE_RUNNING);
    alive_ticks(1);
    CHECK_EQUAL(control.fault, PT_FAULT_UNDERRUN);
    CHECK_EQUAL(control.state, PT_STATE_RAMPING);
    CHECK(off_after(2000) <= CONTROL_RAMP_TICKS);
    CHECK_EQUAL(control.state, PT_STATE_FAULT);
}

static void a_wave_with_a_wrong_checksum_is_stopped(void)
{
    ready(9000, 10, 2u * SAMPLES);
    (void)arm(fake.nonce);
    (void)plain(PT_START);
    alive_ticks(100);
    (void)data(SAMPLES, 9001, SAMPLES);
    fake_ticks(1);
    CHECK_EQUAL(control.fault, PT_FAULT_WAVE_CRC);
}

/* An open-ended wave of 8000 that is being played, SAMPLES samples of `ticks` ticks sent. */
static void running_open(uint16_t ticks)
{
    ready(8000, ticks, PT_WAVE_OPEN);
    CHECK_EQUAL(state_of(arm(fake.nonce)), PT_STATE_ARMED);
    CHECK_EQUAL(state_of(plain(PT_START)), PT_STATE_RUNNING);
}

static void an_open_wave_goes_on_until_its_end_is_told(void)
{
    uint32_t sent = SAMPLES;
    running_open(10);
    for (uint32_t turn = 0; turn < 40u; turn++) { /* twice round the ring */
        alive_ticks(10u * SAMPLES - 100u * (turn == 0));
        CHECK_EQUAL(state_of(data(sent, 8000, SAMPLES)), PT_STATE_RUNNING);
        sent += SAMPLES;
        CHECK_EQUAL(state_of(check_sent(sent, crc_of_constant(8000, sent), 0)), PT_STATE_RUNNING);
    }
    CHECK_EQUAL(state_of(check_sent(sent, crc_of_constant(8000, sent), 1)), PT_STATE_RUNNING);
    CHECK_EQUAL(nak_of(data(sent, 8000, SAMPLES)), PT_NAK_CODE_OFFSET); /* nothing behind the end */
    CHECK_EQUAL(nak_of(check_sent(sent, crc_of_constant(8000, sent), 1)), PT_NAK_CODE_STATE);
    alive_ticks(10u * SAMPLES + 1000u);
    CHECK_EQUAL(control.state, PT_STATE_IDLE);
    CHECK_EQUAL(control.fault, PT_FAULT_NONE);
    CHECK_EQUAL(control.tick, 10u * (sent - 1u) + 1u);
    CHECK(!fake.pwm_enabled);
    CHECK_EQUAL(nak_of(check_sent(sent, crc_of_constant(8000, sent), 1)), PT_NAK_CODE_STATE);
}

static void an_open_wave_that_runs_dry_ramps_down_and_faults(void)
{
    running_open(10);
    alive_ticks(10u * SAMPLES);
    CHECK_EQUAL(control.fault, PT_FAULT_UNDERRUN);
    CHECK(off_after(2000) <= CONTROL_RAMP_TICKS);
}

static void an_open_wave_that_arrived_wrong_ramps_down_and_faults(void)
{
    running_open(10);
    CHECK_EQUAL(nak_of(check_sent(SAMPLES - 1u, crc_of_constant(8000, SAMPLES - 1u), 1)), PT_NAK_CODE_OFFSET);
    CHECK_EQUAL(control.fault, PT_FAULT_NONE);
    CHECK_EQUAL(state_of(check_sent(SAMPLES, 1, 1)), PT_STATE_RUNNING);
    fake_ticks(1);
    CHECK_EQUAL(control.fault, PT_FAULT_WAVE_CRC);
    CHECK_EQUAL(control.state, PT_STATE_RAMPING);
    CHECK(off_after(2000) <= CONTROL_RAMP_TICKS);
}

static void an_open_wave_needs_a_living_host_and_keeps_the_on_time(void)
{
    running_open(1000);
    fake_ticks(2001);
    CHECK_EQUAL(control.fault, PT_FAULT_HEARTBEAT);
    CHECK_EQUAL(control.state, PT_STATE_RAMPING);
    fake_reset();
    (void)hello(PT_PROTOCOL_MAJOR);
    (void)set_param(PT_PARAM_ON_TIME, 1);
    CHECK_EQUAL(nak_of(begin(PT_WAVE_OPEN, 10000, 0)), 0);
    (void)data(0, 100, SAMPLES);
    (void)commit(SAMPLES, crc_of_constant(100, SAMPLES));
    CHECK_EQUAL(state_of(arm(fake.nonce)), PT_STATE_ARMED);
    CHECK_EQUAL(state_of(plain(PT_START)), PT_STATE_RUNNING);
    alive_ticks(PT_TICK_RATE_HZ + 1u);
    CHECK_EQUAL(control.fault, PT_FAULT_ON_TIME);
    CHECK(off_after(2000) <= CONTROL_RAMP_TICKS);
}

static void the_first_cause_stays_with_its_snapshot(void)
{
    running(12000, 1000);
    alive_ticks(1000);
    fake_ticks(2001); /* silence, then over-current during the ramp */
    fake.force_current = 3400;
    CHECK_EQUAL(off_after(10), 1);
    CHECK_EQUAL(control.fault, PT_FAULT_HEARTBEAT);
    struct frame f = plain(PT_STATUS);
    CHECK_EQUAL(f.type, PT_STATUS_REPLY);
    CHECK_EQUAL(f.payload[PT_STATUS_REPLY_FAULT], PT_FAULT_HEARTBEAT);
    CHECK_EQUAL(get_u32(f.payload + PT_STATUS_REPLY_FAULT_TICK), 3000); /* the tick after 0..2999 */
    CHECK_EQUAL(get_i16(f.payload + PT_STATUS_REPLY_FAULT_REFERENCE), 12000);
    CHECK_EQUAL(f.payload[PT_STATUS_REPLY_FAULT_STATE], PT_STATE_RUNNING);
}

static void stop_ramps_and_disarms(void)
{
    running(15000, 1000);
    alive_ticks(1000);
    CHECK_EQUAL(state_of(plain(PT_STOP)), PT_STATE_RAMPING);
    CHECK(off_after(2000) <= CONTROL_RAMP_TICKS);
    CHECK_EQUAL(control.state, PT_STATE_IDLE);
    CHECK_EQUAL(control.fault, PT_FAULT_NONE);
    CHECK_EQUAL(nak_of(plain(PT_START)), PT_NAK_CODE_STATE);
}

static void a_new_hello_stops_what_an_earlier_host_left_running(void)
{
    running(15000, 1000);
    alive_ticks(1000);
    (void)hello(PT_PROTOCOL_MAJOR);
    CHECK_EQUAL(control.state, PT_STATE_RAMPING);
}

static void parameters_only_lower_the_compiled_limits(void)
{
    fake_reset();
    (void)hello(PT_PROTOCOL_MAJOR);
    CHECK_EQUAL(nak_of(set_param(PT_PARAM_FORCE_TRIP, 15001)), PT_NAK_CODE_RANGE);
    CHECK_EQUAL(nak_of(set_param(PT_PARAM_CURRENT_TRIP, 16501)), PT_NAK_CODE_RANGE);
    CHECK_EQUAL(nak_of(set_param(PT_PARAM_HEARTBEAT, 201)), PT_NAK_CODE_RANGE);
    CHECK_EQUAL(nak_of(set_param(PT_PARAM_COUNT, 1)), PT_NAK_CODE_PARAM);
    CHECK_EQUAL(set_param(PT_PARAM_CURRENT_LIMIT, 5000).type, PT_PARAM_REPLY);
    (void)begin(10, 10, 0);
    CHECK_EQUAL(nak_of(data(0, 5001, 10)), PT_NAK_CODE_RANGE);
    CHECK_EQUAL(nak_of(data(0, -1, 10)), PT_NAK_CODE_RANGE);
    CHECK_EQUAL(nak_of(data(0, 5000, 10)), 0);
    running(10000, 1000);
    CHECK_EQUAL(nak_of(set_param(PT_PARAM_FORCE_TRIP, 1000)), PT_NAK_CODE_STATE);
}

static void upload_is_idempotent_and_in_order(void)
{
    fake_reset();
    (void)hello(PT_PROTOCOL_MAJOR);
    (void)begin(3000, 10, 0);
    CHECK_EQUAL(get_u16(data(0, 1, 50).payload), PT_WAVE_BUFFER_SAMPLES - 50u);
    CHECK_EQUAL(get_u16(data(0, 1, 50).payload), PT_WAVE_BUFFER_SAMPLES - 50u); /* again, another seq */
    CHECK_EQUAL(nak_of(data(49, 1, 50)), PT_NAK_CODE_OFFSET);
    CHECK_EQUAL(nak_of(data(51, 1, 50)), PT_NAK_CODE_OFFSET);
    for (uint32_t at = 50; at < 1000; at += 50)
        CHECK_EQUAL(nak_of(data(at, 1, 50)), 0);
    CHECK_EQUAL(nak_of(data(1000, 1, 50)), PT_NAK_CODE_CREDIT);
    CHECK_EQUAL(nak_of(data(1000, 1, 24)), 0);
    CHECK_EQUAL(nak_of(begin(0, 10, 0)), PT_NAK_CODE_RANGE);
    CHECK_EQUAL(nak_of(begin(10, 0, 0)), PT_NAK_CODE_RANGE);
    CHECK_EQUAL(nak_of(begin(9000001, 1, 0)), PT_NAK_CODE_RANGE); /* longer than the on-time */
    CHECK_EQUAL(nak_of(begin(0xFFFFFFFEu, 10000, 0)), PT_NAK_CODE_RANGE);
    (void)begin(30, 10, 0);
    CHECK_EQUAL(nak_of(data(0, 1, 50)), PT_NAK_CODE_OFFSET); /* beyond what was announced */
}

static void a_repeated_command_is_answered_from_memory(void)
{
    ready(5000, 10, SAMPLES);
    (void)arm(fake.nonce);
    CHECK_EQUAL(fake_command_seq(PT_START, 200, NULL, 0).type, PT_ACK);
    uint8_t session = control.session;
    fake_ticks(10);
    struct frame f = fake_command_seq(PT_START, 200, NULL, 0);
    CHECK_EQUAL(f.type, PT_ACK);
    CHECK_EQUAL(f.payload[PT_ACK_SESSION], session);
    CHECK_EQUAL(control.session, session);
}

/* The wire repeats ARM and START together: neither is the last command any more when it comes again. */
static void an_older_repetition_changes_nothing_and_is_no_refusal(void)
{
    uint8_t nonce[PT_ARM_LEN];
    ready(5000, 10, SAMPLES);
    put_u32(nonce, fake.nonce);
    CHECK_EQUAL(fake_command_seq(PT_ARM, 200, nonce, PT_ARM_LEN).type, PT_ACK);
    CHECK_EQUAL(fake_command_seq(PT_STREAM, 201, (const uint8_t[]){10, 0}, PT_STREAM_LEN).type, PT_ACK);
    CHECK_EQUAL(state_of(fake_command_seq(PT_ARM, 200, nonce, PT_ARM_LEN)), PT_STATE_ARMED);
    CHECK_EQUAL(fake_command_seq(PT_START, 202, NULL, 0).type, PT_ACK);
    uint8_t session = control.session;
    alive_ticks(100);
    CHECK_EQUAL(fake_command_seq(PT_ARM, 200, nonce, PT_ARM_LEN).type, PT_NAK);
    struct frame f = fake_command_seq(PT_START, 202, NULL, 0);
    CHECK_EQUAL(state_of(f), PT_STATE_RUNNING);
    CHECK_EQUAL(control.session, session);
    CHECK_EQUAL(control.tick, 100);
    (void)plain(PT_STOP);
    fake_ticks(1500);
    CHECK_EQUAL(fake_command_seq(PT_START, 202, NULL, 0).type, PT_NAK); /* the run is over: no second one */
    CHECK_EQUAL(fake_command_seq(PT_ARM, 200, nonce, PT_ARM_LEN).type, PT_NAK);
    CHECK_EQUAL(control.state, PT_STATE_IDLE);
}

static void a_host_that_does_not_read_costs_samples_not_replies(void)
{
    uint8_t p[PT_MAX_PAYLOAD];
    uint32_t received = 0;
    uint16_t dropped = 0;
    running(5000, 1000);
    fake.tx_space = FRAME_MAX_ENCODED; /* room for a reply only */
    alive_ticks(20000);
    CHECK_EQUAL(fake_beat().type, PT_ACK);
    CHECK_EQUAL(fake_telemetry(p), 0);
    fake.tx_space = 4096;
    (void)plain(PT_STOP);
    fake_ticks(1500);
    while (fake_telemetry(p) != 0) {
        received += p[PT_TELEMETRY_COUNT];
        dropped = get_u16(p + PT_TELEMETRY_DROPPED);
    }
    CHECK_EQUAL(received + dropped, control.telemetry.produced);
    CHECK(dropped > 1000);
}

/* Items of 8 bytes with the duty of the tick before, to a host that knows them; others get theirs. */
static void telemetry_carries_the_duty_to_a_host_that_knows_it(void)
{
    uint8_t p[PT_MAX_PAYLOAD];
    for (uint8_t minor = 0; minor <= PT_PROTOCOL_MINOR; minor++) {
        bool knows = minor >= PT_DUTY_SINCE_MINOR;
        uint16_t item = knows ? PT_TELEMETRY_DUTY_ITEM : PT_TELEMETRY_ITEM;
        fake_reset();
        (void)hello_of(PT_PROTOCOL_MAJOR, minor);
        (void)begin(SAMPLES, 10, crc_of_constant(8000, SAMPLES));
        (void)data(0, 8000, SAMPLES);
        (void)commit(SAMPLES, crc_of_constant(8000, SAMPLES));
        (void)plain_stream(1);
        (void)arm(fake.nonce);
        (void)plain(PT_START);
        uint16_t duty[600];
        for (uint16_t k = 0; k < 600; k++) {
            duty[k] = control.now.duty_counts; /* in force until the next tick */
            fake_ticks(1);
            if (k == 300)
                (void)fake_beat();
        }
        uint16_t seen = 0;
        uint16_t length;
        while ((length = fake_telemetry(p)) != 0) {
            CHECK_EQUAL(length, PT_TELEMETRY_LEN + item * p[PT_TELEMETRY_COUNT]);
            CHECK_EQUAL(p[PT_TELEMETRY_COUNT], knows ? PT_TELEMETRY_DUTY_MAX_ITEMS : PT_TELEMETRY_MAX_ITEMS);
            for (uint8_t k = 0; k < p[PT_TELEMETRY_COUNT]; k++, seen++) {
                CHECK_EQUAL(get_i16(p + PT_TELEMETRY_LEN + item * k), 8000);
                if (knows)
                    CHECK_EQUAL(get_u16(p + PT_TELEMETRY_LEN + item * k + PT_TELEMETRY_ITEM), duty[seen]);
            }
        }
        CHECK(seen >= 560);
    }
}

static void the_slew_limit_is_flagged_and_the_asked_value_reported(void)
{
    uint8_t p[PT_MAX_PAYLOAD];
    running(15000, 10);
    fake_ticks(300);
    CHECK(fake_telemetry(p) != 0);
    CHECK(p[PT_TELEMETRY_FLAGS] & PT_FLAG_SLEW);
    CHECK_EQUAL(get_i16(p + PT_TELEMETRY_LEN), 15000);
    CHECK(fake_telemetry(p) == 0 || !(p[PT_TELEMETRY_FLAGS] & PT_FLAG_SLEW));
}

static void the_watchdog_wants_both_contexts(void)
{
    fake_reset();
    fake_ticks(10);
    uint32_t fed = fake.fed;
    CHECK(fed > 0);
    fake_ticks_without_main(10); /* the main loop hangs */
    CHECK_EQUAL(fake.fed, fed);
    app_poll();
    CHECK_EQUAL(fake.fed, fed + 1u);
    app_poll(); /* the tick hangs */
    app_poll();
    CHECK_EQUAL(fake.fed, fed + 1u);
}

static void a_reset_in_mid_play_is_off_and_remembers_nothing(void)
{
    running(12000, 1000);
    alive_ticks(1000);
    CHECK(fake_output_on());
    fake.nonce++;
    app_init();
    CHECK(!fake.pwm_enabled);
    fake_ticks(100);
    CHECK(!fake.pwm_enabled);
    CHECK_EQUAL(nak_of(plain(PT_START)), PT_NAK_CODE_STATE);
    CHECK_EQUAL(nak_of(arm(fake.nonce)), PT_NAK_CODE_VERSION);
}

static void every_wrong_length_is_refused(void)
{
    uint8_t junk[PT_MAX_PAYLOAD];
    memset(junk, 1, sizeof junk);
    static const uint8_t lengths[][2] = {
#define ROW(name, item) {PT_##name, (item) ? 0xFFu : PT_##name##_LEN},
        PT_COMMANDS(ROW)
#undef ROW
    };
    fake_reset();
    for (uint16_t c = 0; c < sizeof lengths / sizeof lengths[0]; c++)
        for (uint8_t n = 0; n <= PT_MAX_PAYLOAD; n++)
            if (n != lengths[c][1] && !(lengths[c][0] == PT_WAVE_DATA && n == PT_WAVE_DATA_LEN + 2u))
                CHECK_EQUAL(nak_of(fake_command(lengths[c][0], junk, n)), PT_NAK_CODE_LENGTH);
    CHECK_EQUAL(nak_of(fake_command(0x55, junk, 1)), PT_NAK_CODE_UNKNOWN);
}

int main(void)
{
    RUN(the_output_is_off_until_everything_says_on);
    RUN(a_run_ends_disarmed_and_has_every_sample);
    RUN(another_major_version_is_answered_but_never_armed);
    RUN(a_silent_host_means_off_within_300_ms);
    RUN(garbage_is_no_sign_of_life);
    RUN(only_what_is_new_is_a_sign_of_life);
    RUN(the_ramp_needs_no_heartbeat);
    RUN(what_a_host_has_not_seen_it_cannot_clear);
    RUN(a_greeting_restores_every_parameter);
    RUN(the_coil_is_hot_until_told_and_over_any_reset_but_power_on);
    RUN(a_hot_coil_stays_hot_over_a_reset);
    RUN(over_current_kills_in_the_same_tick);
    RUN(over_force_kills_at_the_third_sample);
    RUN(a_broken_sensor_is_off_within_its_time_and_told);
    RUN(full_current_without_any_force_is_off_within_600_ms);
    RUN(every_ramping_fault_is_off_within_100_ms_and_told);
    RUN(a_force_while_only_armed_trips_too);
    RUN(a_missed_tick_is_a_fault);
    RUN(a_tick_that_breaks_into_itself_is_off);
    RUN(a_tick_that_stays_away_is_told_by_the_main_loop);
    RUN(readings_that_are_not_new_are_a_fault);
    RUN(no_parameter_makes_the_way_down_longer);
    RUN(the_way_down_has_the_weaker_gain_of_each_kind);
    RUN(the_worst_is_told_beside_the_first);
    RUN(a_force_that_does_not_fall_is_an_output_that_is_not_off);
    RUN(a_sensor_that_does_not_read_zero_is_not_armed);
    RUN(an_underrun_ramps_down_and_faults);
    RUN(a_wave_with_a_wrong_checksum_is_stopped);
    RUN(an_open_wave_goes_on_until_its_end_is_told);
    RUN(an_open_wave_that_runs_dry_ramps_down_and_faults);
    RUN(an_open_wave_that_arrived_wrong_ramps_down_and_faults);
    RUN(an_open_wave_needs_a_living_host_and_keeps_the_on_time);
    RUN(the_first_cause_stays_with_its_snapshot);
    RUN(stop_ramps_and_disarms);
    RUN(a_new_hello_stops_what_an_earlier_host_left_running);
    RUN(parameters_only_lower_the_compiled_limits);
    RUN(upload_is_idempotent_and_in_order);
    RUN(a_repeated_command_is_answered_from_memory);
    RUN(an_older_repetition_changes_nothing_and_is_no_refusal);
    RUN(a_host_that_does_not_read_costs_samples_not_replies);
    RUN(telemetry_carries_the_duty_to_a_host_that_knows_it);
    RUN(the_slew_limit_is_flagged_and_the_asked_value_reported);
    RUN(the_watchdog_wants_both_contexts);
    RUN(a_reset_in_mid_play_is_off_and_remembers_nothing);
    RUN(every_wrong_length_is_refused);
    CHECK_DONE();
}
