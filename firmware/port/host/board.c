/* The HAL of the host port: the simulated solenoid behind ADC and PWM, two rings behind the UART, a
 * watchdog that really resets, and faults that a test or a sceptic can provoke. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "app.h"
#include "hal.h"
#include "port.h"

#define RING 4096u /* power of two */
#define WATCHDOG_TICKS 2560u

#ifndef PT_BUILD_HASH
#define PT_BUILD_HASH 0u
#endif

struct ring {
    uint8_t bytes[RING];
    uint32_t head;
    uint32_t tail;
};

static struct solenoid plant;
static struct ring rx;
static struct ring tx;
static uint16_t duty;
static uint8_t cause;
static uint32_t nonce;
static uint64_t ticks;
static uint64_t fed_at;

/* --- provoked faults -------------------------------------------------------------------------- */

enum broken {
    CURRENT_RAIL, CURRENT_ZERO, CURRENT_FROZEN, FORCE_HIGH, FORCE_RAIL, FORCE_ZERO, FORCE_FROZEN,
    TICK_OVERRUN, RESET, HANG, BREAKS
};
static const char *const break_names[BREAKS] = {
    "current-rail", "current-zero", "current-frozen", "force-high", "force-rail", "force-zero",
    "force-frozen", "tick-overrun", "reset", "hang",
};
static uint32_t break_tick[BREAKS]; /* tick of the session at which it sets in, plus 1; 0: never */
static struct hal_adc frozen;
static bool overrun_pending;
static bool hanging;

bool board_break(const char *what_at)
{
    const char *at = strchr(what_at, '@');
    size_t length = at != NULL ? (size_t)(at - what_at) : strlen(what_at);
    double seconds = 0.0;
    if (at != NULL) {
        char *end = NULL;
        seconds = strtod(at + 1, &end);
        if (end == at + 1 || *end != '\0' || !(seconds >= 0.0 && seconds < 1e5))
            return false;
    }
    for (int k = 0; k < BREAKS; k++) {
        if (strlen(break_names[k]) == length && strncmp(break_names[k], what_at, length) == 0) {
            break_tick[k] = (uint32_t)(seconds * (double)PT_TICK_RATE_HZ) + 1u;
            return true;
        }
    }
    return false;
}

void board_list_breaks(void)
{
    for (int k = 0; k < BREAKS; k++)
        printf("%s\n", break_names[k]);
}

static bool is_broken(enum broken what)
{
    return break_tick[what] != 0 && app.state == PT_STATE_RUNNING && app.tick + 1u >= break_tick[what];
}

static bool breaks_now(enum broken what)
{
    bool now = is_broken(what);
    if (now)
        break_tick[what] = 0;
    return now;
}

bool board_main_loop_runs(void)
{
    if (breaks_now(HANG))
        hanging = true;
    return !hanging;
}

bool board_hangs(void)
{
    return hanging;
}

/* --- power and time --------------------------------------------------------------------------- */

static void start_firmware(uint8_t reset_cause)
{
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    cause = reset_cause;
    nonce = ((uint32_t)t.tv_nsec * 2654435761u) ^ (uint32_t)t.tv_sec ^ ((uint32_t)getpid() << 16) ^ (nonce + 1u);
    hanging = false;
    overrun_pending = false;
    fed_at = ticks;
    rx.head = rx.tail = 0;
    tx.head = tx.tail = 0;
    app_init();
}

void board_init(const struct solenoid_params *p, uint8_t reset_cause)
{
    solenoid_init(&plant, p);
    frozen.current = solenoid_adc_current(&plant);
    frozen.force = solenoid_adc_force(&plant);
    start_firmware(reset_cause);
}

uint64_t board_ticks(void)
{
    return ticks;
}

void board_tick(void)
{
    if (breaks_now(RESET))
        start_firmware(PT_RESET_EXTERNAL);
    if (breaks_now(TICK_OVERRUN))
        overrun_pending = true;
    if (!is_broken(CURRENT_FROZEN))
        frozen.current = solenoid_adc_current(&plant);
    if (!is_broken(FORCE_FROZEN))
        frozen.force = solenoid_adc_force(&plant);
    app_tick();
    solenoid_step(&plant, duty, HAL_PWM_PERIOD);
    ticks++;
    if (ticks - fed_at > WATCHDOG_TICKS)
        start_firmware(PT_RESET_WATCHDOG);
}

/* --- the HAL ---------------------------------------------------------------------------------- */

void hal_adc_read(struct hal_adc *out)
{
    *out = frozen;
    if (is_broken(CURRENT_RAIL))
        out->current = 4095;
    if (is_broken(CURRENT_ZERO))
        out->current = 0;
    if (is_broken(FORCE_HIGH))
        out->force = 3800; /* 15.7 N */
    if (is_broken(FORCE_RAIL))
        out->force = 0;
    if (is_broken(FORCE_ZERO))
        out->force = (uint16_t)(228u + (ticks & 1u)); /* no force, but a living converter */
}

void hal_pwm_set(uint16_t on)
{
    duty = on;
}

void hal_pwm_kill(void)
{
    duty = 0;
}

bool hal_tick_overrun(void)
{
    bool was = overrun_pending;
    overrun_pending = false;
    return was;
}

bool hal_uart_rx(uint8_t *byte)
{
    if (rx.tail == rx.head)
        return false;
    *byte = rx.bytes[rx.tail++ & (RING - 1u)];
    return true;
}

uint16_t hal_uart_tx_space(void)
{
    return (uint16_t)(RING - (tx.head - tx.tail));
}

bool hal_uart_tx_idle(void)
{
    return tx.head == tx.tail;
}

void hal_uart_tx(const uint8_t *bytes, uint16_t count)
{
    for (uint16_t k = 0; k < count; k++)
        tx.bytes[tx.head++ & (RING - 1u)] = bytes[k];
}

void hal_watchdog_feed(void)
{
    fed_at = ticks;
}

void hal_critical_enter(void)
{
    /* Tick and main loop are one thread here. */
}

void hal_critical_exit(void)
{
}

uint8_t hal_reset_cause(void)
{
    return cause;
}

uint32_t hal_boot_nonce(void)
{
    return nonce;
}

uint32_t hal_build_hash(void)
{
    return PT_BUILD_HASH;
}

const char *hal_serial(void)
{
    return "BENCH-0"; /* whatever is simulated: the parameters are the user's secret */
}

/* --- the other end of the UART ---------------------------------------------------------------- */

int32_t board_receive_room(void)
{
    return (int32_t)(RING - (rx.head - rx.tail));
}

bool board_received(void)
{
    return rx.head != rx.tail;
}

void board_receive(const uint8_t *bytes, int32_t count)
{
    for (int32_t k = 0; k < count; k++)
        rx.bytes[rx.head++ & (RING - 1u)] = bytes[k];
}

const uint8_t *board_to_send(int32_t *count)
{
    uint32_t at = tx.tail & (RING - 1u);
    uint32_t waiting = tx.head - tx.tail;
    uint32_t piece = RING - at;
    *count = (int32_t)(waiting < piece ? waiting : piece);
    return tx.bytes + at;
}

void board_sent(int32_t count)
{
    tx.tail += (uint32_t)count;
}
