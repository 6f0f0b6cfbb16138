/* PWM1H drives the MOSFET; CMP1 chops it cycle by cycle, without any software, at 1.8 A. */
#include "board.h"
#include "hal.h"
#include "regs.h"

/* IOCON1. At reset PENH and PENL are set: the PWM would own both pins. */
#define PENH 0x8000u
#define PMOD_INDEPENDENT 0x0C00u
#define OVERRIDE_BOTH_LOW 0x0300u /* OVRENH, OVRENL, OVRDAT 00 */
#define OVERRIDE_L_LOW 0x0100u    /* OVRENL, OVRDAT 00; FLTDAT 00: low on a fault too */
#define IOCON_OFF (PMOD_INDEPENDENT | OVERRIDE_BOTH_LOW)
#define IOCON_ON (PENH | PMOD_INDEPENDENT | OVERRIDE_L_LOW)

#define PTCON_ON 0x8000u
#define DEAD_TIME_OFF 0x0080u
#define TRIGGER_EVERY(n) (((n) - 1u) << 12)
#define FAULT_CMP1 (13u << 3)
#define FAULT_EACH_CYCLE 0x0001u /* active high */
#define BLANK_FAULT_AT_RISE 0x8800u
#define BLANK_STEP_PS 8480u

/* CMP1CON */
#define CMP_ON 0x8000u
#define CMP_HYSTERESIS_LEAST 0x0800u /* 5 or 15 mV: the public examples disagree */
#define CMP_FILTER 0x0400u
#define CMP_INPUT_B 0x0040u
#define CMP_STATUS 0x0008u
#define CMP_RANGE_AVDD 0x0001u

/* The duty register takes no pulse below 16 counts and none within 8 of the period. */
#define SHORTEST 16u
#define SHORTEST_GAP 8u

void board_output_off(void)
{
    REG_WRITE(_LATA4, 0);
    REG_WRITE(_TRISA4, 0);
    REG_WRITE(IOCON1, IOCON_OFF);
    REG_WRITE(PTCON, 0);
    /* Locked by the configuration word this register would not have changed, and could never be switched
     * off either. The PWM is not started then; the watchdog, on from reset, tries again for ever. */
    while (REG_READ(IOCON1) != IOCON_OFF) {
    }
}

void board_comparator(void)
{
    REG_WRITE(_ANSA1, 1);
    REG_WRITE(CMP1CON, 0);
    REG_WRITE(CMP1DAC, BOARD_CHOP_COUNTS);
    REG_WRITE(CMP1CON, CMP_HYSTERESIS_LEAST | CMP_FILTER | CMP_INPUT_B | CMP_RANGE_AVDD);
    REG_WRITE(CMP1CON, CMP_ON | CMP_HYSTERESIS_LEAST | CMP_FILTER | CMP_INPUT_B | CMP_RANGE_AVDD);
}

void board_pwm(void)
{
    REG_WRITE(PTCON2, 0); /* no prescaler */
    REG_WRITE(PTPER, HAL_PWM_PERIOD);
    REG_WRITE(PWMCON1, DEAD_TIME_OFF); /* duty taken over at the end of a period */
    REG_WRITE(PDC1, 0);
    REG_WRITE(PHASE1, 0);
    REG_WRITE(DTR1, 0);
    REG_WRITE(ALTDTR1, 0);
    REG_WRITE(LEBDLY1, (BOARD_BLANK_NS * 1000uL / BLANK_STEP_PS + 1u) << 3);
    REG_WRITE(LEBCON1, BLANK_FAULT_AT_RISE);
    REG_WRITE(FCLCON1, FAULT_CMP1 | FAULT_EACH_CYCLE);
    REG_WRITE(TRIG1, HAL_PWM_PERIOD / 2u);
    REG_WRITE(TRGCON1, TRIGGER_EVERY(BOARD_PWM_PER_TICK));
}

void hal_pwm_set(uint16_t on)
{
    uint16_t duty = on;
    if (on < SHORTEST)
        duty = 0;
    else if (on > HAL_PWM_PERIOD - SHORTEST_GAP)
        duty = HAL_PWM_PERIOD; /* as long as the period: always on */
    REG_WRITE(PDC1, duty);
}

void hal_pwm_enable(void)
{
    REG_WRITE(IOCON1, IOCON_ON);
}

void hal_pwm_kill(void)
{
    /* One write: the pin goes back to its port latch, which is low, whatever the PWM does. */
    REG_WRITE(IOCON1, IOCON_OFF);
    REG_WRITE(PDC1, 0);
}

/* The comparator chops by itself; its interrupt, which is not enabled, remembers that it did.
 * CHECK against the data sheet: the name of the flag, and CMPSTAT in bit 3. */
bool hal_comparator(void)
{
    bool cut = REG_READ(_AC1IF) != 0 || (REG_READ(CMP1CON) & CMP_STATUS) != 0;
    REG_WRITE(_AC1IF, 0);
    return cut;
}

/* Timer 1 runs out when no tick has come for one and a half. Priority 7 is above every other interrupt and
 * beyond what a disable instruction holds off. */
static volatile bool lost;

INTERRUPT(_T1Interrupt)
{
    hal_pwm_kill();
    REG_WRITE(_T1IF, 0);
    lost = true;
}

bool hal_tick_lost(void)
{
    bool was = lost;
    lost = false;
    return was;
}

void board_tick_start(void)
{
    REG_WRITE(T1CON, 0);
    REG_WRITE(TMR1, 0);
    REG_WRITE(PR1, BOARD_LATE_CYCLES - 1u);
    REG_WRITE(_T1IF, 0);
    REG_WRITE(_T1IP, 7);
    REG_WRITE(_T1IE, 1);
    REG_WRITE(T1CON, 0x8000u);
    REG_WRITE(_ADCAN2IP, 5);
    REG_WRITE(_ADCAN2IF, 0);
    REG_WRITE(_ADCAN2IE, 1);
    /* The PWM's clock is also the tick's: from here on every 12th period is one. */
    REG_WRITE(PTCON, PTCON_ON);
}
