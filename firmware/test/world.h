/* The whole firmware on the simulated device, at full speed and without a wire: the host's board, its plant, and a
 * host that feeds samples and beats. For programs that judge what the finger feels, not what is read. */
#ifndef PULSETRAINER_WORLD_H
#define PULSETRAINER_WORLD_H

#include <stdbool.h>
#include <stdint.h>

#include "solenoid.h"

typedef int16_t (*world_signal)(uint32_t sample); /* the reference at 1 kHz, 100 uA */

/* Power on, greet, upload, arm, start; false: refused. */
bool world_start(const struct solenoid_params *p, int32_t force_trip_mN, world_signal signal, uint32_t samples);
void world_tick(void); /* 100 us */
bool world_drives(void);

double world_force_N(void); /* the truth */
double world_current_A(void);

#endif
