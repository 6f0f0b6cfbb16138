/* Two dedicated converters, triggered together by every 12th period of the PWM; the end of the second
 * one's conversion is the tick. */
#include "app.h"
#include "board.h"
#include "hal.h"
#include "regs.h"

#define FORMAT_12_BITS_INTEGER 0x0060u /* of the shared core, which is not used */
#define CORE_12_BITS 0x0300u           /* clock: FCY / 2 */
#define WARM_UP_LONGEST 0x0F00u
#define ADC_ON 0x8000u
#define SOURCE_SOFTWARE 1u
#define SOURCE_PWM1 5u /* its primary trigger. The 4 and 2 of other examples belong to other families. A wrong
                        * one gives no tick at all: the watchdog is not fed, the output stays off. */

static struct hal_adc latest;
static bool fresh; /* both converters had a new value */
static volatile bool missed;

#define POWER_AND_CALIBRATE(core)               \
    do {                                        \
        REG_WRITE(_C##core##PWR, 1);            \
        while (REG_READ(_C##core##RDY) == 0) {  \
        }                                       \
        REG_WRITE(_C##core##EN, 1);             \
        REG_WRITE(_CAL##core##EN, 1);           \
        REG_WRITE(_CAL##core##DIFF, 0);         \
        REG_WRITE(_CAL##core##RUN, 1);          \
        while (REG_READ(_CAL##core##RDY) == 0) {\
        }                                       \
        REG_WRITE(_CAL##core##EN, 0);           \
    } while (0)

/* The waits have no limit of their own: the watchdog, which runs from reset on, is it. */
void board_adc(void)
{
    REG_WRITE(_ANSA0, 1);
    REG_WRITE(_ANSA2, 1);
    REG_WRITE(ADCON1L, 0);
    REG_WRITE(ADCON1H, FORMAT_12_BITS_INTEGER);
    REG_WRITE(ADCON2L, 0);
    REG_WRITE(ADCON2H, 0);
    REG_WRITE(ADCON3L, 0); /* reference AVDD and AVSS, triggers not held back */
    REG_WRITE(ADCON3H, 0); /* clock FCY, every core disabled */
    REG_WRITE(ADCON4L, 0);
    REG_WRITE(ADCON4H, 0); /* core 0 on AN0, core 2 on AN2 */
    REG_WRITE(ADCORE0L, 0);
    REG_WRITE(ADCORE0H, CORE_12_BITS);
    REG_WRITE(ADCORE2L, 0);
    REG_WRITE(ADCORE2H, CORE_12_BITS);
    REG_WRITE(ADMOD0L, 0); /* single-ended, unsigned */
    REG_WRITE(ADCON5H, WARM_UP_LONGEST);
    REG_WRITE(ADCON1L, ADC_ON);
    POWER_AND_CALIBRATE(0);
    POWER_AND_CALIBRATE(2);
    REG_WRITE(ADTRIG0L, SOURCE_SOFTWARE);
    REG_WRITE(ADTRIG0H, SOURCE_SOFTWARE);
}

/* Also the first readings that the core sees. */
uint16_t board_adc_noise(void)
{
    REG_WRITE(_SWCTRG, 1);
    while (REG_READ(_AN0RDY) == 0 || REG_READ(_AN2RDY) == 0) {
    }
    latest.current = REG_READ(ADCBUF0);
    latest.force = REG_READ(ADCBUF2);
    fresh = true;
    return (uint16_t)((latest.current << 2) ^ latest.force);
}

void board_adc_follow_pwm(void)
{
    REG_WRITE(ADTRIG0L, SOURCE_PWM1);
    REG_WRITE(ADTRIG0H, SOURCE_PWM1);
    REG_WRITE(ADIEL, 0x0004u); /* AN2 interrupts */
}

INTERRUPT(_ADCAN2Interrupt)
{
    /* This interrupt is AN2's; AN0, triggered with it and set up like it, has to be ready as well. */
    fresh = REG_READ(_AN0RDY) != 0 && REG_READ(_AN2RDY) != 0;
    latest.current = REG_READ(ADCBUF0);
    latest.force = REG_READ(ADCBUF2);
    REG_WRITE(_ADCAN2IF, 0);
    REG_WRITE(TMR1, 0); /* timer 1 switches off where no tick comes for one and a half */
    board_check_clock();
    app_tick();
    if (REG_READ(_ADCAN2IF) != 0)
        missed = true; /* the next conversion ended before this tick did */
}

bool hal_adc_read(struct hal_adc *out)
{
    *out = latest;
    return fresh;
}

bool hal_tick_overrun(void)
{
    bool was = missed;
    missed = false;
    return was;
}
