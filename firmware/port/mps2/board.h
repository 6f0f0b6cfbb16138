/* The mps2-an386 with the simulated solenoid on its PWM and ADC. */
#ifndef PULSETRAINER_MPS2_BOARD_H
#define PULSETRAINER_MPS2_BOARD_H

#include <stdint.h>

#define BOARD_TICK_CYCLES 2500u /* 10 kHz from 25 MHz */

void board_init(void);       /* everything but the tick; the output is off */
void board_start_tick(void); /* from here on the control interrupt runs */
void board_tick(void);       /* what it does: the firmware's tick, then 100 us of the world */
void board_main_loop(void);  /* once a pass: does not return where the main loop is to hang */
void board_world(void);      /* the 100 us alone */
void board_send(void);       /* main loop: hand what waits to the UART */
uint32_t board_cycles(void); /* of 40 ns, free-running */
uint32_t board_missed(void); /* ticks that were missed since power-on */

#endif
