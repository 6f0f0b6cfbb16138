#include "link.h"

#include "commands.h"
#include "control.h"
#include "frame.h"
#include "hal.h"
#include "units.h"

/* A reply must always find room beside the telemetry. */
#define REPLY_RESERVE FRAME_MAX_ENCODED

/* Main only. */
static struct {
    struct frame_decoder decoder;
    /* The last answered command and its reply, replayed when the command comes again. */
    bool reply_valid;
    uint8_t reply_to_type;
    uint8_t reply_to_seq;
    uint16_t reply_to_crc;
    uint8_t reply_type;
    uint8_t reply_length;
    uint8_t reply[PT_MAX_PAYLOAD];
    uint8_t wire[FRAME_MAX_ENCODED]; /* what goes out next: not on the stack twice */
} link_state;

void link_init(void)
{
    frame_decoder_init(&link_state.decoder);
    link_state.reply_valid = false;
}

static void send_reply(uint8_t seq)
{
    uint8_t *out = link_state.wire;
    uint16_t n = frame_encode(out, link_state.reply_type, seq, link_state.reply, link_state.reply_length, hal_uart_tx_idle());
    /* No room although it is reserved: the host does not read. It will ask again. */
    if (hal_uart_tx_space() >= n)
        hal_uart_tx(out, n);
}

static void reply_ack(void)
{
    uint8_t *p = link_state.reply;
    link_state.reply_type = PT_ACK;
    link_state.reply_length = PT_ACK_LEN;
    hal_critical_enter();
    uint32_t tick = control.tick;
    uint32_t produced = control.telemetry.produced;
    hal_critical_exit();
    put_u16(p + PT_ACK_CREDIT, wave_free(&control.wave));
    p[PT_ACK_STATE] = control.state;
    p[PT_ACK_FAULT] = control.fault;
    p[PT_ACK_SESSION] = control.session;
    put_u32(p + PT_ACK_TICK, tick);
    put_u32(p + PT_ACK_PRODUCED, produced);
}

static void reply_nak(uint8_t command, uint8_t code)
{
    link_state.reply_type = PT_NAK;
    link_state.reply_length = PT_NAK_LEN;
    link_state.reply[PT_NAK_CODE] = code;
    link_state.reply[PT_NAK_COMMAND] = command;
    link_state.reply[PT_NAK_STATE] = control.state;
    link_state.reply[PT_NAK_FAULT] = control.fault;
}

static void reply_hello(void)
{
    uint8_t *p = link_state.reply;
    link_state.reply_type = PT_HELLO_REPLY;
    link_state.reply_length = PT_HELLO_REPLY_LEN;
    put_u32(p + PT_HELLO_REPLY_MAGIC, PT_MAGIC);
    p[PT_HELLO_REPLY_MAJOR] = PT_PROTOCOL_MAJOR;
    p[PT_HELLO_REPLY_MINOR] = PT_PROTOCOL_MINOR;
    p[PT_HELLO_REPLY_FIRMWARE_MAJOR] = PT_FIRMWARE_MAJOR;
    p[PT_HELLO_REPLY_FIRMWARE_MINOR] = PT_FIRMWARE_MINOR;
    p[PT_HELLO_REPLY_FIRMWARE_PATCH] = PT_FIRMWARE_PATCH;
    put_u32(p + PT_HELLO_REPLY_BUILD_HASH, hal_build_hash());
    put_u32(p + PT_HELLO_REPLY_CAPABILITIES, 0);
    put_u16(p + PT_HELLO_REPLY_RX_WINDOW, FRAME_MAX_ENCODED);
    put_u32(p + PT_HELLO_REPLY_TICK_RATE_HZ, PT_TICK_RATE_HZ);
    put_u16(p + PT_HELLO_REPLY_WAVE_BUFFER, PT_WAVE_BUFFER_SAMPLES);
    put_i16(p + PT_HELLO_REPLY_CURRENT_LIMIT, (int16_t)commands.param[PT_PARAM_CURRENT_LIMIT]);
    put_i16(p + PT_HELLO_REPLY_CURRENT_TRIP, (int16_t)commands.param[PT_PARAM_CURRENT_TRIP]);
    put_i16(p + PT_HELLO_REPLY_FORCE_TRIP, (int16_t)commands.param[PT_PARAM_FORCE_TRIP]);
    put_u16(p + PT_HELLO_REPLY_SLEW_LIMIT, (uint16_t)commands.param[PT_PARAM_SLEW_LIMIT]);
    put_u16(p + PT_HELLO_REPLY_ON_TIME_S, (uint16_t)commands.param[PT_PARAM_ON_TIME]);
    put_u16(p + PT_HELLO_REPLY_HEARTBEAT_MS, (uint16_t)commands.param[PT_PARAM_HEARTBEAT]);
    p[PT_HELLO_REPLY_RESET_CAUSE] = hal_reset_cause();
    put_u32(p + PT_HELLO_REPLY_BOOT_NONCE, commands.nonce);
    const char *serial = hal_serial();
    for (uint8_t k = 0; k < 16u; k++) {
        p[PT_HELLO_REPLY_SERIAL + k] = (uint8_t)*serial;
        if (*serial != '\0')
            serial++;
    }
}

static void reply_status(void)
{
    uint8_t *p = link_state.reply;
    link_state.reply_type = PT_STATUS_REPLY;
    link_state.reply_length = PT_STATUS_REPLY_LEN;
    hal_critical_enter();
    p[PT_STATUS_REPLY_STATE] = control.state;
    p[PT_STATUS_REPLY_FAULT] = control.fault;
    p[PT_STATUS_REPLY_SESSION] = control.session;
    put_u32(p + PT_STATUS_REPLY_TICK, control.tick);
    put_u32(p + PT_STATUS_REPLY_PRODUCED, control.telemetry.produced);
    put_u32(p + PT_STATUS_REPLY_DROPPED, control.telemetry.dropped);
    put_u32(p + PT_STATUS_REPLY_FAULT_TICK, control.snapshot.tick);
    put_i16(p + PT_STATUS_REPLY_FAULT_REFERENCE, control.snapshot.reference_100uA);
    put_i16(p + PT_STATUS_REPLY_FAULT_CURRENT, control.snapshot.current_100uA);
    put_i16(p + PT_STATUS_REPLY_FAULT_FORCE, control.snapshot.force_mN);
    put_u16(p + PT_STATUS_REPLY_FAULT_DUTY, control.snapshot.duty_counts);
    p[PT_STATUS_REPLY_FAULT_STATE] = control.snapshot.state;
    p[PT_STATUS_REPLY_WORST] = control.worst;
    p[PT_STATUS_REPLY_FLAGS] =
        (uint8_t)((control.worst == PT_FAULT_OUTPUT_NOT_OFF ? PT_STATUS_OUTPUT_NOT_OFF : 0u) |
                  (heat_is_assumed(&control.safety.heat) ? PT_STATUS_HEAT_ASSUMED : 0u));
    put_i16(p + PT_STATUS_REPLY_CURRENT, control.now.current_100uA);
    put_i16(p + PT_STATUS_REPLY_FORCE, control.now.force_mN);
    put_u16(p + PT_STATUS_REPLY_HEAT, heat_per_mille(&control.safety.heat));
    hal_critical_exit();
    p[PT_STATUS_REPLY_RESET_CAUSE] = hal_reset_cause();
    put_u32(p + PT_STATUS_REPLY_BOOT_NONCE, commands.nonce);
}

static void reply_param(uint8_t id)
{
    link_state.reply_type = PT_PARAM_REPLY;
    link_state.reply_length = PT_PARAM_REPLY_LEN;
    link_state.reply[PT_PARAM_REPLY_ID] = id;
    put_i32(link_state.reply + PT_PARAM_REPLY_VALUE, commands.param[id]);
    put_i32(link_state.reply + PT_PARAM_REPLY_MINIMUM, commands_param_minimum(id));
    put_i32(link_state.reply + PT_PARAM_REPLY_MAXIMUM, commands_param_maximum(id));
}

/* 0: the length is exactly that of the type; else why the command is refused. */
static uint8_t check_length(const struct frame *f)
{
    uint8_t fixed;
    uint8_t item;
    switch (f->type) {
#define CASE(name, tail)          \
    case PT_##name:               \
        fixed = PT_##name##_LEN;  \
        item = tail;              \
        break;
        PT_COMMANDS(CASE)
#undef CASE
    default:
        return PT_NAK_CODE_UNKNOWN;
    }
    if (f->length < fixed)
        return PT_NAK_CODE_LENGTH;
    uint16_t tail = item ? (uint16_t)(item * f->payload[fixed - 1u]) : 0u;
    if (f->length != fixed + tail || (item && tail == 0))
        return PT_NAK_CODE_LENGTH;
    return 0;
}

static uint8_t hello(const uint8_t *p)
{
    if (get_u32(p + PT_HELLO_MAGIC) != PT_MAGIC)
        return PT_NAK_CODE_VERSION;
    /* Another major version still gets its answer, so that it can name both sides. */
    commands_greet(p[PT_HELLO_MAJOR], p[PT_HELLO_MINOR]);
    reply_hello();
    return 0;
}

static uint8_t param(const struct frame *f)
{
    uint8_t id = f->payload[0];
    if (id >= PT_PARAM_COUNT)
        return PT_NAK_CODE_PARAM;
    if (f->type == PT_SET_PARAM) {
        uint8_t refused = commands_set_param(id, get_i32(f->payload + PT_SET_PARAM_VALUE));
        if (refused)
            return refused;
    }
    reply_param(id);
    return 0;
}

/* Does what is asked and leaves the reply in link_state; returns a NAK code or 0. */
static uint8_t execute(const struct frame *f)
{
    const uint8_t *p = f->payload;
    uint8_t refused = 0;
    switch (f->type) {
    case PT_HELLO:
        return hello(p);
    case PT_STATUS:
        reply_status();
        return 0;
    case PT_GET_PARAM:
    case PT_SET_PARAM:
        return param(f);
    case PT_WAVE_BEGIN:
        refused = commands_wave_begin(get_u32(p + PT_WAVE_BEGIN_TOTAL), get_u16(p + PT_WAVE_BEGIN_TICKS_PER_SAMPLE),
                                 get_u32(p + PT_WAVE_BEGIN_CRC32));
        break;
    case PT_WAVE_DATA:
        refused = commands_wave_data(get_u32(p + PT_WAVE_DATA_OFFSET), p + PT_WAVE_DATA_LEN, p[PT_WAVE_DATA_COUNT]);
        break;
    case PT_WAVE_COMMIT:
        refused = control_wave_commit(get_u32(p + PT_WAVE_COMMIT_COUNT), get_u32(p + PT_WAVE_COMMIT_CRC32));
        break;
    case PT_WAVE_CHECK:
        refused = control_wave_check(get_u32(p + PT_WAVE_CHECK_COUNT), get_u32(p + PT_WAVE_CHECK_CRC32),
                                     p[PT_WAVE_CHECK_END] != 0);
        break;
    case PT_ARM:
        refused = commands_arm(get_u32(p + PT_ARM_NONCE));
        break;
    case PT_START:
        refused = control_start();
        break;
    case PT_STOP:
        control_stop();
        break;
    case PT_CLEAR_FAULT:
        refused = control_clear(p[PT_CLEAR_FAULT_FAULT], p[PT_CLEAR_FAULT_WORST]);
        break;
    case PT_COIL_HEAT:
        refused = commands_coil_heat(get_u16(p + PT_COIL_HEAT_HEAT));
        break;
    case PT_HEARTBEAT:
        commands_beat(get_u32(p + PT_HEARTBEAT_COUNTER));
        break;
    case PT_STREAM:
        refused = commands_stream(get_u16(p + PT_STREAM_DECIMATION));
        break;
    default: /* check_length() knows no other */
        break;
    }
    if (!refused)
        reply_ack();
    return refused;
}

static void handle(const struct frame *f)
{
    uint8_t refused = check_length(f);
    uint16_t crc = frame_crc16(f->payload, f->length);
    bool again = link_state.reply_valid && f->type == link_state.reply_to_type && f->seq == link_state.reply_to_seq &&
                 crc == link_state.reply_to_crc && f->type != PT_HELLO;
    if (!again) {
        if (!refused)
            refused = execute(f);
        if (refused)
            reply_nak(f->type, refused);
        link_state.reply_valid = true;
        link_state.reply_to_type = f->type;
        link_state.reply_to_seq = f->seq;
        link_state.reply_to_crc = crc;
    }
    send_reply(f->seq);
}

static void send_telemetry(void)
{
    uint8_t payload[PT_MAX_PAYLOAD];
    uint8_t *out = link_state.wire;
    while (hal_uart_tx_space() >= FRAME_MAX_ENCODED + REPLY_RESERVE) {
        hal_critical_enter();
        uint32_t now = control.tick;
        uint32_t dropped = control.telemetry.dropped;
        hal_critical_exit();
        uint8_t length = telemetry_pack(&control.telemetry, now, dropped, payload);
        if (length == 0)
            return;
        uint16_t n = frame_encode(out, control.telemetry.with_duty ? PT_TELEMETRY_DUTY : PT_TELEMETRY, 0, payload, length, hal_uart_tx_idle());
        hal_uart_tx(out, n);
    }
}

void link_poll(void)
{
    uint8_t byte;
    struct frame f;
    /* A bounded number of bytes: a babbling host must not keep telemetry and watchdog waiting. */
    for (uint16_t k = 0; k < 2u * FRAME_MAX_ENCODED && hal_uart_rx(&byte); k++)
        if (frame_decode(&link_state.decoder, byte, &f))
            handle(&f);
    send_telemetry();
}
