/* The HAL of the host port: the simulated solenoid behind ADC and PWM, two rings behind the UART, a
 * watchdog that really resets, and faults that a test or a sceptic can provoke. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "app.h"
#include "breaks.h"
#include "control.h"
#include "driver.h"
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
static uint8_t cause;
static uint32_t nonce;
static uint64_t ticks;
static uint64_t fed_at;
static struct hal_kept kept;
static char serial[16] = "";

/* --- provoked faults -------------------------------------------------------------------------- */

static bool overrun_pending;
static bool tick_lost;
static bool tick_lost_told;
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
    for (int k = 0; k < BREAKS_COUNT; k++) {
        if (strlen(breaks_names[k]) == length && strncmp(breaks_names[k], what_at, length) == 0) {
            breaks_at((enum breaks_what)k, (uint32_t)(seconds * (double)PT_TICK_RATE_HZ) + 1u);
            return true;
        }
    }
    return false;
}

void board_list_breaks(void)
{
    for (int k = 0; k < BREAKS_COUNT; k++)
        printf("%s\n", breaks_names[k]);
}

static void tell_breaks(void)
{
    breaks_play(control.state == PT_STATE_RUNNING, control.tick);
}

bool board_main_loop_runs(void)
{
    tell_breaks();
    if (breaks_once(BREAKS_HANG))
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
    tick_lost = false;
    tick_lost_told = false;
    driver_reset();
    fed_at = ticks;
    rx.head = rx.tail = 0;
    tx.head = tx.tail = 0;
    app_init();
}

void board_number(unsigned long number)
{
    snprintf(serial, sizeof serial, "BENCH-%lu", number);
}

void board_init(const struct solenoid_params *p, uint8_t reset_cause)
{
    if (serial[0] == '\0')
        board_number((unsigned long)p->seed);
    solenoid_init(&plant, p);
    start_firmware(reset_cause);
}

const struct solenoid *board_world(void)
{
    return &plant;
}

uint64_t board_ticks(void)
{
    return ticks;
}

void board_tick(void)
{
    tell_breaks();
    if (breaks_once(BREAKS_RESET))
        start_firmware(PT_RESET_EXTERNAL);
    if (breaks_once(BREAKS_TICK_OVERRUN))
        overrun_pending = true;
    if (!breaks_is(BREAKS_TICK_LOST))
        app_tick();
    else if (!tick_lost_told) { /* a timer of its own has run out */
        driver_off();
        tick_lost_told = true;
        tick_lost = true;
    }
    driver_step(&plant, HAL_PWM_PERIOD);
    ticks++;
    if (ticks - fed_at > WATCHDOG_TICKS)
        start_firmware(PT_RESET_WATCHDOG);
}

/* --- the HAL ---------------------------------------------------------------------------------- */

bool hal_adc_read(struct hal_adc *out)
{
    out->current = solenoid_adc_current(&plant);
    out->force = solenoid_adc_force(&plant);
    return breaks_sensors(&out->current, &out->force);
}

void hal_pwm_enable(void)
{
    driver_enable();
}

void hal_pwm_set(uint16_t on_counts)
{
    driver_set(on_counts);
}

void hal_pwm_kill(void)
{
    driver_off();
}

bool hal_comparator(void)
{
    return driver_cut();
}

bool hal_tick_lost(void)
{
    bool was = tick_lost;
    tick_lost = false;
    return was;
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

struct hal_kept *hal_kept(void)
{
    return &kept;
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
    return serial; /* which device; whatever else is simulated is the user's secret */
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
