/* The output stage of a simulated device, between the PWM and the coil: the switch, the comparator that cuts the
 * current cycle by cycle without any software, and what breaks there. */
#ifndef PULSETRAINER_DRIVER_H
#define PULSETRAINER_DRIVER_H

#include <stdbool.h>
#include <stdint.h>

#include "solenoid.h"

void driver_reset(void);
void driver_enable(void);
void driver_off(void);
void driver_set(uint16_t on_counts);
bool driver_cut(void); /* the comparator has cut the current since the last call */

/* 100 us of the world. */
void driver_step(struct solenoid *plant, uint16_t period_counts);

#endif
