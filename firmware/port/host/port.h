/* Between the files of the host port: the simulated board, its clock, its end of the pty. */
#ifndef PULSETRAINER_PORT_H
#define PULSETRAINER_PORT_H

#include <stdbool.h>
#include <stdint.h>

#include "solenoid.h"

/* board.c: the hardware behind the HAL. */
void board_number(unsigned long number);        /* its serial number; otherwise that of the seed */
void board_init(const struct solenoid_params *p, uint8_t reset_cause);
void board_tick(void);                          /* one 100 us tick: interrupt, then the plant */
void board_receive(const uint8_t *bytes, int32_t count);
int32_t board_receive_room(void);
bool board_received(void);                      /* bytes wait for the main loop */
const uint8_t *board_to_send(int32_t *count);   /* a contiguous piece of the transmit ring */
void board_sent(int32_t count);
bool board_break(const char *what_at);          /* "force-frozen@0.5": false when it means nothing */
void board_list_breaks(void);
bool board_main_loop_runs(void);                /* false once "hang" has struck */
bool board_hangs(void);
uint64_t board_ticks(void);                     /* since power-on */
const struct solenoid *board_world(void);       /* the truth, which the firmware cannot see */

/* pace.c: how many ticks may run now. */
enum pace_speed { PACE_REAL, PACE_MAX, PACE_STEADY };
void pace_init(enum pace_speed speed, int64_t now_ns);
int32_t pace_ticks(int64_t now_ns);                    /* may run at once */
int32_t pace_wait_ms(int64_t now_ns);                  /* when pace_ticks is 0: until it may change; -1: for ever */

#endif
