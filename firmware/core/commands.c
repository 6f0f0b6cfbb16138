#include "commands.h"

#include "control.h"
#include "hal.h"
#include "units.h"

struct commands commands;

static const int32_t param_table[PT_PARAM_COUNT][3] = {
#define ROW(name, id, minimum, initial, maximum) [id] = {minimum, initial, maximum},
    PT_PARAMETERS(ROW)
#undef ROW
};

int32_t commands_param_minimum(uint8_t id)
{
    return param_table[id][0];
}

int32_t commands_param_maximum(uint8_t id)
{
    return param_table[id][2];
}

static void default_params(void)
{
    for (uint8_t id = 0; id < PT_PARAM_COUNT; id++)
        commands.param[id] = param_table[id][1];
}

void commands_init(void)
{
    commands.nonce = hal_boot_nonce();
    commands.beat = 0;
    commands.greeted = false;
    default_params();
}

/* A new host: nothing that an earlier one left running goes on, nothing that it set holds. */
void commands_greet(uint8_t major, uint8_t minor)
{
    control_stop();
    commands.greeted = major == PT_PROTOCOL_MAJOR;
    /* As much as both know; a build that says it is older does as an older one. */
    control.telemetry.with_duty = commands.greeted && minor >= PT_DUTY_SINCE_MINOR && PT_PROTOCOL_MINOR >= PT_DUTY_SINCE_MINOR;
    commands.beat = 0;
    default_params();
}

/* A wire that is stuck repeats what it heard: only what cannot be a repetition is a sign of life. */
void commands_beat(uint32_t counter)
{
    if (counter <= commands.beat)
        return;
    commands.beat = counter;
    safety_alive(&control.safety);
}

static uint32_t on_ticks_limit(void)
{
    return (uint32_t)commands.param[PT_PARAM_ON_TIME] * PT_TICK_RATE_HZ;
}

uint8_t commands_wave_begin(uint32_t total, uint16_t ticks_per_sample, uint32_t crc)
{
    if (total == 0 || ticks_per_sample == 0 || ticks_per_sample > PT_MAX_TICKS_PER_SAMPLE)
        return PT_NAK_CODE_RANGE;
    /* Too long for the on-time limit: refuse now, not in mid-play. An open-ended one ends at the limit. */
    if (total != PT_WAVE_OPEN && total - 1u > (on_ticks_limit() - CONTROL_RAMP_TICKS) / ticks_per_sample)
        return PT_NAK_CODE_RANGE;
    return control_wave_begin(total, ticks_per_sample, crc);
}

uint8_t commands_wave_data(uint32_t offset, const uint8_t *samples, uint8_t count)
{
    struct wave *w = &control.wave;
    if (!w->begun || control.state == PT_STATE_RAMPING || control.state == PT_STATE_FAULT)
        return PT_NAK_CODE_STATE;
    if (offset > w->received || w->total - offset < count)
        return PT_NAK_CODE_OFFSET;
    if (offset < w->received) /* a piece that is already there: fine, if it is wholly there */
        return w->received - offset >= count ? 0u : PT_NAK_CODE_OFFSET;
    if (count > wave_free(w))
        return PT_NAK_CODE_CREDIT;
    for (uint8_t k = 0; k < count; k++) {
        int16_t v = get_i16(samples + 2u * k);
        if (v < 0 || v > commands.param[PT_PARAM_CURRENT_LIMIT])
            return PT_NAK_CODE_RANGE;
    }
    wave_append(w, samples, count);
    return control_wave_publish(count);
}

uint8_t commands_arm(uint32_t nonce)
{
    if (!commands.greeted)
        return PT_NAK_CODE_VERSION;
    if (nonce != commands.nonce)
        return PT_NAK_CODE_NONCE;
    const int32_t *p = commands.param;
    const struct control_settings settings = {
        .limits = {.current_trip_100uA = (int16_t)p[PT_PARAM_CURRENT_TRIP],
                   .force_trip_mN = (int16_t)p[PT_PARAM_FORCE_TRIP],
                   .heartbeat_ticks = (uint16_t)(p[PT_PARAM_HEARTBEAT] * (int32_t)(PT_TICK_RATE_HZ / 1000u)),
                   .on_ticks = on_ticks_limit(),
                   .coil_ohms = p[PT_PARAM_FEED_RESISTANCE],
                   .coil_henries = p[PT_PARAM_FEED_INDUCTANCE]},
        .gains = {.kp = p[PT_PARAM_PID_KP],
                  .ki = p[PT_PARAM_PID_KI],
                  .feed_resistance = p[PT_PARAM_FEED_RESISTANCE],
                  .feed_inductance = p[PT_PARAM_FEED_INDUCTANCE],
                  .feed_offset = p[PT_PARAM_FEED_OFFSET]},
        .slew_100uA_per_tick = (int16_t)p[PT_PARAM_SLEW_LIMIT],
    };
    return control_arm(&settings);
}

uint8_t commands_stream(uint16_t decimation)
{
    if (control.state == PT_STATE_RUNNING)
        return PT_NAK_CODE_STATE;
    if (decimation == 0 || decimation > PT_MAX_DECIMATION)
        return PT_NAK_CODE_RANGE;
    control.telemetry.decimation = decimation; /* read by the tick in RUNNING only, which only this loop begins */
    return 0;
}

uint8_t commands_set_param(uint8_t id, int32_t value)
{
    if (id >= PT_PARAM_COUNT)
        return PT_NAK_CODE_PARAM;
    if (control.state != PT_STATE_IDLE && control.state != PT_STATE_FAULT)
        return PT_NAK_CODE_STATE;
    if (value < commands_param_minimum(id) || value > commands_param_maximum(id))
        return PT_NAK_CODE_RANGE;
    commands.param[id] = value;
    control_wave_forget(); /* a reference checked against the old limit must not be played under the new one */
    return 0;
}

uint8_t commands_coil_heat(uint16_t per_mille)
{
    return per_mille > HEAT_MOST_PER_MILLE ? PT_NAK_CODE_RANGE : control_coil_heat(per_mille);
}
