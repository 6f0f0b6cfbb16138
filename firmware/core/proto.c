#include "proto.h"

#include "app.h"
#include "hal.h"
#include "units.h"

static void send_reply(uint8_t seq)
{
    uint8_t out[FRAME_MAX_ENCODED];
    uint16_t n = frame_encode(out, app.reply_type, seq, app.reply, app.reply_length, hal_uart_tx_idle());
    /* No room although it is reserved: the host does not read. It will ask again. */
    if (hal_uart_tx_space() >= n)
        hal_uart_tx(out, n);
}

static void reply_ack(void)
{
    uint8_t *p = app.reply;
    app.reply_type = PT_ACK;
    app.reply_length = PT_ACK_LEN;
    hal_critical_enter();
    uint32_t tick = app.tick;
    uint32_t produced = app.telemetry.produced;
    hal_critical_exit();
    put_u16(p + PT_ACK_CREDIT, wave_free(&app.wave));
    p[PT_ACK_STATE] = app.state;
    p[PT_ACK_FAULT] = app.fault;
    p[PT_ACK_SESSION] = app.session;
    put_u32(p + PT_ACK_TICK, tick);
    put_u32(p + PT_ACK_PRODUCED, produced);
}

static void reply_nak(uint8_t command, uint8_t code)
{
    app.reply_type = PT_NAK;
    app.reply_length = PT_NAK_LEN;
    app.reply[PT_NAK_CODE] = code;
    app.reply[PT_NAK_COMMAND] = command;
    app.reply[PT_NAK_STATE] = app.state;
    app.reply[PT_NAK_FAULT] = app.fault;
}

static void reply_hello(void)
{
    uint8_t *p = app.reply;
    app.reply_type = PT_HELLO_REPLY;
    app.reply_length = PT_HELLO_REPLY_LEN;
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
    put_i16(p + PT_HELLO_REPLY_CURRENT_LIMIT, (int16_t)app.param[PT_PARAM_CURRENT_LIMIT]);
    put_i16(p + PT_HELLO_REPLY_CURRENT_TRIP, (int16_t)app.param[PT_PARAM_CURRENT_TRIP]);
    put_i16(p + PT_HELLO_REPLY_FORCE_TRIP, (int16_t)app.param[PT_PARAM_FORCE_TRIP]);
    put_u16(p + PT_HELLO_REPLY_SLEW_LIMIT, (uint16_t)app.param[PT_PARAM_SLEW_LIMIT]);
    put_u16(p + PT_HELLO_REPLY_ON_TIME_S, (uint16_t)app.param[PT_PARAM_ON_TIME]);
    put_u16(p + PT_HELLO_REPLY_HEARTBEAT_MS, (uint16_t)app.param[PT_PARAM_HEARTBEAT]);
    p[PT_HELLO_REPLY_RESET_CAUSE] = hal_reset_cause();
    put_u32(p + PT_HELLO_REPLY_BOOT_NONCE, app.nonce);
    const char *serial = hal_serial();
    for (uint8_t k = 0; k < 16u; k++) {
        p[PT_HELLO_REPLY_SERIAL + k] = (uint8_t)*serial;
        if (*serial != '\0')
            serial++;
    }
}

static void reply_status(void)
{
    uint8_t *p = app.reply;
    app.reply_type = PT_STATUS_REPLY;
    app.reply_length = PT_STATUS_REPLY_LEN;
    hal_critical_enter();
    p[PT_STATUS_REPLY_STATE] = app.state;
    p[PT_STATUS_REPLY_FAULT] = app.fault;
    p[PT_STATUS_REPLY_SESSION] = app.session;
    put_u32(p + PT_STATUS_REPLY_TICK, app.tick);
    put_u32(p + PT_STATUS_REPLY_PRODUCED, app.telemetry.produced);
    put_u32(p + PT_STATUS_REPLY_DROPPED, app.telemetry.dropped);
    put_u32(p + PT_STATUS_REPLY_FAULT_TICK, app.snapshot.tick);
    put_i16(p + PT_STATUS_REPLY_FAULT_REFERENCE, app.snapshot.reference);
    put_i16(p + PT_STATUS_REPLY_FAULT_CURRENT, app.snapshot.current);
    put_i16(p + PT_STATUS_REPLY_FAULT_FORCE, app.snapshot.force);
    put_u16(p + PT_STATUS_REPLY_FAULT_DUTY, app.snapshot.duty);
    p[PT_STATUS_REPLY_FAULT_STATE] = app.snapshot.state;
    p[PT_STATUS_REPLY_WORST] = app.worst;
    p[PT_STATUS_REPLY_FLAGS] =
        (uint8_t)((app.worst == PT_FAULT_OUTPUT_NOT_OFF ? PT_STATUS_OUTPUT_NOT_OFF : 0u) |
                  (heat_is_assumed(&app.safety.heat) ? PT_STATUS_HEAT_ASSUMED : 0u));
    put_i16(p + PT_STATUS_REPLY_CURRENT, app.current);
    put_i16(p + PT_STATUS_REPLY_FORCE, app.force);
    put_u16(p + PT_STATUS_REPLY_HEAT, heat_per_mille(&app.safety.heat));
    hal_critical_exit();
    p[PT_STATUS_REPLY_RESET_CAUSE] = hal_reset_cause();
    put_u32(p + PT_STATUS_REPLY_BOOT_NONCE, app.nonce);
}

static void reply_param(uint8_t id)
{
    app.reply_type = PT_PARAM_REPLY;
    app.reply_length = PT_PARAM_REPLY_LEN;
    app.reply[PT_PARAM_REPLY_ID] = id;
    put_i32(app.reply + PT_PARAM_REPLY_VALUE, app.param[id]);
    put_i32(app.reply + PT_PARAM_REPLY_MINIMUM, app_param_minimum(id));
    put_i32(app.reply + PT_PARAM_REPLY_MAXIMUM, app_param_maximum(id));
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
    app_greet(p[PT_HELLO_MAJOR] == PT_PROTOCOL_MAJOR);
    reply_hello();
    return 0;
}

static uint8_t param(const struct frame *f)
{
    uint8_t id = f->payload[0];
    if (id >= PT_PARAM_COUNT)
        return PT_NAK_CODE_PARAM;
    if (f->type == PT_SET_PARAM) {
        uint8_t refused = app_set_param(id, get_i32(f->payload + PT_SET_PARAM_VALUE));
        if (refused)
            return refused;
    }
    reply_param(id);
    return 0;
}

/* Does what is asked and leaves the reply in app.reply; returns a NAK code or 0. */
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
        refused = app_wave_begin(get_u32(p + PT_WAVE_BEGIN_TOTAL), get_u16(p + PT_WAVE_BEGIN_TICKS_PER_SAMPLE),
                                 get_u32(p + PT_WAVE_BEGIN_CRC32));
        break;
    case PT_WAVE_DATA:
        refused = app_wave_data(get_u32(p + PT_WAVE_DATA_OFFSET), p + PT_WAVE_DATA_LEN, p[PT_WAVE_DATA_COUNT]);
        break;
    case PT_WAVE_COMMIT:
        refused = app_wave_commit(get_u32(p + PT_WAVE_COMMIT_COUNT), get_u32(p + PT_WAVE_COMMIT_CRC32));
        break;
    case PT_ARM:
        refused = app_arm(get_u32(p + PT_ARM_NONCE));
        break;
    case PT_START:
        refused = app_start();
        break;
    case PT_STOP:
        refused = app_stop();
        break;
    case PT_CLEAR_FAULT:
        refused = app_clear_fault(p[PT_CLEAR_FAULT_FAULT], p[PT_CLEAR_FAULT_WORST]);
        break;
    case PT_COIL_HEAT:
        refused = app_coil_heat(get_u16(p + PT_COIL_HEAT_HEAT));
        break;
    case PT_HEARTBEAT:
        app_beat(get_u32(p + PT_HEARTBEAT_COUNTER));
        break;
    case PT_STREAM:
        refused = app_stream(get_u16(p + PT_STREAM_DECIMATION));
        break;
    default: /* check_length() knows no other */
        break;
    }
    if (!refused)
        reply_ack();
    return refused;
}

void proto_handle(const struct frame *f)
{
    uint8_t refused = check_length(f);
    uint16_t crc = frame_crc16(f->payload, f->length);
    bool again = app.reply_valid && f->type == app.reply_to_type && f->seq == app.reply_to_seq &&
                 crc == app.reply_to_crc && f->type != PT_HELLO;
    if (!again) {
        if (!refused)
            refused = execute(f);
        if (refused)
            reply_nak(f->type, refused);
        app.reply_valid = true;
        app.reply_to_type = f->type;
        app.reply_to_seq = f->seq;
        app.reply_to_crc = crc;
    }
    send_reply(f->seq);
}
