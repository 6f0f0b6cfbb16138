/* The integer PID on the simulated solenoid for 2 x 100 000 ticks: prints one hash of every PWM value, ADC
 * reading and reference. Any compiler, any optimisation, any machine must print the same, for the same
 * precision of the plant. */
#include "hal.h"
#include "pid.h"
#include "protocol.h"
#include "solenoid.h"
#include "units.h"
#include "wave.h"

#define TICKS 100000u

static struct solenoid_params params;
static struct solenoid plant;
static struct wave wave;

static const int32_t initial[PT_PARAM_COUNT] = {
#define ROW(name, id, minimum, start, maximum) [id] = start,
    PT_PARAMETERS(ROW)
#undef ROW
};

static uint32_t hash = 2166136261u;

static void mix(uint16_t v)
{
    hash = (hash ^ (v & 0xFFu)) * 16777619u;
    hash = (hash ^ (uint32_t)(v >> 8)) * 16777619u;
}

/* Full-range strokes, 1.25 a second, with a plateau now and then: samples at 1 kHz. */
static int16_t sample(uint32_t k)
{
    uint32_t phase = k % 800u;
    int32_t v = phase < 100u ? 150 * (int32_t)phase : 15000 - 15000 * (int32_t)(phase - 100u) / 700;
    return (int16_t)((k / 800u) % 3u == 2u && v > 9000 ? 9000 : v);
}

static void loop(void)
{
    struct pid pid;
    uint32_t total = TICKS / 10u + 1u;
    uint32_t sent = 0;
    pid.gains.kp = initial[PT_PARAM_PID_KP];
    pid.gains.ki = initial[PT_PARAM_PID_KI];
    pid.gains.feed_resistance = initial[PT_PARAM_FEED_RESISTANCE];
    pid.gains.feed_inductance = initial[PT_PARAM_FEED_INDUCTANCE];
    pid.gains.feed_offset = initial[PT_PARAM_FEED_OFFSET];
    pid_reset(&pid);
    solenoid_init(&plant, &params);
    wave_begin(&wave, total, 10, 0);
    for (uint32_t tick = 0; tick < TICKS; tick++) {
        for (; sent < total && wave_free(&wave) > 0; sent++) {
            uint8_t bytes[2];
            put_i16(bytes, sample(sent));
            wave_append(&wave, bytes, 1);
            wave_publish(&wave, 1);
        }
        if (tick == 0)
            wave_start(&wave);
        int16_t reference = 0;
        (void)wave_tick(&wave, &reference);
        uint16_t current = solenoid_adc_current(&plant);
        uint16_t duty = pid_step(&pid, reference, units_current(current), HAL_PWM_PERIOD);
        mix((uint16_t)reference);
        mix(current);
        mix(solenoid_adc_force(&plant));
        mix(duty);
        solenoid_step(&plant, duty, HAL_PWM_PERIOD);
    }
}

/* The device as built, and once more with what the room, the supply and another coil change. */
static uint32_t trace(void)
{
    solenoid_as_built(&params);
    loop();
    (void)solenoid_set(&params, "ambient", 20);
    (void)solenoid_set(&params, "supply-sag", 0.4);
    (void)solenoid_set(&params, "coil", 7);
    loop();
    return hash;
}

#if __STDC_HOSTED__
#include <stdio.h>

int main(void)
{
    printf("%08lx\n", (unsigned long)trace());
    return 0;
}
#else
#include "semihost.h"

int main(void)
{
    semihost_hex(trace());
    semihost_say("\n");
    semihost_exit(0);
}
#endif
