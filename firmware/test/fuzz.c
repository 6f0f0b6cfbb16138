/* Damaged frames into the decoder, wild commands into the whole core, under the sanitizers.
 *
 *   fuzz SEED FRAMES SEQUENCES    a loop of our own, the same everywhere for the same seed
 *   -DFUZZ_LIBFUZZER              the same sequences as a libFuzzer target (clang)
 *
 * Exit status 0: nothing wrong; 1: an invariant is broken. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "app.h"
#include "commands.h"
#include "control.h"
#include "fake_hal.h"
#include "hal.h"
#include "units.h"

#define REQUIRE(condition)                                                        \
    do {                                                                          \
        if (!(condition)) {                                                       \
            printf("%s:%d: %s (state %u)\n", __FILE__, __LINE__, #condition, control.state); \
            abort();                                                              \
        }                                                                         \
    } while (0)

/* --- a sequence: bytes that are read as commands, noise and time -------------------------------- */

struct tape {
    const uint8_t *bytes;
    size_t left;
};

static uint8_t next(struct tape *t)
{
    if (t->left == 0)
        return 0;
    t->left--;
    return *t->bytes++;
}

static uint16_t next16(struct tape *t)
{
    uint16_t low = next(t);
    return (uint16_t)(low | ((uint16_t)next(t) << 8));
}

static uint32_t latched_ticks;  /* since a fault was latched, while the output was on */
static uint32_t over_force;     /* ticks in a row above the trip in force, while driven */

/* After each tick: no limit is exceeded for longer than is stated. */
static void check_tick(void)
{
    REQUIRE(!fake.pwm_enabled || control.state == PT_STATE_RUNNING || control.state == PT_STATE_RAMPING);
    latched_ticks = fake.pwm_enabled && control.fault != PT_FAULT_NONE ? latched_ticks + 1u : 0u;
    REQUIRE(latched_ticks <= CONTROL_RAMP_TICKS);
    REQUIRE(!fake.pwm_enabled || safety_gravity(control.worst) <= SAFETY_RAMPS); /* a hard one: in the same tick */
    bool over = fake.pwm_enabled && control.now.force_mN > control.safety.limits.force_trip_mN;
    over_force = over ? over_force + 1u : 0u;
    REQUIRE(over_force < 3u);
    REQUIRE(!fake.pwm_enabled || control.now.current_100uA <= control.safety.limits.current_trip_100uA);
    REQUIRE(control.state != PT_STATE_RUNNING || control.safety.silent_ticks <= control.safety.limits.heartbeat_ticks);
}

/* Whatever was said to it, this holds. */
static void check(void)
{
    REQUIRE(control.state <= PT_STATE_FAULT);
    REQUIRE(control.fault <= PT_FAULT_CONVERTER);
    bool may_drive = control.state == PT_STATE_RUNNING || control.state == PT_STATE_RAMPING;
    REQUIRE(may_drive || !fake.pwm_enabled);
    REQUIRE(fake.pwm <= HAL_PWM_PERIOD);
    REQUIRE(control.now.reference_100uA >= 0 && control.now.reference_100uA <= commands_param_maximum(PT_PARAM_CURRENT_LIMIT));
    REQUIRE(control.state != PT_STATE_RUNNING || control.fault == PT_FAULT_NONE);
    REQUIRE((control.state != PT_STATE_ARMED && control.state != PT_STATE_RUNNING) || (control.wave.committed && commands.greeted));
    REQUIRE((uint16_t)(control.wave.head - control.wave.tail) <= PT_WAVE_BUFFER_SAMPLES);
    REQUIRE(control.wave.received <= control.wave.total);
    REQUIRE(telemetry_waiting(&control.telemetry) <= TELEMETRY_RING);
    for (uint8_t id = 0; id < PT_PARAM_COUNT; id++)
        REQUIRE(commands.param[id] >= commands_param_minimum(id) && commands.param[id] <= commands_param_maximum(id));
    REQUIRE(control.safety.limits.current_trip_100uA <= 16500 && control.safety.limits.force_trip_mN <= 15000);
    REQUIRE(control.safety.limits.heartbeat_ticks <= 2000);
}

static void wild_command(struct tape *t)
{
    uint8_t p[PT_MAX_PAYLOAD];
    uint8_t type = (uint8_t)(next(t) % 16u);
    uint8_t seq = (uint8_t)(next(t) % 8u); /* few: repetitions are common */
    uint8_t length = (uint8_t)(next(t) % (PT_MAX_PAYLOAD + 1u));
    for (uint8_t k = 0; k < length; k++)
        p[k] = next(t);
    (void)fake_command_seq(type, seq, p, length);
}

/* What brings the device on from where it is, by its place in sensible_command(). */
static uint8_t step(void)
{
    if (control.fault != PT_FAULT_NONE || control.state == PT_STATE_RAMPING)
        return 8;
    if (!commands.greeted)
        return 0;
    if (control.state == PT_STATE_ARMED)
        return 6;
    if (!control.wave.begun)
        return 1;
    if (control.wave.received < control.wave.total && (control.wave.received < 100u || control.state == PT_STATE_RUNNING))
        return 2;
    return control.state == PT_STATE_RUNNING ? 8 : control.wave.committed ? 5 : 4;
}

/* The right thing to say next, so that the deep states are reached, with a value that may be wrong. */
static void sensible_command(struct tape *t)
{
    static uint32_t announced_crc;
    uint8_t p[PT_MAX_PAYLOAD] = {0};
    uint8_t choice = next(t);
    switch (next(t) < 200u ? step() : choice % 11u) {
    case 0:
        put_u32(p + PT_HELLO_MAGIC, PT_MAGIC);
        p[PT_HELLO_MAJOR] = (uint8_t)(choice < 250u ? PT_PROTOCOL_MAJOR : choice);
        p[PT_HELLO_MINOR] = (uint8_t)(choice % 4u);
        (void)fake_command(PT_HELLO, p, PT_HELLO_LEN);
        break;
    case 1: {
        uint32_t total = next16(t) % 600u;
        uint8_t zeros[2] = {0, 0};
        announced_crc = 0;
        for (uint32_t k = 0; k < total; k++)
            announced_crc = wave_crc32(announced_crc, zeros, 2);
        put_u32(p + PT_WAVE_BEGIN_TOTAL, total);
        put_u16(p + PT_WAVE_BEGIN_TICKS_PER_SAMPLE, (uint16_t)(1u + next(t) % 30u));
        put_u32(p + PT_WAVE_BEGIN_CRC32, announced_crc ^ (choice < 240u ? 0u : 1u));
        (void)fake_command(PT_WAVE_BEGIN, p, PT_WAVE_BEGIN_LEN);
        break;
    }
    case 2:
    case 3: {
        uint32_t missing = control.wave.total - control.wave.received;
        uint8_t count = (uint8_t)(1u + next(t) % PT_WAVE_DATA_MAX_ITEMS);
        if (count > missing && missing > 0)
            count = (uint8_t)missing;
        put_u32(p + PT_WAVE_DATA_OFFSET, control.wave.received + (choice < 230u ? 0u : choice));
        p[PT_WAVE_DATA_COUNT] = count;
        if (choice >= 200u) /* not what was announced */
            for (uint8_t k = 0; k < count; k++)
                put_u16(p + PT_WAVE_DATA_LEN + 2u * k, (uint16_t)(next(t) * 60u));
        (void)fake_command(PT_WAVE_DATA, p, (uint8_t)(PT_WAVE_DATA_LEN + 2u * count));
        break;
    }
    case 4:
        put_u32(p + PT_WAVE_COMMIT_COUNT, control.wave.received);
        put_u32(p + PT_WAVE_COMMIT_CRC32, control.wave.crc);
        (void)fake_command(PT_WAVE_COMMIT, p, PT_WAVE_COMMIT_LEN);
        break;
    case 5:
        put_u32(p, commands.nonce);
        (void)fake_command(PT_ARM, p, PT_ARM_LEN);
        break;
    case 6:
        (void)fake_command(PT_START, NULL, 0);
        break;
    case 7:
        put_u16(p, (uint16_t)(next16(t) % (PT_MAX_DECIMATION + 10u)));
        (void)fake_command(PT_STREAM, p, PT_STREAM_LEN);
        break;
    case 9: /* to an end of its range */
        p[PT_SET_PARAM_ID] = (uint8_t)(next(t) % PT_PARAM_COUNT);
        put_i32(p + PT_SET_PARAM_VALUE, choice & 64u ? commands_param_minimum(p[PT_SET_PARAM_ID])
                                                     : commands_param_maximum(p[PT_SET_PARAM_ID]));
        (void)fake_command(PT_SET_PARAM, p, PT_SET_PARAM_LEN);
        break;
    case 10:
        put_u16(p, (uint16_t)(next16(t) % 2100u));
        (void)fake_command(PT_COIL_HEAT, p, PT_COIL_HEAT_LEN);
        break;
    default:
        (void)(control.fault == PT_FAULT_NONE ? fake_beat() : fake_clear_fault());
        break;
    }
}

static void sequence(const uint8_t *bytes, size_t count)
{
    struct tape t = {bytes, count};
    uint8_t noise[256];
    fake_reset();
    fake.tx_space = 4096;
    latched_ticks = over_force = 0;
    fake_after_tick = check_tick;
    while (t.left > 0) {
        uint8_t what = next(&t);
        switch (what % 8u) {
        case 0: {
            uint16_t n = next(&t);
            for (uint16_t k = 0; k < n; k++)
                noise[k] = next(&t);
            fake_receive(noise, n);
            break;
        }
        case 1:
            wild_command(&t);
            break;
        case 2:
            fake_ticks(next(&t));
            break;
        case 3:
            fake_ticks_without_main(next(&t));
            break;
        case 4: /* the world: sensors, a deaf host, a missed tick; mostly it is well */
            if (next(&t) < 200u)
                what = 0;
            fake.force_force = what & 64u ? next16(&t) & 0xFFF : -1;
            fake.force_current = what & 128u ? next16(&t) & 0xFFF : -1;
            fake.tx_space = what & 32u ? next16(&t) % 4097u : 4096;
            uint8_t odd = next(&t);
            fake.overrun = odd == 7u;
            fake.comparator = odd == 8u;
            fake.stale = odd == 9u;
            fake.tick_lost = odd == 10u;
            fake.nest_set = odd == 11u;
            fake.nest_read = odd == 12u;
            break;
        default:
            sensible_command(&t);
            break;
        }
        check();
    }
}

#ifdef FUZZ_LIBFUZZER

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t count);
int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t count)
{
    sequence(bytes, count);
    return 0;
}

#else

static uint64_t state;
static uint32_t draw(uint32_t below)
{
    state = state * 6364136223846793005uLL + 1442695040888963407uLL;
    return (uint32_t)(((state >> 33) * below) >> 31);
}

/* One to four hurts: flip, drop, insert, repeat, cut off; returns the new length. */
static uint16_t damage(uint8_t *wire, uint16_t n, uint32_t hurts)
{
    for (uint32_t h = 0; h < hurts && n > 2; h++) {
        uint16_t at = (uint16_t)draw(n);
        switch (draw(5)) {
        case 0:
            wire[at] = (uint8_t)(wire[at] ^ (1u + draw(255)));
            break;
        case 1:
            memmove(wire + at, wire + at + 1, (size_t)(n - at - 1));
            n--;
            break;
        case 2:
            memmove(wire + at + 1, wire + at, (size_t)(n - at));
            wire[at] = (uint8_t)draw(256);
            n++;
            break;
        case 3: {
            uint16_t piece = (uint16_t)(1u + draw((uint32_t)(n - at)));
            memmove(wire + at + piece, wire + at, (size_t)(n - at));
            n = (uint16_t)(n + piece);
            break;
        }
        default:
            n = (uint16_t)(at + 1u);
            break;
        }
    }
    return n;
}

/* Bytes that a payload of this type must have, given its counted tail; 0xFF: no such type. */
static uint8_t exact_length(uint8_t type, const uint8_t *payload, uint8_t length)
{
    static const uint8_t rows[][3] = {
#define ROW(name, item) {PT_##name, PT_##name##_LEN, item},
        PT_COMMANDS(ROW)
        ROW(TELEMETRY, PT_TELEMETRY_ITEM)
        ROW(TELEMETRY_DUTY, PT_TELEMETRY_DUTY_ITEM)
#undef ROW
    };
    for (size_t k = 0; k < sizeof rows / sizeof rows[0]; k++) {
        if (rows[k][0] != type)
            continue;
        uint8_t fixed = rows[k][1];
        if (rows[k][2] == 0 || length < fixed)
            return fixed;
        return (uint8_t)(fixed + rows[k][2] * payload[fixed - 1u]);
    }
    return 0xFFu;
}

struct sent {
    uint8_t type;
    uint8_t seq;
    uint8_t length;
    const uint8_t *payload;
};

static bool is_sent(const struct sent *s, uint8_t type, uint8_t seq, const uint8_t *payload, uint8_t length)
{
    return type == s->type && seq == s->seq && length == s->length && memcmp(payload, s->payload, length) == 0;
}

/* What stands between two zeros is a whole frame of another content, and only the checksum can tell. */
static bool only_the_checksum_tells(const uint8_t *encoded, uint16_t n, const struct sent *s)
{
    uint8_t body[FRAME_BODY];
    uint16_t used = 0;
    for (uint16_t at = 0; at < n;) {
        uint8_t code = encoded[at++];
        if (at + code - 1u > n)
            return false;
        for (uint8_t k = 1; k < code; k++, at++) {
            if (used == FRAME_BODY)
                return false;
            body[used++] = encoded[at];
        }
        if (at < n && code != 0xFFu) {
            if (used == FRAME_BODY)
                return false;
            body[used++] = 0;
        }
    }
    if (used < 4u)
        return false;
    uint8_t length = (uint8_t)(used - 4u);
    return length == exact_length(body[0], body + 2, length) && !is_sent(s, body[0], body[1], body + 2, length);
}

struct verdict {
    uint32_t intact; /* came out as sent: the hurt was beside it */
    uint32_t shaped; /* another content in a sound shape: the checksum had to find out */
    uint32_t wrong;  /* and did not */
};

/* Frames of every kind with one to four hurts. */
static struct verdict frames(uint32_t count)
{
    struct verdict v = {0, 0, 0};
    static uint8_t wire[FRAME_MAX_ENCODED * 16u + 16u];
    uint8_t payload[PT_MAX_PAYLOAD];
    struct frame_decoder d;
    struct frame f;
    frame_decoder_init(&d);
    for (uint32_t k = 0; k < count; k++) {
        uint8_t type = (uint8_t)(draw(15) ? 1u + draw(14) : PT_TELEMETRY + draw(2));
        uint8_t seq = (uint8_t)draw(256);
        for (uint8_t j = 0; j < PT_MAX_PAYLOAD; j++)
            payload[j] = (uint8_t)(draw(3) ? draw(256) : 0u);
        payload[PT_WAVE_DATA_COUNT] = (uint8_t)(1u + draw(PT_WAVE_DATA_MAX_ITEMS));
        payload[PT_TELEMETRY_COUNT] =
            (uint8_t)(1u + draw(type == PT_TELEMETRY ? PT_TELEMETRY_MAX_ITEMS : PT_TELEMETRY_DUTY_MAX_ITEMS));
        uint8_t length = exact_length(type, payload, PT_MAX_PAYLOAD);
        uint16_t n = frame_encode(wire, type, seq, payload, length, draw(2) != 0);
        n = damage(wire, n, 1u + draw(4));
        wire[n++] = 0;
        struct sent s = {type, seq, length, payload};
        uint16_t from = 0;
        for (uint16_t j = 0; j < n; j++) {
            if (wire[j] == 0) {
                v.shaped += only_the_checksum_tells(wire + from, (uint16_t)(j - from), &s);
                from = (uint16_t)(j + 1u);
            }
            if (!frame_decode(&d, wire[j], &f) || f.length != exact_length(f.type, f.payload, f.length))
                continue;
            bool same = is_sent(&s, f.type, f.seq, f.payload, f.length);
            v.intact += same;
            v.wrong += !same;
        }
    }
    return v;
}

int main(int argc, char **argv)
{
    static uint8_t bytes[600];
    setvbuf(stdout, NULL, _IOLBF, 0); /* what is found is said before the end by abort() */
    if (argc != 4) {
        fprintf(stderr, "usage: fuzz SEED FRAMES SEQUENCES\n");
        return 2;
    }
    state = strtoull(argv[1], NULL, 10) * 0x9E3779B97F4A7C15uLL + 1u;
    uint32_t frame_count = (uint32_t)strtoul(argv[2], NULL, 10);
    uint32_t sequence_count = (uint32_t)strtoul(argv[3], NULL, 10);

    struct verdict v = frames(frame_count);
    printf("frames %u intact %u shaped %u wrong %u\n", frame_count, v.intact, v.shaped, v.wrong);
    /* A checksum of 16 bits lets one in 65536 of what is wholly scrambled through. */
    if (v.wrong > 2u * v.shaped / 65536u + 10u)
        return 1;

    uint32_t runs = 0;
    uint32_t faults = 0;
    for (uint32_t k = 0; k < sequence_count; k++) {
        size_t n = 1u + draw(sizeof bytes);
        for (size_t j = 0; j < n; j++)
            bytes[j] = (uint8_t)draw(256);
        sequence(bytes, n);
        runs += control.session != 0;
        faults += control.fault != PT_FAULT_NONE;
    }
    printf("sequences %u that ran %u that ended in a fault %u\n", sequence_count, runs, faults);
    return 0;
}

#endif
