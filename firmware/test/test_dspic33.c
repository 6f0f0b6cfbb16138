/* The register port behind the shim: the order of its writes, and the whole core running on it.
 * With the argument "log" it prints the start-up sequence instead, one write a line. */
#include <string.h>

#include "app.h"
#include "control.h"
#include "board.h"
#include "check.h"
#include "frame.h"
#include "hal.h"
#include "units.h"
#include "xc_shim.h"

#define POWER_ON 0x0003u
#define WATCHDOG_RESET 0x0010u
#define REST 228u /* counts of no force */

void _OscillatorFail(void);

static struct frame_decoder decoder;
static uint8_t payload[PT_MAX_PAYLOAD];
static uint8_t seq;

/* --- order ------------------------------------------------------------------------------------ */

/* Place of the n-th write of `name` (from 0) in the log; -1: there is none. */
static int32_t place(const char *name, int32_t n)
{
    for (int32_t k = 0; k < xc_shim_count(); k++)
        if (strcmp(xc_shim_entry(k)->name, name) == 0 && n-- == 0)
            return k;
    return -1;
}

static int32_t place_of(const char *name, uint16_t value)
{
    for (int32_t k = 0; k < xc_shim_count(); k++)
        if (strcmp(xc_shim_entry(k)->name, name) == 0 && xc_shim_entry(k)->value == value)
            return k;
    return -1;
}

#define BEFORE(first, second)                                                                 \
    do {                                                                                      \
        int32_t before_a = (first), before_b = (second);                                      \
        CHECK(before_a >= 0 && before_b >= 0 && before_a < before_b);                         \
    } while (0)

static void start(uint16_t rcon)
{
    xc_shim_reset(rcon);
    board_start();
}

static void the_output_is_off_before_anything_else(void)
{
    start(POWER_ON);
    CHECK_EQUAL(place("_LATA4", 0), 0);
    CHECK_EQUAL(place("_TRISA4", 0), 1);
    CHECK_EQUAL(place("IOCON1", 0), 2);
    CHECK_EQUAL(place("PTCON", 0), 3);
    CHECK_EQUAL(xc_shim_entry(2)->value & 0xC000u, 0); /* PENH and PENL, both set at reset */
    CHECK_EQUAL(xc_shim_entry(3)->value, 0);
    for (int32_t k = 3; k < xc_shim_count(); k++)
        if (strcmp(xc_shim_entry(k)->name, "IOCON1") == 0)
            CHECK_EQUAL(xc_shim_entry(k)->value & 0xC000u, 0);
    CHECK_EQUAL(IOCON1 & 0xC300u, 0x0300u);
    CHECK_EQUAL(_LATA4, 0);
    CHECK_EQUAL(_TRISA4, 0);
}

static void the_fault_is_set_up_while_the_pwm_is_off(void)
{
    start(POWER_ON);
    BEFORE(place("IOCON1", 0), place("FCLCON1", 0));
    BEFORE(place_of("CMP1CON", 0x8C41u), place("FCLCON1", 0));
    BEFORE(place("CMP1DAC", 0), place_of("CMP1CON", 0x8C41u));
    BEFORE(place("LEBCON1", 0), place("FCLCON1", 0));
    BEFORE(place("FCLCON1", 0), place_of("PTCON", 0x8000u));
    BEFORE(place("PTPER", 0), place_of("PTCON", 0x8000u));
    CHECK_EQUAL(place("FCLCON1", 1), -1);
    CHECK_EQUAL(FCLCON1, 13u << 3 | 1u);
    CHECK_EQUAL(place_of("PTCON", 0x8000u), xc_shim_count() - 1); /* the last write of all */
}

static void clocks_first_then_what_they_drive(void)
{
    start(POWER_ON);
    BEFORE(place("PLLFBD", 0), place("OSCCON", 0));
    BEFORE(place("_PLLPRE", 0), place("OSCCON", 0));
    BEFORE(place("_PLLPOST", 0), place("OSCCON", 0));
    BEFORE(place("OSCCON", 1), place("ACLKCON", 0));
    BEFORE(place("ACLKCON", 0), place("PTPER", 0));
    CHECK_EQUAL(PLLFBD, 74);
    CHECK_EQUAL(ACLKCON, 0xA740u);
    CHECK_EQUAL(_COSC, 1);
}

static void each_converter_is_powered_ready_enabled_calibrated(void)
{
    /* The shim ends the program if a step comes before the one it needs. */
    static const char *const steps[2][6] = {
        {"_C0PWR", "_C0EN", "_CAL0EN", "_CAL0DIFF", "_CAL0RUN", "ADTRIG0L"},
        {"_C2PWR", "_C2EN", "_CAL2EN", "_CAL2DIFF", "_CAL2RUN", "ADTRIG0H"},
    };
    start(POWER_ON);
    for (int core = 0; core < 2; core++) {
        BEFORE(place_of("ADCON1L", 0x8000u), place(steps[core][0], 0));
        for (int k = 0; k < 5; k++)
            BEFORE(place(steps[core][k], 0), place(steps[core][k + 1], 0));
    }
    BEFORE(place("_CAL0RUN", 0), place_of("_CAL0EN", 0));
    BEFORE(place("_CAL2RUN", 0), place_of("_CAL2EN", 0));
    BEFORE(place_of("ADTRIG0L", 5), place_of("_ADCAN2IE", 1));
    BEFORE(place_of("_ADCAN2IE", 1), place_of("PTCON", 0x8000u));
}

static void numbers_are_those_of_the_paper_and_the_data_sheet(void)
{
    start(POWER_ON);
    CHECK_EQUAL(BOARD_FCY_HZ, 70015000);
    CHECK_EQUAL(BOARD_ACLK_HZ, 117920000);
    CHECK_EQUAL(BOARD_PTPER(115000uL), 8195); /* the published device */
    CHECK_EQUAL(PTPER, 7853);                 /* ours: 120 kHz, 12 periods a tick */
    CHECK_EQUAL(TRGCON1 >> 12, 11);
    CHECK_EQUAL(U1BRG, 18);
    CHECK_EQUAL(BOARD_TICK_CYCLES - 1u, 7000);
    CHECK_EQUAL(PR1, 10500);
    CHECK_EQUAL(BOARD_WATCHDOG_MS, 256);
    double baud = 70015000.0 / (4.0 * 19.0);
    CHECK(baud / 921600.0 > 0.999 && baud / 921600.0 < 1.001);
    double tick = 117.92e6 * 8.0 / (7853.0 + 8.0) / 12.0;
    CHECK(tick / 10000.0 > 0.9995 && tick / 10000.0 < 1.0005);
    CHECK_EQUAL(CMP1DAC * 2000L / 4095, 1800); /* mA */
    CHECK(CMP1DAC * 20000L / 4095 > 16500);    /* above the trip of the core */
}

/* --- the core on it --------------------------------------------------------------------------- */

static uint8_t answer(void)
{
    uint8_t bytes[2048];
    struct frame f;
    uint8_t type = 0;
    uint16_t n = xc_shim_sent(bytes, sizeof bytes);
    for (uint16_t k = 0; k < n; k++) {
        if (frame_decode(&decoder, bytes[k], &f) && f.type != PT_TELEMETRY && f.type != PT_TELEMETRY_DUTY) {
            type = f.type;
            memcpy(payload, f.payload, f.length);
        }
    }
    return type;
}

static uint8_t ask(uint8_t type, const uint8_t *body, uint8_t length)
{
    uint8_t wire[FRAME_MAX_ENCODED];
    xc_shim_receive(wire, frame_encode(wire, type, ++seq, body, length, true));
    app_poll();
    return answer();
}

static void run_at(int16_t value)
{
    uint8_t p[PT_MAX_PAYLOAD];
    uint8_t samples[80];
    start(POWER_ON);
    put_u32(p + PT_HELLO_MAGIC, PT_MAGIC);
    p[PT_HELLO_MAJOR] = PT_PROTOCOL_MAJOR;
    p[PT_HELLO_MINOR] = PT_PROTOCOL_MINOR;
    CHECK_EQUAL(ask(PT_HELLO, p, PT_HELLO_LEN), PT_HELLO_REPLY);
    CHECK_EQUAL(payload[PT_HELLO_REPLY_RESET_CAUSE], PT_RESET_POWER);
    CHECK(memcmp(payload + PT_HELLO_REPLY_SERIAL, "PT-0000", 8) == 0);
    uint32_t nonce = get_u32(payload + PT_HELLO_REPLY_BOOT_NONCE);
    for (uint8_t k = 0; k < 40; k++)
        put_i16(samples + 2 * k, value);
    uint32_t crc = wave_crc32(0, samples, 80);
    put_u32(p + PT_WAVE_BEGIN_TOTAL, 40);
    put_u16(p + PT_WAVE_BEGIN_TICKS_PER_SAMPLE, 1000);
    put_u32(p + PT_WAVE_BEGIN_CRC32, crc);
    CHECK_EQUAL(ask(PT_WAVE_BEGIN, p, PT_WAVE_BEGIN_LEN), PT_ACK);
    put_u32(p + PT_WAVE_DATA_OFFSET, 0);
    p[PT_WAVE_DATA_COUNT] = 40;
    memcpy(p + PT_WAVE_DATA_LEN, samples, 80);
    CHECK_EQUAL(ask(PT_WAVE_DATA, p, PT_WAVE_DATA_LEN + 80), PT_ACK);
    put_u32(p + PT_WAVE_COMMIT_COUNT, 40);
    put_u32(p + PT_WAVE_COMMIT_CRC32, crc);
    CHECK_EQUAL(ask(PT_WAVE_COMMIT, p, PT_WAVE_COMMIT_LEN), PT_ACK);
    put_u32(p, nonce);
    CHECK_EQUAL(ask(PT_ARM, p, PT_ARM_LEN), PT_ACK);
    CHECK_EQUAL(ask(PT_START, NULL, 0), PT_ACK);
}

/* Ticks with a current that follows the drive, dithering by a count as living converters do. */
static void ticks(uint32_t n, uint16_t current)
{
    for (uint32_t k = 0; k < n; k++) {
        xc_shim_tick((uint16_t)(current + (k & 1u)), (uint16_t)(REST + 450u + (k & 1u)));
        app_poll();
        (void)answer();
        xc_shim_forget();
    }
}

static void a_run_drives_the_gate_and_ends_with_the_pin_released(void)
{
    run_at(5000);
    CHECK_EQUAL(IOCON1, 0x8D00u); /* switched on by START, with no duty yet */
    CHECK_EQUAL(PDC1, 0);
    ticks(100, 1023);
    CHECK_EQUAL(control.state, PT_STATE_RUNNING);
    CHECK_EQUAL(IOCON1, 0x8D00u);
    CHECK(PDC1 > 500 && PDC1 < 4000);
    xc_shim_forget();
    xc_shim_tick(1023, REST + 300);
    CHECK(place("PDC1", 0) >= 0);
    CHECK_EQUAL(place("IOCON1", 0), -1); /* a tick sets how long, it never switches on */
    CHECK_EQUAL(ask(PT_STOP, NULL, 0), PT_ACK);
    ticks(2000, 200);
    CHECK_EQUAL(control.state, PT_STATE_IDLE);
    CHECK_EQUAL(IOCON1 & 0xC300u, 0x0300u);
}

static void over_current_releases_the_pin_in_the_same_interrupt(void)
{
    run_at(5000);
    ticks(100, 1023);
    xc_shim_tick(3400, REST + 300); /* 1.66 A */
    CHECK_EQUAL(control.fault, PT_FAULT_OVER_CURRENT);
    CHECK_EQUAL(IOCON1 & 0xC300u, 0x0300u);
    CHECK_EQUAL(ask(PT_STATUS, NULL, 0), PT_STATUS_REPLY);
    CHECK_EQUAL(payload[PT_STATUS_REPLY_FAULT], PT_FAULT_OVER_CURRENT);
}

static void a_tick_that_takes_too_long_is_found(void)
{
    run_at(5000);
    ticks(100, 1023);
    xc_shim_next_conversion_early();
    xc_shim_tick(1023, REST + 300); /* found at its end, told by the next one */
    xc_shim_tick(1022, REST + 301);
    CHECK_EQUAL(control.fault, PT_FAULT_TICK_OVERRUN);
    CHECK_EQUAL(IOCON1 & 0xC300u, 0x0300u);
}

static void a_tick_that_came_late_is_found(void)
{
    run_at(5000);
    ticks(100, 1023);
    xc_shim_no_tick();
    xc_shim_tick(1022, REST + 300);
    CHECK_EQUAL(control.fault, PT_FAULT_TICK_OVERRUN);
    CHECK_EQUAL(IOCON1 & 0xC300u, 0x0300u);
}

static void a_tick_that_stays_away_is_off_by_its_own_timer(void)
{
    run_at(5000);
    ticks(100, 1023);
    CHECK_EQUAL(_T1IE, 1);
    CHECK(_T1IP == 7 && _T1IP > _ADCAN2IP && _T1IP > _U1RXIP);
    xc_shim_forget();
    xc_shim_no_tick(); /* one and a half ticks: no main loop, no tick needed */
    CHECK_EQUAL(place("IOCON1", 0), 0);
    CHECK_EQUAL(IOCON1 & 0xC300u, 0x0300u);
    app_poll();
    CHECK_EQUAL(control.state, PT_STATE_FAULT);
    CHECK_EQUAL(control.fault, PT_FAULT_TICK_LOST);
    xc_shim_forget();
    ticks(10, 0); /* it comes again: that changes nothing */
    CHECK_EQUAL(IOCON1 & 0xC300u, 0x0300u);
}

/* In the middle of a critical section, where the tick itself is held off. */
static void nothing_holds_off_the_timer_that_watches_the_tick(void)
{
    run_at(5000);
    ticks(100, 1023);
    hal_critical_enter();
    xc_shim_no_tick();
    CHECK_EQUAL(IOCON1 & 0xC300u, 0x0300u);
    hal_critical_exit();
}

static void a_converter_that_is_not_ready_is_found(void)
{
    run_at(5000);
    ticks(100, 1023);
    xc_shim_unready();
    xc_shim_tick(1022, REST + 300);
    CHECK_EQUAL(control.fault, PT_FAULT_CONVERTER);
    CHECK_EQUAL(IOCON1 & 0xC300u, 0x0300u);
}

static void the_comparator_is_read_and_its_flag_cleared(void)
{
    run_at(5000);
    ticks(100, 1023);
    for (int k = 0; k < 3; k++) {
        CHECK_EQUAL(control.fault, PT_FAULT_NONE);
        _AC1IF = 1;
        xc_shim_tick((uint16_t)(1022 + k), (uint16_t)(REST + 300 + k));
        CHECK_EQUAL(_AC1IF, 0);
    }
    CHECK_EQUAL(control.fault, PT_FAULT_COMPARATOR);
    CHECK_EQUAL(IOCON1 & 0xC300u, 0x0300u);
}

static void a_clock_that_lost_its_lock_is_off_and_starts_anew(void)
{
    volatile uint16_t *const locks[] = {&_LOCK, &_APLLCK};
    for (int k = 0; k < 2; k++) {
        run_at(5000);
        ticks(10, 1023);
        xc_shim_forget();
        *locks[k] = 0;
        xc_shim_tick(1022, REST + 300);
        BEFORE(place_of("IOCON1", 0x0F00u), place("RESET", 0));
        start(0x0040u); /* the reset instruction */
        CHECK_EQUAL(hal_reset_cause(), PT_RESET_CLOCK);
        start(0x0040u);
        CHECK_EQUAL(hal_reset_cause(), PT_RESET_SOFTWARE); /* told once */
    }
}

static void the_heat_outlives_a_reset_but_not_power_on(void)
{
    const uint8_t told[PT_COIL_HEAT_LEN] = {200, 0};
    start(POWER_ON);
    CHECK(heat_is_assumed(&control.safety.heat));
    CHECK_EQUAL(ask(PT_COIL_HEAT, told, sizeof told), PT_ACK);
    start(WATCHDOG_RESET);
    CHECK_EQUAL(heat_per_mille(&control.safety.heat), 200);
    start(POWER_ON);
    CHECK_EQUAL(heat_per_mille(&control.safety.heat), 1000);
}

static void duty_at_the_ends_of_its_range(void)
{
    start(POWER_ON);
    static const uint16_t pairs[][2] = {
        {0, 0}, {15, 0}, {16, 16}, {4000, 4000}, {7845, 7845}, {7846, 7853}, {7853, 7853},
    };
    for (uint32_t k = 0; k < sizeof pairs / sizeof pairs[0]; k++) {
        hal_pwm_set(pairs[k][0]);
        CHECK_EQUAL(PDC1, pairs[k][1]);
    }
    xc_shim_forget();
    hal_pwm_kill();
    CHECK_EQUAL(place("IOCON1", 0), 0); /* at once, not after the duty */
}

static void an_overrun_of_the_receiver_does_not_silence_it(void)
{
    start(POWER_ON);
    xc_shim_overrun();
    CHECK_EQUAL(U1STA & 2u, 0);
    CHECK_EQUAL(ask(PT_STATUS, NULL, 0), PT_STATUS_REPLY);
}

static void a_flood_is_dropped_and_the_next_command_read(void)
{
    uint8_t flood[1000];
    memset(flood, 0x55, sizeof flood);
    start(POWER_ON);
    xc_shim_receive(flood, sizeof flood);
    for (int k = 0; k < 3; k++)
        app_poll();
    CHECK_EQUAL(ask(PT_STATUS, NULL, 0), PT_STATUS_REPLY);
}

static void every_start_has_another_nonce_and_its_cause(void)
{
    static const uint16_t rcon[] = {POWER_ON, WATCHDOG_RESET, 0x0080u, 0x0002u, 0x0040u, 0x8000u, POWER_ON};
    static const uint8_t cause[] = {PT_RESET_POWER,     PT_RESET_WATCHDOG, PT_RESET_EXTERNAL, PT_RESET_BROWN_OUT,
                                    PT_RESET_SOFTWARE, PT_RESET_SOFTWARE, PT_RESET_POWER};
    uint32_t seen[7];
    for (int k = 0; k < 7; k++) {
        start(rcon[k]);
        CHECK_EQUAL(hal_reset_cause(), cause[k]);
        CHECK_EQUAL(RCON, 0);
        seen[k] = hal_boot_nonce();
        for (int j = 0; j < k; j++)
            CHECK(seen[j] != seen[k]);
    }
}

static void the_watchdog_is_fed_by_tick_and_loop_together(void)
{
    start(POWER_ON);
    xc_shim_forget();
    app_poll();
    CHECK_EQUAL(place("WATCHDOG", 0), -1);
    xc_shim_tick(1, REST);
    CHECK_EQUAL(place("WATCHDOG", 0), -1);
    app_poll();
    CHECK(place("WATCHDOG", 0) >= 0);
}

static void a_trap_releases_the_pin_and_resets(void)
{
    run_at(5000);
    ticks(10, 1023);
    xc_shim_forget();
    _OscillatorFail();
    CHECK_EQUAL(place("IOCON1", 0), 0);
    BEFORE(place("IOCON1", 0), place("RESET", 0));
    CHECK_EQUAL(IOCON1 & 0xC300u, 0x0300u);
}

static void critical_sections_hold_the_tick_only(void)
{
    start(POWER_ON);
    hal_critical_enter();
    CHECK_EQUAL(_ADCAN2IE, 0);
    CHECK_EQUAL(_U1RXIE, 1);
    hal_critical_exit();
    CHECK_EQUAL(_ADCAN2IE, 1);
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "log") == 0) {
        start(POWER_ON);
        for (int32_t k = 0; k < xc_shim_count(); k++)
            printf("%s = 0x%04X\n", xc_shim_entry(k)->name, xc_shim_entry(k)->value);
        return 0;
    }
    if (argc == 2 && strcmp(argv[1], "stuck") == 0) { /* a converter that never gets ready */
        xc_shim_reset(POWER_ON);
        xc_shim_wait_for_ever(&_C0RDY);
        board_start();
        return 0;
    }
    if (argc == 2 && strcmp(argv[1], "locked") == 0) { /* programmed without its configuration words */
        xc_shim_reset(POWER_ON);
        xc_shim_lock_pwm();
        board_start();
        return 0;
    }
    RUN(the_output_is_off_before_anything_else);
    RUN(the_fault_is_set_up_while_the_pwm_is_off);
    RUN(clocks_first_then_what_they_drive);
    RUN(each_converter_is_powered_ready_enabled_calibrated);
    RUN(numbers_are_those_of_the_paper_and_the_data_sheet);
    RUN(a_run_drives_the_gate_and_ends_with_the_pin_released);
    RUN(over_current_releases_the_pin_in_the_same_interrupt);
    RUN(a_tick_that_takes_too_long_is_found);
    RUN(a_tick_that_came_late_is_found);
    RUN(a_tick_that_stays_away_is_off_by_its_own_timer);
    RUN(nothing_holds_off_the_timer_that_watches_the_tick);
    RUN(a_converter_that_is_not_ready_is_found);
    RUN(the_comparator_is_read_and_its_flag_cleared);
    RUN(a_clock_that_lost_its_lock_is_off_and_starts_anew);
    RUN(the_heat_outlives_a_reset_but_not_power_on);
    RUN(duty_at_the_ends_of_its_range);
    RUN(an_overrun_of_the_receiver_does_not_silence_it);
    RUN(a_flood_is_dropped_and_the_next_command_read);
    RUN(every_start_has_another_nonce_and_its_cause);
    RUN(the_watchdog_is_fed_by_tick_and_loop_together);
    RUN(a_trap_releases_the_pin_and_resets);
    RUN(critical_sections_hold_the_tick_only);
    CHECK_DONE();
}
