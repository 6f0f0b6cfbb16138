/* A tick at every instruction of the main loop: while a command is handled the processor's trap flag stops after
 * each instruction, the process forks there, and the child lets a tick come in which something goes wrong (far too much
 * current), then goes on to the end. Whatever the place: the fault stays latched, the output is off, nothing can be armed.
 *
 * Linux on x86-64 only. Exit status 1: a place was found at which it has not. */
#define _GNU_SOURCE
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <ucontext.h>
#include <unistd.h>

#include "app.h"
#include "commands.h"
#include "control.h"
#include "fake_hal.h"
#include "hal.h"
#include "units.h"

#define TRAP_FLAG 0x100
#define SAMPLES 40u
#define SOON_TICKS 200u
#define WRONG_CURRENT 3400 /* counts: 1.66 A */

static uint32_t instructions;
static uint32_t ticks;
static uint32_t failures;
static volatile sig_atomic_t in_critical;
static volatile sig_atomic_t tick_waits;
static bool is_child;

/* --- the interrupt -------------------------------------------------------------------------------- */

/* As hardware: held off in a critical section, taken at its end. */
static void critical(bool enter)
{
    in_critical = enter;
    if (!enter && tick_waits) {
        tick_waits = 0;
        app_tick();
    }
}

static void trapped(int signal_number, siginfo_t *info, void *context)
{
    ucontext_t *c = context;
    (void)signal_number;
    (void)info;
    instructions++;
    ticks++;
    pid_t child = fork();
    if (child == 0) {
        is_child = true;
        c->uc_mcontext.gregs[REG_EFL] &= ~(greg_t)TRAP_FLAG;
        fake.force_current = WRONG_CURRENT;
        if (in_critical)
            tick_waits = 1;
        else
            app_tick();
        return; /* into the middle of the main loop */
    }
    int status = 0;
    if (child < 0 || waitpid(child, &status, 0) != child || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
        failures++;
}

static void set_trap(bool on)
{
    if (on)
        __asm__ volatile("pushfq; orq $0x100, (%%rsp); popfq" ::: "memory", "cc");
    else
        __asm__ volatile("pushfq; andq $~0x100, (%%rsp); popfq" ::: "memory", "cc");
}

/* --- what must hold -------------------------------------------------------------------------------- */

/* In the child, behind the command: the tick has found far too much current, whatever the state was. */
static int judge(void)
{
    for (uint32_t k = 0; k < SOON_TICKS; k++) {
        if (control.fault == PT_FAULT_NONE || safety_gravity(control.worst) <= SAFETY_RAMPS)
            return 2; /* wiped out by a command that was older than the fault */
        if (control.state != PT_STATE_FAULT || fake.pwm_enabled)
            return 3; /* latched, and pressed on */
        fake.force_current = -1;
        app_tick();
        app_poll();
    }
    /* Cleared by name, it still wants a new upload: nothing of the old one can be armed. */
    const struct control_settings settings = {.limits = {16500, 15000, 2000, 100000}, .slew_100uA_per_tick = 150};
    if (control_clear(control.fault, control.worst) != 0 || control_arm(&settings) == 0)
        return 4;
    return 0;
}

/* --- the commands ---------------------------------------------------------------------------------- */

static void ask(uint8_t type, const uint8_t *payload, uint8_t length)
{
    (void)fake_command(type, payload, length);
}

static void upload(void)
{
    uint8_t p[PT_MAX_PAYLOAD];
    uint8_t samples[2u * SAMPLES];
    put_u32(p + PT_HELLO_MAGIC, PT_MAGIC);
    p[PT_HELLO_MAJOR] = PT_PROTOCOL_MAJOR;
    p[PT_HELLO_MINOR] = PT_PROTOCOL_MINOR;
    ask(PT_HELLO, p, PT_HELLO_LEN);
    for (uint8_t k = 0; k < SAMPLES; k++)
        put_i16(samples + 2u * k, 5000);
    put_u32(p + PT_WAVE_BEGIN_TOTAL, SAMPLES);
    put_u16(p + PT_WAVE_BEGIN_TICKS_PER_SAMPLE, 1000);
    put_u32(p + PT_WAVE_BEGIN_CRC32, wave_crc32(0, samples, sizeof samples));
    ask(PT_WAVE_BEGIN, p, PT_WAVE_BEGIN_LEN);
    put_u32(p + PT_WAVE_DATA_OFFSET, 0);
    p[PT_WAVE_DATA_COUNT] = SAMPLES;
    memcpy(p + PT_WAVE_DATA_LEN, samples, sizeof samples);
    ask(PT_WAVE_DATA, p, (uint8_t)(PT_WAVE_DATA_LEN + sizeof samples));
}

static void commit(void)
{
    uint8_t p[PT_WAVE_COMMIT_LEN];
    put_u32(p + PT_WAVE_COMMIT_COUNT, SAMPLES);
    put_u32(p + PT_WAVE_COMMIT_CRC32, control.wave.crc);
    ask(PT_WAVE_COMMIT, p, sizeof p);
}

static void arm(void)
{
    uint8_t p[PT_ARM_LEN];
    put_u32(p, commands.nonce);
    ask(PT_ARM, p, sizeof p);
}

/* Brings the device to where the command makes sense: 0 uploaded, 1 committed, 2 armed, 3 running, 4 a soft fault. */
static void bring(uint8_t stage)
{
    fake_reset();
    upload();
    if (stage > 0)
        commit();
    if (stage > 1)
        arm();
    if (stage > 2) {
        ask(PT_START, NULL, 0);
        fake_ticks(50);
    }
    if (stage > 3)
        fake_ticks(4000); /* silence: HEARTBEAT, ramped down */
}

static void walk(const char *name, uint8_t stage, uint8_t type, const uint8_t *payload, uint8_t length)
{
    uint8_t wire[FRAME_MAX_ENCODED];
    uint8_t bytes[PT_MAX_PAYLOAD] = {0};
    bring(stage);
    if (length > 0)
        memcpy(bytes, payload, length);
    if (type == PT_ARM)
        put_u32(bytes, commands.nonce);
    if (type == PT_WAVE_COMMIT)
        put_u32(bytes + PT_WAVE_COMMIT_CRC32, control.wave.crc);
    fake_wire(wire, frame_encode(wire, type, 77, bytes, length, true));
    control.safety.not_off = SAFETY_OFF_TICKS - 1u; /* where nothing is driven the same current is as wrong */
    instructions = ticks = failures = 0;
    set_trap(true);
    app_poll();
    set_trap(false);
    if (is_child)
        _exit(judge());
    printf("%-12s %6u instructions %6u ticks %u failures\n", name, instructions, ticks, failures);
}

int main(void)
{
    static const uint8_t hello[PT_HELLO_LEN] = {0x31, 0x50, 0x54, 0x52, PT_PROTOCOL_MAJOR, 0};
    static const uint8_t committed[PT_WAVE_COMMIT_LEN] = {SAMPLES};
    static const uint8_t begun[PT_WAVE_BEGIN_LEN] = {10, 0, 0, 0, 10, 0};
    static const uint8_t data[PT_WAVE_DATA_LEN + 2u] = {SAMPLES, 0, 0, 0, 1, 0, 0};
    static const uint8_t cleared[PT_CLEAR_FAULT_LEN] = {PT_FAULT_HEARTBEAT, PT_FAULT_HEARTBEAT};
    static const uint8_t none[PT_ARM_LEN] = {0};
    static const struct {
        const char *name;
        uint8_t stage;
        uint8_t type;
        uint8_t length;
        const uint8_t *payload;
    } rows[] = {
        {"WAVE_BEGIN", 0, PT_WAVE_BEGIN, sizeof begun, begun},
        {"WAVE_DATA", 0, PT_WAVE_DATA, sizeof data, data},
        {"WAVE_COMMIT", 0, PT_WAVE_COMMIT, sizeof committed, committed},
        {"ARM", 1, PT_ARM, sizeof none, none},
        {"START", 2, PT_START, 0, none},
        {"STOP", 3, PT_STOP, 0, none},
        {"HELLO", 3, PT_HELLO, sizeof hello, hello},
        {"CLEAR_FAULT", 4, PT_CLEAR_FAULT, sizeof cleared, cleared},
    };
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_sigaction = trapped;
    action.sa_flags = SA_SIGINFO;
    if (sigaction(SIGTRAP, &action, NULL) != 0)
        return 2;
    setvbuf(stdout, NULL, _IONBF, 0); /* a child must not print it again */
    fake_on_critical = critical;
    uint32_t found = 0;
    for (size_t k = 0; k < sizeof rows / sizeof rows[0]; k++) {
        walk(rows[k].name, rows[k].stage, rows[k].type, rows[k].payload, rows[k].length);
        found += failures;
    }
    return found != 0;
}
