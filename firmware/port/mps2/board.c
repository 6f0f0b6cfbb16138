/* The HAL of the emulated Cortex-M4F: CMSDK timers, UART and watchdog are driven like on silicon; behind
 * the ADC and the PWM is the simulated solenoid, a step of which the tick interrupt takes itself. */
#include "board.h"

#include "app.h"
#include "breaks.h"
#include "control.h"
#include "driver.h"
#include "hal.h"
#include "registers.h"
#include "solenoid.h"

#define RX_RING 256u /* powers of two; more than the longest frame */
#define TX_RING 1024u
#define BAUD 921600u
#define FEED_TICKS 100u                        /* a write to a peripheral costs the emulator dear */
#define WATCHDOG_CYCLES (CLOCK_HZ / 1000u * 128u) /* NMI after 128 ms, reset after 256 ms */
#define POWERED 0x50545231u
#define TICK_PRIORITY 0x40u
#define LATE_CYCLES (BOARD_TICK_CYCLES + BOARD_TICK_CYCLES / 2u) /* no tick for so long: the output goes off */

#define SETTINGS 3u
static const char *const settings[SETTINGS] = {"ambient", "supply-sag", "coil"}; /* in the order of options.py */

#ifndef PT_BUILD_HASH
#define PT_BUILD_HASH 0u
#endif

/* Survives a reset; mps2.ld says where. */
extern volatile struct retained {
    uint32_t seed;    /* written by the emulator's loader before each start: no two runs alike */
    uint32_t powered; /* POWERED: this start is not the first since power-on */
    uint32_t boots;
    uint32_t cause; /* of the next start */
    uint32_t break_tick[BREAKS_COUNT]; /* by the loader too; plus 1, 0: never */
    struct hal_kept kept;
    float setting[SETTINGS]; /* by the loader: of the plant; 0: as built */
} retained;
typedef char retained_fits_its_place[sizeof(struct retained) <= 256u ? 1 : -1];

static struct solenoid plant;
static struct solenoid_params params;
static uint8_t cause;
static uint32_t next_tick; /* board_cycles() at which it is due */
static volatile uint32_t missed;
static volatile uint32_t ticks;
static uint32_t missed_told;
static volatile bool lost;
static uint32_t fed_at;

static uint8_t rx_ring[RX_RING];
static volatile uint16_t rx_head; /* written by the interrupt */
static volatile uint16_t rx_tail; /* written by the main loop */
static uint8_t tx_ring[TX_RING];
static uint16_t tx_head; /* main loop only */
static uint16_t tx_tail;

void timer0_handler(void);
void uart0_rx_handler(void);
void dual_timer_handler(void);
void nmi_handler(void);
void fault_handler(void);

/* --- reset -------------------------------------------------------------------------------------- */

static void read_reset_cause(void)
{
    if (retained.powered != POWERED) {
        retained.powered = POWERED;
        retained.boots = 0;
        cause = PT_RESET_POWER;
    } else {
        cause = (uint8_t)retained.cause;
    }
    retained.boots++;
    retained.cause = PT_RESET_EXTERNAL; /* unless one of the handlers below knows better */
}

/* The main loop or the tick has stood still for 128 ms: output off now; 128 ms later comes the reset. */
void nmi_handler(void)
{
    hal_pwm_kill();
    retained.cause = PT_RESET_WATCHDOG;
    for (;;)
        __asm__ volatile("cpsid i" ::: "memory");
}

static void reset(uint8_t next_cause)
{
    retained.cause = next_cause;
    SCB_RESET = SCB_RESET_REQUEST;
    for (;;) {
    }
}

void fault_handler(void)
{
    hal_pwm_kill();
    reset(PT_RESET_SOFTWARE);
}

void board_init(void)
{
    hal_pwm_kill();
    read_reset_cause();
    solenoid_as_built(&params);
    for (uint32_t k = 0; k < SETTINGS; k++)
        (void)solenoid_set(&params, settings[k], retained.setting[k]);
    solenoid_init(&plant, &params);
    for (int k = 0; k < BREAKS_COUNT; k++)
        breaks_at((enum breaks_what)k, retained.break_tick[k]);

    UART0->divider = CLOCK_HZ / BAUD;
    UART0->control = UART_TX_ENABLE | UART_RX_ENABLE | UART_RX_INTERRUPT_ENABLE;
    TIMER1->reload = UINT32_MAX;
    TIMER1->value = UINT32_MAX;
    TIMER1->control = TIMER_RUN;
    NVIC_PRIORITY[IRQ_DUAL_TIMER] = 0x00u; /* nothing holds this one off */
    NVIC_PRIORITY[IRQ_UART0_RX] = 0x20u;   /* a byte lasts 11 us, the tick may take longer */
    NVIC_PRIORITY[IRQ_TIMER0] = TICK_PRIORITY;
    NVIC_ENABLE = 1u << IRQ_UART0_RX;
}

void board_start_tick(void)
{
    WATCHDOG_LOCK = WATCHDOG_UNLOCK;
    WATCHDOG->load = WATCHDOG_CYCLES;
    WATCHDOG->control = WATCHDOG_INTERRUPT | WATCHDOG_RESET;

    TIMER0->reload = BOARD_TICK_CYCLES - 1u;
    TIMER0->value = BOARD_TICK_CYCLES - 1u;
    next_tick = board_cycles() + BOARD_TICK_CYCLES;
    TIMER0->control = TIMER_RUN | TIMER_INTERRUPT;
    DUAL_TIMER->load = LATE_CYCLES;
    DUAL_TIMER->control = DUAL_TIMER_RUN | DUAL_TIMER_INTERRUPT | DUAL_TIMER_32_BITS | DUAL_TIMER_PERIODIC;
    NVIC_ENABLE = 1u << IRQ_TIMER0 | 1u << IRQ_DUAL_TIMER;
}

/* --- the tick ----------------------------------------------------------------------------------- */

uint32_t board_cycles(void)
{
    return ~TIMER1->value;
}

uint32_t board_missed(void)
{
    return missed;
}

void board_world(void)
{
    driver_step(&plant, HAL_PWM_PERIOD);
}

static void tell_breaks(void)
{
    breaks_play(control.state == PT_STATE_RUNNING, control.tick);
}

/* Really, not in name: the tick stays away, the chip resets, the main loop stands still. */
static void break_tick(void)
{
    tell_breaks();
    if (breaks_once(BREAKS_RESET))
        reset(PT_RESET_EXTERNAL);
    if (breaks_once(BREAKS_TICK_OVERRUN)) {
        uint32_t from = board_cycles();
        while (board_cycles() - from < 2u * BOARD_TICK_CYCLES) {
        }
    }
}

void board_main_loop(void)
{
    while (breaks_is(BREAKS_HANG)) {
    }
}

void board_tick(void)
{
    break_tick();
    if (!breaks_is(BREAKS_TICK_LOST)) {
        DUAL_TIMER->load = LATE_CYCLES;
        app_tick();
    }
    board_world();
    ticks++;
}

/* No tick for one and a half: off, whatever the tick would have said. */
void dual_timer_handler(void)
{
    DUAL_TIMER->clear = 1u;
    hal_pwm_kill();
    lost = true;
}

void timer0_handler(void)
{
    TIMER0->interrupt = 1u;
    /* The interrupt remembers one tick; whoever comes a whole one late has lost some. */
    uint32_t late = board_cycles() - next_tick;
    next_tick += BOARD_TICK_CYCLES;
    for (; late >= BOARD_TICK_CYCLES && late < UINT32_MAX / 2u; late -= BOARD_TICK_CYCLES) {
        next_tick += BOARD_TICK_CYCLES;
        missed++;
    }
    board_tick();
}

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

bool hal_tick_overrun(void)
{
    if (missed_told == missed)
        return false;
    missed_told++;
    return true;
}

bool hal_tick_lost(void)
{
    bool was = lost;
    lost = false;
    return was;
}

/* The tick is held off; receiving and the timer that watches the tick go on. */
void hal_critical_enter(void)
{
    __asm__ volatile("msr basepri, %0" ::"r"(TICK_PRIORITY) : "memory");
}

void hal_critical_exit(void)
{
    __asm__ volatile("msr basepri, %0" ::"r"(0u) : "memory");
}

void hal_watchdog_feed(void)
{
    if (ticks - fed_at < FEED_TICKS)
        return;
    fed_at = ticks;
    WATCHDOG->load = WATCHDOG_CYCLES;
}

/* --- the UART ----------------------------------------------------------------------------------- */

void uart0_rx_handler(void)
{
    UART0->interrupt = UART_RX_INTERRUPT;
    while (UART0->state & UART_RX_FULL) {
        uint8_t byte = (uint8_t)UART0->data;
        /* A full ring loses the byte, like silicon: the frame's check finds out. */
        if ((uint16_t)(rx_head - rx_tail) < RX_RING) {
            rx_ring[rx_head & (RX_RING - 1u)] = byte;
            rx_head = (uint16_t)(rx_head + 1u);
        }
    }
}

bool hal_uart_rx(uint8_t *byte)
{
    if (rx_tail == rx_head)
        return false;
    *byte = rx_ring[rx_tail & (RX_RING - 1u)];
    rx_tail = (uint16_t)(rx_tail + 1u);
    return true;
}

void board_send(void)
{
    while (tx_tail != tx_head && !(UART0->state & UART_TX_FULL)) {
        UART0->data = tx_ring[tx_tail & (TX_RING - 1u)];
        tx_tail = (uint16_t)(tx_tail + 1u);
    }
}

uint16_t hal_uart_tx_space(void)
{
    return (uint16_t)(TX_RING - (uint16_t)(tx_head - tx_tail));
}

bool hal_uart_tx_idle(void)
{
    return tx_head == tx_tail;
}

void hal_uart_tx(const uint8_t *bytes, uint16_t count)
{
    for (uint16_t k = 0; k < count; k++) {
        tx_ring[tx_head & (TX_RING - 1u)] = bytes[k];
        tx_head = (uint16_t)(tx_head + 1u);
    }
}

struct hal_kept *hal_kept(void)
{
    return (struct hal_kept *)&retained.kept;
}

/* --- identity ----------------------------------------------------------------------------------- */

uint8_t hal_reset_cause(void)
{
    return cause;
}

uint32_t hal_boot_nonce(void)
{
    uint32_t x = retained.seed + retained.boots * 0x9E3779B9u;
    x = (x ^ (x >> 16)) * 0x85EBCA6Bu;
    return x ^ (x >> 13);
}

uint32_t hal_build_hash(void)
{
    return PT_BUILD_HASH;
}

const char *hal_serial(void)
{
    return "QEMU-0";
}
