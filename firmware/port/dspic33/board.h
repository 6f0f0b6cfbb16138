/* The board of the dsPIC33EP64GS504: its clocks as numbers, its wiring, its parts.
 *
 * This port has never been compiled with the vendor's compiler nor run on a device. Register values and
 * configuration names were compared with what the vendor's code generator writes for this very device
 * (public projects; docs/decisions/020 says which value came from where). The data sheet of the GS50X family,
 * DS70005127, has the last word.
 *
 * Wiring, ours (the published device does not give its pins):
 *   RA0 AN0    coil current: shunt, gain 50, low-pass          2 A   = AVDD
 *   RA1 CMP1B  coil current before the low-pass: comparator    2 A   = AVDD
 *   RA2 AN2    force: instrumentation amplifier                -1..17 N = 0..AVDD
 *   RA4 PWM1H  gate of the MOSFET; a pull-down keeps it off while the pin floats at reset
 *   RC0 RP48   U1TX    RC1 RP49  U1RX */
#ifndef PULSETRAINER_BOARD_H
#define PULSETRAINER_BOARD_H

#include <stdbool.h>
#include <stdint.h>

#include "hal.h"
#include "protocol.h"

/* The 7.37 MHz FRC through the PLL: N1 = 2, M = PLLFBD + 2 = 76, N2 = 2. */
#define BOARD_FRC_HZ 7370000uL
#define BOARD_PLLFBD 74u
#define BOARD_VCO_HZ (BOARD_FRC_HZ / 2u * (BOARD_PLLFBD + 2uL))
#define BOARD_FCY_HZ (BOARD_VCO_HZ / 2u / 2u) /* 70.015 MHz: two oscillator cycles an instruction */

/* The FRC times 16 clocks the PWM, which counts it eightfold: 1.06 ns. */
#define BOARD_ACLK_HZ (BOARD_FRC_HZ * 16u)
#define BOARD_PTPER(frequency_hz) (BOARD_ACLK_HZ * 8u / (frequency_hz) - 8u)
#define BOARD_PWM_HZ 120000uL
#define BOARD_PWM_PER_TICK 12uL

#define BOARD_BAUD 921600uL
#define BOARD_BRG ((BOARD_FCY_HZ + 2u * BOARD_BAUD) / (4u * BOARD_BAUD) - 1u)

#define BOARD_TICK_CYCLES (BOARD_FCY_HZ / PT_TICK_RATE_HZ)
#define BOARD_LATE_CYCLES (BOARD_TICK_CYCLES + BOARD_TICK_CYCLES / 2u) /* no tick for so long: one was missed */

#define BOARD_WATCHDOG_MS (32uL * 256u * 1000u / 32000u) /* 32 kHz, WDTPRE 32, WDTPOST 256 */

/* Comparator: above the 1.65 A that the core trips at, below the 2 A that the shunt amplifier can show. */
#define BOARD_CHOP_COUNTS 3686u /* 1.8 A of 2 A, 12 bits */
#define BOARD_BLANK_NS 200u     /* after the MOSFET turns on: its gate's and the diode's spike */

typedef char board_fcy_is_70_mips[BOARD_FCY_HZ == 70015000uL ? 1 : -1];
typedef char board_vco_is_in_range[BOARD_VCO_HZ >= 120000000uL && BOARD_VCO_HZ <= 340000000uL ? 1 : -1];
typedef char board_aclk_fits_the_pwm[BOARD_ACLK_HZ == 117920000uL ? 1 : -1];
typedef char board_pwm_is_that_of_the_core[BOARD_PTPER(BOARD_PWM_HZ) == HAL_PWM_PERIOD ? 1 : -1];
typedef char board_tick_is_whole_periods[BOARD_PWM_HZ == BOARD_PWM_PER_TICK * PT_TICK_RATE_HZ ? 1 : -1];
typedef char board_brg_of_921600[BOARD_BRG == 18u ? 1 : -1];
typedef char board_watchdog_outlasts_the_ramp[BOARD_WATCHDOG_MS == 256u ? 1 : -1];

/* In the order in which board_start() calls them. */
void board_output_off(void); /* before anything else */
void board_note_reset(void);
void board_clock(void);
void board_comparator(void);
void board_pwm(void);
void board_adc(void);
void board_uart(void);
void board_adc_follow_pwm(void);
void board_tick_start(void);

void board_start(void);
void board_check_clock(void); /* in every tick: off and a restart where a PLL has lost its lock */
uint16_t board_adc_noise(void); /* low bits of a software-triggered conversion of both converters */

#endif
