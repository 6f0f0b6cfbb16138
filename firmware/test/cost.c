/* What the control interrupt costs on the emulated Cortex-M4F: instructions of app_tick() in each state,
 * while a full-range pulse train is played with telemetry at 10 kHz, and the stack that tick and main loop need.
 *
 * The tick is called, not interrupted; run with -icount shift=10, where an instruction lasts 1024 ns, that
 * is 25.6 counts of the timer, so that each one is seen. */
#include "app.h"
#include "commands.h"
#include "control.h"
#include "board.h"
#include "semihost.h"
#include "units.h"

#define TICKS 30000u
#define NS_PER_CYCLE 40u
#define NS_PER_INSTRUCTION 1024u
#define STACK_BYTES 4096u
#define IN_USE_BYTES 128u /* by main itself while it paints */
#define PAINT 0xA5A5A5A5u

extern uint32_t stack_top[]; /* of the linker's script: an address, not an array */

static const char *const names[] = {"idle", "armed", "running", "ramping", "fault"};
static uint32_t count[5], most[5], total[5], world_most;
static uint32_t samples_sent;

/* Full strokes, four a second, at 1 kHz. */
static int16_t sample(uint32_t k)
{
    uint32_t phase = k % 250u;
    return (int16_t)(phase < 100u ? 150u * phase : 15000u - 100u * (phase - 100u));
}

static uint32_t instructions(uint32_t from, uint32_t to)
{
    return ((to - from) * NS_PER_CYCLE + NS_PER_INSTRUCTION / 2u) / NS_PER_INSTRUCTION;
}

static void feed(uint32_t samples)
{
    for (; samples_sent < samples && wave_free(&control.wave) > 0; samples_sent++) {
        uint8_t bytes[2];
        put_i16(bytes, sample(samples_sent));
        (void)commands_wave_data(samples_sent, bytes, 1);
    }
    safety_alive(&control.safety);
}

static void tick(uint32_t empty)
{
    uint8_t state = control.state;
    uint32_t before = board_cycles();
    app_tick();
    uint32_t after = board_cycles();
    board_world();
    uint32_t world = instructions(after, board_cycles()) - empty;
    uint32_t cost = instructions(before, after) - empty;
    count[state]++;
    total[state] += cost;
    if (cost > most[state])
        most[state] = cost;
    if (world > world_most)
        world_most = world;
}

static void say_line(const char *name, uint32_t mean, uint32_t maximum)
{
    semihost_say(name);
    semihost_say(" ");
    semihost_decimal(mean);
    semihost_say(" ");
    semihost_decimal(maximum);
    semihost_say("\n");
}

static uint32_t stack_used(uintptr_t bottom)
{
    const volatile uint32_t *p = (const volatile uint32_t *)bottom;
    while (*p == PAINT)
        p++;
    return (uint32_t)((uintptr_t)stack_top - (uintptr_t)p);
}

int main(void)
{
    uintptr_t bottom = (uintptr_t)stack_top - STACK_BYTES;
    for (uintptr_t p = bottom; p < (uintptr_t)stack_top - IN_USE_BYTES; p += 4u)
        *(volatile uint32_t *)p = PAINT;
    board_init();
    app_init();
    uint32_t before = board_cycles();
    uint32_t empty = instructions(before, board_cycles());

    uint32_t samples = TICKS / 10u;
    commands.greeted = true;
    (void)heat_tell(&control.safety.heat, 0);
    (void)commands_stream(1);
    (void)commands_wave_begin(samples, 10, 0);
    feed(samples);
    (void)control_wave_commit(control.wave.received, control.wave.crc);
    for (uint32_t k = 0; k < 100u; k++)
        tick(empty);
    (void)commands_arm(commands.nonce);
    for (uint32_t k = 0; k < 100u; k++)
        tick(empty);
    (void)control_start();
    while (control.state == PT_STATE_RUNNING || control.state == PT_STATE_RAMPING) {
        feed(samples - 1u); /* the last sample never comes: the play ends by an underrun and a ramp */
        tick(empty);
        app_poll();
        board_send();
    }
    for (uint32_t k = 0; k < 100u; k++)
        tick(empty);

    for (uint32_t k = 0; k < 5u; k++)
        if (count[k] > 0)
            say_line(names[k], total[k] / count[k], most[k]);
    say_line("world", 0, world_most);
    semihost_say("stack ");
    semihost_decimal(stack_used(bottom));
    semihost_say("\n");
    semihost_exit(0);
}
