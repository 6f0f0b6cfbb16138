/* Clock, start-up, identity, watchdog, traps. */
#include "board.h"

#include "app.h"
#include "regs.h"

#ifndef PT_BUILD_HASH
#define PT_BUILD_HASH 0u
#endif
#ifndef PT_SERIAL
#define PT_SERIAL "PT-0000" /* -DPT_SERIAL=\"...\" for each device */
#endif

#define OSC_FRCPLL 1u
#define ACLK_FROM_FRC_TIMES_16 0xA740u /* ENAPLL, SELACLK, no divider, FRCSEL */
#define SETTLE_LOOPS 3500u             /* at least a cycle each: 50 us */

#define RCON_POR 0x0001u
#define RCON_BOR 0x0002u
#define RCON_WDTO 0x0010u
#define RCON_EXTR 0x0080u

static uint8_t cause;
#define CLOCK_FAILED 0xC10Cu
static PERSISTENT uint16_t gave_up; /* CLOCK_FAILED: why the device reset itself */
static PERSISTENT uint32_t nonce;
static PERSISTENT struct hal_kept kept;

void board_clock(void)
{
    REG_WRITE(PLLFBD, BOARD_PLLFBD);
    REG_WRITE(_PLLPRE, 0);  /* N1 = 2 */
    REG_WRITE(_PLLPOST, 0); /* N2 = 2 */
    OSCCONH_WRITE(OSC_FRCPLL);
    OSCCONL_WRITE((REG_READ(OSCCON) & 0xFFu) | 1u); /* OSWEN: switch */
    while (REG_READ(_COSC) != OSC_FRCPLL) {
    }
    while (REG_READ(_LOCK) == 0) {
    }
    REG_WRITE(ACLKCON, ACLK_FROM_FRC_TIMES_16);
    while (REG_READ(_APLLCK) == 0) {
    }
    for (volatile uint16_t k = 0; k < SETTLE_LOOPS; k++) {
    }
}

void board_note_reset(void)
{
    uint16_t rcon = REG_READ(RCON);
    if (rcon & RCON_POR)
        cause = PT_RESET_POWER;
    else if (rcon & RCON_BOR)
        cause = PT_RESET_BROWN_OUT;
    else if (rcon & RCON_WDTO)
        cause = PT_RESET_WATCHDOG;
    else if (rcon & RCON_EXTR)
        cause = PT_RESET_EXTERNAL;
    else /* the reset instruction, a trap, an illegal opcode */
        cause = gave_up == CLOCK_FAILED ? PT_RESET_CLOCK : PT_RESET_SOFTWARE;
    gave_up = 0;
    REG_WRITE(RCON, 0);
}

/* A warm start keeps the memory: the next number of a sequence that repeats after 2^32 steps only. After
 * power-on the memory holds anything, perhaps the same each time: the noise of the converters is mixed in. */
static uint32_t follow(uint32_t n)
{
    return (uint32_t)(n * 1664525uL + 1013904223uL);
}

static void next_nonce(void)
{
    if (cause == PT_RESET_POWER || cause == PT_RESET_BROWN_OUT)
        for (uint8_t k = 0; k < 16u; k++)
            nonce = follow(nonce ^ board_adc_noise());
    nonce = follow(nonce);
}

void board_start(void)
{
    board_output_off();
    board_note_reset();
    board_clock();
    board_comparator();
    board_pwm();
    board_adc();
    (void)board_adc_noise();
    next_nonce();
    board_uart();
    app_init();
    board_adc_follow_pwm();
    board_tick_start();
}

void hal_watchdog_feed(void)
{
    ClrWdt();
}

/* Only the tick is held off: receiving goes on. The write takes effect two instructions later. */
void hal_critical_enter(void)
{
    REG_WRITE(_ADCAN2IE, 0);
    Nop();
    Nop();
    MEMORY_BARRIER();
}

void hal_critical_exit(void)
{
    MEMORY_BARRIER();
    REG_WRITE(_ADCAN2IE, 1);
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
    return PT_SERIAL;
}

/* --- traps: off first, then start anew ---------------------------------------------------------- */

static void give_up(void)
{
    hal_pwm_kill();
    RESET_DEVICE();
}

/* The fail-safe clock monitor (FCKSM = CSECME) and a system PLL that loses its lock end in this trap, on the FRC, which
 * goes on running. CHECK against the data sheet: that loss of lock traps on this family. */
INTERRUPT(_OscillatorFail)
{
    gave_up = CLOCK_FAILED;
    give_up();
}

/* Both locks by hand as well: the auxiliary PLL, which clocks the PWM and with it the tick, has no trap. */
void board_check_clock(void)
{
    if (REG_READ(_LOCK) != 0 && REG_READ(_APLLCK) != 0)
        return;
    gave_up = CLOCK_FAILED;
    give_up();
}

INTERRUPT(_AddressError)
{
    give_up();
}

INTERRUPT(_StackError)
{
    give_up();
}

INTERRUPT(_MathError)
{
    give_up();
}

INTERRUPT(_DefaultInterrupt) /* an interrupt that nobody enabled */
{
    give_up();
}
