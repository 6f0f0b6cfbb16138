#include "app.h"

#include "hal.h"
#include "proto.h"
#include "units.h"

struct app app;

/* A reply must always find room beside the telemetry. */
#define REPLY_RESERVE FRAME_MAX_ENCODED

static const int32_t param_table[PT_PARAM_COUNT][3] = {
#define ROW(name, id, minimum, initial, maximum) [id] = {minimum, initial, maximum},
    PT_PARAMETERS(ROW)
#undef ROW
};

int32_t app_param_minimum(uint8_t id)
{
    return param_table[id][0];
}

int32_t app_param_maximum(uint8_t id)
{
    return param_table[id][2];
}

static void apply_params(void)
{
    app.safety.current_trip = (int16_t)app.param[PT_PARAM_CURRENT_TRIP];
    app.safety.force_trip = (int16_t)app.param[PT_PARAM_FORCE_TRIP];
    app.safety.heartbeat_ticks = (uint16_t)(app.param[PT_PARAM_HEARTBEAT] * (int32_t)(PT_TICK_RATE_HZ / 1000u));
    app.safety.on_ticks_limit = (uint32_t)app.param[PT_PARAM_ON_TIME] * PT_TICK_RATE_HZ;
    app.pid.kp = app.param[PT_PARAM_PID_KP];
    app.pid.ki = app.param[PT_PARAM_PID_KI];
    app.pid.feed_resistance = app.param[PT_PARAM_FEED_RESISTANCE];
    app.pid.feed_inductance = app.param[PT_PARAM_FEED_INDUCTANCE];
    app.pid.feed_offset = app.param[PT_PARAM_FEED_OFFSET];
}

static void default_params(void)
{
    for (uint8_t id = 0; id < PT_PARAM_COUNT; id++)
        app.param[id] = param_table[id][1];
}

void app_init(void)
{
    hal_pwm_kill();
    app.state = PT_STATE_IDLE;
    app.fault = PT_FAULT_NONE;
    app.worst = PT_FAULT_NONE;
    app.beat = 0;
    app.current = 0;
    app.force = 0;
    app.snapshot = (struct app_snapshot){0};
    app.tick = 0;
    app.session = 0;
    app.nonce = hal_boot_nonce();
    app.greeted = false;
    app.in_tick = false;
    app.ticked = false;
    app.reference = 0;
    app.duty = 0;
    app.reply_valid = false;
    default_params();
    wave_reset(&app.wave);
    pid_reset(&app.pid);
    safety_init(&app.safety, hal_kept(), hal_reset_cause() == PT_RESET_POWER);
    telemetry_init(&app.telemetry);
    frame_decoder_init(&app.decoder);
    apply_params();
}

/* --- the tick --------------------------------------------------------------------------------- */

static void output_off(void)
{
    hal_pwm_kill();
    app.duty = 0;
    app.reference = 0;
    pid_reset(&app.pid);
    /* Disarmed after each run: a new one needs a new upload and a new ARM. */
    app.wave.begun = false;
    app.wave.committed = false;
}

static uint8_t gravity(uint8_t fault)
{
    if (fault == PT_FAULT_NONE)
        return 0;
    if (fault == PT_FAULT_OUTPUT_NOT_OFF)
        return 3;
    return safety_is_soft(fault) ? 1 : 2;
}

static void latch(uint8_t fault, int16_t current, int16_t force)
{
    if (gravity(fault) > gravity(app.worst))
        app.worst = fault;
    if (app.fault != PT_FAULT_NONE)
        return;
    app.fault = fault;
    app.snapshot.tick = app.tick;
    app.snapshot.reference = app.reference;
    app.snapshot.current = current;
    app.snapshot.force = force;
    app.snapshot.duty = app.duty;
    app.snapshot.state = app.state;
}

/* The play is over, for whatever reason; what is left is to bring the current down. */
static void leave_running(void)
{
    telemetry_end(&app.telemetry);
    app.state = PT_STATE_RAMPING;
}

static void fail(uint8_t fault, int16_t current, int16_t force)
{
    latch(fault, current, force);
    if (app.state == PT_STATE_RUNNING)
        leave_running();
    if (safety_is_soft(fault) && app.state == PT_STATE_RAMPING)
        return;
    output_off();
    app.state = PT_STATE_FAULT;
}

/* What is asked of this tick, before the slew limit. */
static int16_t asked_reference(uint8_t *fault, bool *last)
{
    int16_t asked = 0;
    if (app.state == PT_STATE_RUNNING) {
        switch (wave_tick(&app.wave, &asked)) {
        case WAVE_LAST:
            *last = true;
            break;
        case WAVE_UNDERRUN:
            *fault = PT_FAULT_UNDERRUN;
            break;
        case WAVE_OK:
            break;
        }
        if (app.wave.corrupt)
            *fault = PT_FAULT_WAVE_CRC;
    } else if (app.state == PT_STATE_RAMPING && app.reference > APP_RAMP) {
        asked = (int16_t)(app.reference - APP_RAMP);
    }
    return asked;
}

static int16_t slew(int16_t from, int16_t to, bool *limited)
{
    int32_t limit = app.param[PT_PARAM_SLEW_LIMIT];
    int32_t change = (int32_t)to - from;
    if (change > limit || change < -limit) {
        *limited = true;
        change = change > 0 ? limit : -limit;
    }
    return (int16_t)(from + change);
}

static void control(void)
{
    struct hal_adc adc;
    hal_adc_read(&adc);
    uint8_t soft = PT_FAULT_NONE;
    bool last = false;
    bool limited = false;
    bool was_running = app.state == PT_STATE_RUNNING;
    int16_t asked = asked_reference(&soft, &last);
    bool driving = was_running || app.state == PT_STATE_RAMPING;
    app.reference = driving ? slew(app.reference, asked, &limited) : 0;

    struct safety_input in;
    in.reference = app.reference;
    in.current = units_current(adc.current);
    in.force = units_force(adc.force);
    app.current = in.current;
    app.force = in.force;
    in.current_counts = adc.current;
    in.force_counts = adc.force;
    in.duty = app.duty;
    in.full = HAL_PWM_PERIOD;
    in.driving = driving;
    in.armed = driving || app.state == PT_STATE_ARMED;
    in.awaited = was_running || app.state == PT_STATE_ARMED;

    if (was_running) {
        struct telemetry_sample s = {app.tick, asked, in.current, in.force};
        telemetry_tick(&app.telemetry, &s, limited);
    }
    uint8_t fault = safety_tick(&app.safety, &in);
    if (hal_tick_overrun() && in.armed && (fault == PT_FAULT_NONE || safety_is_soft(fault)))
        fault = PT_FAULT_TICK_OVERRUN;
    if (fault == PT_FAULT_NONE)
        fault = soft;
    if (fault != PT_FAULT_NONE && app.fault != fault)
        fail(fault, in.current, in.force);
    if (last && app.state == PT_STATE_RUNNING)
        leave_running();

    if (app.state == PT_STATE_RUNNING || app.state == PT_STATE_RAMPING) {
        app.duty = pid_step(&app.pid, app.reference, in.current, HAL_PWM_PERIOD);
        hal_pwm_set(app.duty);
        if (app.state == PT_STATE_RAMPING && app.reference == 0) {
            output_off();
            app.state = app.fault != PT_FAULT_NONE ? PT_STATE_FAULT : PT_STATE_IDLE;
        }
    } else {
        hal_pwm_kill();
        app.duty = 0;
    }
    if (was_running)
        app.tick++;
}

void app_tick(void)
{
    if (app.in_tick) { /* this interrupt broke into itself: the last one never ended */
        hal_pwm_kill();
        latch(PT_FAULT_TICK_OVERRUN, 0, 0);
        app.state = PT_STATE_FAULT;
        return;
    }
    app.in_tick = true;
    control();
    app.ticked = true;
    app.in_tick = false;
}

/* --- commands --------------------------------------------------------------------------------- */

static uint8_t must_be_idle(void)
{
    if (app.fault != PT_FAULT_NONE)
        return PT_NAK_CODE_FAULT;
    return app.state == PT_STATE_IDLE ? 0u : PT_NAK_CODE_STATE;
}

uint8_t app_wave_begin(uint32_t total, uint16_t ticks_per_sample, uint32_t crc)
{
    uint8_t refused = must_be_idle();
    if (refused)
        return refused;
    if (total == 0 || ticks_per_sample == 0 || ticks_per_sample > PT_MAX_TICKS_PER_SAMPLE)
        return PT_NAK_CODE_RANGE;
    /* Too long for the on-time limit: refuse now, not in mid-play. */
    uint32_t on_ticks = (uint32_t)app.param[PT_PARAM_ON_TIME] * PT_TICK_RATE_HZ;
    if (total - 1u > (on_ticks - APP_RAMP_TICKS) / ticks_per_sample)
        return PT_NAK_CODE_RANGE;
    wave_begin(&app.wave, total, ticks_per_sample, crc);
    return 0;
}

uint8_t app_wave_data(uint32_t offset, const uint8_t *samples, uint8_t count)
{
    struct wave *w = &app.wave;
    if (!w->begun || app.state == PT_STATE_RAMPING || app.state == PT_STATE_FAULT)
        return PT_NAK_CODE_STATE;
    if (offset > w->received || w->total - offset < count)
        return PT_NAK_CODE_OFFSET;
    if (offset < w->received) /* a piece that is already there: fine, if it is wholly there */
        return w->received - offset >= count ? 0u : PT_NAK_CODE_OFFSET;
    if (count > wave_free(w))
        return PT_NAK_CODE_CREDIT;
    for (uint8_t k = 0; k < count; k++) {
        int16_t v = get_i16(samples + 2u * k);
        if (v < 0 || v > app.param[PT_PARAM_CURRENT_LIMIT])
            return PT_NAK_CODE_RANGE;
    }
    wave_append(w, samples, count);
    hal_critical_enter();
    wave_publish(w, count);
    safety_alive(&app.safety);
    hal_critical_exit();
    return 0;
}

uint8_t app_wave_commit(uint32_t count, uint32_t crc)
{
    uint8_t refused = must_be_idle();
    if (refused)
        return refused;
    if (!app.wave.begun || app.wave.received == 0)
        return PT_NAK_CODE_STATE;
    if (count != app.wave.received || crc != app.wave.crc)
        return PT_NAK_CODE_CRC;
    app.wave.committed = true;
    return 0;
}

uint8_t app_arm(uint32_t nonce)
{
    /* A wire that repeats itself may bring ARM or START once more after another command: nothing to do. */
    if (app.state == PT_STATE_ARMED && nonce == app.nonce)
        return 0;
    uint8_t refused = must_be_idle();
    if (refused)
        return refused;
    if (!app.greeted)
        return PT_NAK_CODE_VERSION;
    if (nonce != app.nonce)
        return PT_NAK_CODE_NONCE;
    if (!app.wave.committed)
        return PT_NAK_CODE_STATE;
    hal_critical_enter();
    apply_params();
    safety_begin(&app.safety);
    pid_reset(&app.pid);
    app.state = PT_STATE_ARMED;
    hal_critical_exit();
    return 0;
}

uint8_t app_start(void)
{
    if (app.state == PT_STATE_RUNNING)
        return 0;
    if (app.state != PT_STATE_ARMED || !app.wave.committed)
        return PT_NAK_CODE_STATE;
    hal_critical_enter();
    app.session++;
    app.tick = 0;
    wave_start(&app.wave);
    telemetry_begin(&app.telemetry, app.session);
    safety_alive(&app.safety);
    app.state = PT_STATE_RUNNING;
    hal_critical_exit();
    return 0;
}

uint8_t app_stop(void)
{
    hal_critical_enter();
    if (app.state == PT_STATE_RUNNING) {
        leave_running();
    } else if (app.state == PT_STATE_ARMED) {
        output_off();
        app.state = PT_STATE_IDLE;
    } else if (app.state == PT_STATE_IDLE) {
        app.wave.begun = false;
        app.wave.committed = false;
    }
    hal_critical_exit();
    return 0;
}

uint8_t app_clear_fault(uint8_t fault, uint8_t worst)
{
    uint8_t refused = 0;
    hal_critical_enter();
    if (app.fault == PT_FAULT_NONE) {
        refused = 0; /* it is cleared already */
    } else if (app.state == PT_STATE_RAMPING) {
        refused = PT_NAK_CODE_STATE;
    } else if (fault != app.fault || worst != app.worst) {
        refused = PT_NAK_CODE_FAULT; /* not what the host has seen */
    } else {
        if (app.state == PT_STATE_FAULT)
            app.state = PT_STATE_IDLE;
        app.fault = PT_FAULT_NONE;
        app.worst = PT_FAULT_NONE;
        app.snapshot = (struct app_snapshot){0};
    }
    hal_critical_exit();
    return refused;
}

/* A wire that is stuck repeats what it heard: only what cannot be a repetition is a sign of life. */
void app_beat(uint32_t counter)
{
    if (counter <= app.beat)
        return;
    app.beat = counter;
    safety_alive(&app.safety);
}

uint8_t app_coil_heat(uint16_t per_mille)
{
    if (app.state != PT_STATE_IDLE && app.state != PT_STATE_FAULT)
        return PT_NAK_CODE_STATE;
    if (per_mille > HEAT_MOST_PER_MILLE)
        return PT_NAK_CODE_RANGE;
    hal_critical_enter();
    bool taken = heat_tell(&app.safety.heat, per_mille);
    hal_critical_exit();
    return taken ? 0u : PT_NAK_CODE_RANGE;
}

/* A new host: nothing that an earlier one left running goes on, nothing that it set holds. */
void app_greet(bool same_major)
{
    (void)app_stop();
    hal_critical_enter();
    app.greeted = same_major;
    app.beat = 0;
    default_params();
    hal_critical_exit();
}

uint8_t app_stream(uint16_t decimation)
{
    if (app.state == PT_STATE_RUNNING)
        return PT_NAK_CODE_STATE;
    if (decimation == 0 || decimation > PT_MAX_DECIMATION)
        return PT_NAK_CODE_RANGE;
    app.telemetry.decimation = decimation;
    return 0;
}

uint8_t app_set_param(uint8_t id, int32_t value)
{
    if (id >= PT_PARAM_COUNT)
        return PT_NAK_CODE_PARAM;
    if (app.state != PT_STATE_IDLE && app.state != PT_STATE_FAULT)
        return PT_NAK_CODE_STATE;
    if (value < app_param_minimum(id) || value > app_param_maximum(id))
        return PT_NAK_CODE_RANGE;
    hal_critical_enter();
    app.param[id] = value;
    /* A reference checked against the old limit must not be played under the new one. */
    app.wave.begun = false;
    app.wave.committed = false;
    hal_critical_exit();
    return 0;
}

/* --- the main loop ---------------------------------------------------------------------------- */

static void send_telemetry(void)
{
    uint8_t payload[PT_MAX_PAYLOAD];
    uint8_t out[FRAME_MAX_ENCODED];
    while (hal_uart_tx_space() >= FRAME_MAX_ENCODED + REPLY_RESERVE) {
        hal_critical_enter();
        uint32_t now = app.tick;
        uint32_t dropped = app.telemetry.dropped;
        hal_critical_exit();
        uint8_t length = telemetry_pack(&app.telemetry, now, dropped, payload);
        if (length == 0)
            return;
        uint16_t n = frame_encode(out, PT_TELEMETRY, 0, payload, length, hal_uart_tx_idle());
        hal_uart_tx(out, n);
    }
}

void app_poll(void)
{
    uint8_t byte;
    struct frame f;
    /* A bounded number of bytes: a babbling host must not keep telemetry and watchdog waiting. */
    for (uint16_t k = 0; k < 2u * FRAME_MAX_ENCODED && hal_uart_rx(&byte); k++)
        if (frame_decode(&app.decoder, byte, &f))
            proto_handle(&f);
    send_telemetry();
    /* Fed only if the tick has run since the last time: both contexts are alive. */
    if (app.ticked) {
        app.ticked = false;
        hal_watchdog_feed();
    }
}
