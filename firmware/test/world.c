#include "world.h"

#include "app.h"
#include "commands.h"
#include "control.h"
#include "port.h"
#include "units.h"

#define LOOK_TICKS 10u
#define BEAT_TICKS 400u

static world_signal signal;
static uint32_t samples;
static uint32_t sent;
static uint32_t beats;
static uint32_t looks;

static void feed(void)
{
    uint8_t bytes[2];
    while (sent < samples && wave_free(&control.wave) > 0) {
        put_i16(bytes, signal(sent));
        if (commands_wave_data(sent, bytes, 1) != 0)
            return;
        sent++;
    }
}

static uint32_t crc_of_all(void)
{
    uint32_t crc = 0;
    uint8_t bytes[2];
    for (uint32_t k = 0; k < samples; k++) {
        put_i16(bytes, signal(k));
        crc = wave_crc32(crc, bytes, 2);
    }
    return crc;
}

bool world_start(const struct solenoid_params *p, int32_t force_trip_mN, world_signal chosen, uint32_t count)
{
    signal = chosen;
    samples = count;
    sent = 0;
    beats = 0;
    looks = 0;
    board_init(p, PT_RESET_POWER);
    commands_greet(PT_PROTOCOL_MAJOR, PT_PROTOCOL_MINOR);
    return control_coil_heat(0) == 0 && commands_set_param(PT_PARAM_FORCE_TRIP, force_trip_mN) == 0 &&
           commands_wave_begin(count, 10, crc_of_all()) == 0 &&
           (feed(), control_wave_commit(sent, control.wave.crc) == 0) && commands_arm(commands.nonce) == 0 &&
           control_start() == 0;
}

/* The host and the main loop, now and then. */
static void look(void)
{
    int32_t count;
    if (!board_main_loop_runs())
        return;
    if (control.state == PT_STATE_RUNNING)
        feed();
    if (looks++ % (BEAT_TICKS / LOOK_TICKS) == 0)
        commands_beat(++beats);
    app_poll();
    while ((void)board_to_send(&count), count > 0)
        board_sent(count);
}

void world_tick(void)
{
    if (board_ticks() % LOOK_TICKS == 0)
        look();
    board_tick();
}

bool world_drives(void)
{
    return control.state == PT_STATE_RUNNING || control.state == PT_STATE_RAMPING;
}

double world_force_N(void)
{
    return (double)board_world()->force;
}

double world_current_A(void)
{
    return (double)board_world()->current;
}
