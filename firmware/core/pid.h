/* The current loop: PI with feed-forward of the coil's resistance and inductance, in integers. */
#ifndef PULSETRAINER_PID_H
#define PULSETRAINER_PID_H

#include <stdint.h>

struct pid_gains {
    int32_t kp;              /* PWM counts per 4096 units of error; a unit is 100 uA */
    int32_t ki;              /* PWM counts per 65536 units of error, each tick */
    int32_t feed_resistance; /* PWM counts per 65536 units of reference */
    int32_t feed_inductance; /* PWM counts per 256 units of change of the reference in a tick */
    int32_t feed_offset;     /* PWM counts while the reference is not zero: the free-wheeling diode */
};

struct pid {
    struct pid_gains gains;
    int32_t integral;        /* PWM counts times 65536 */
    int16_t last_reference;
};

void pid_reset(struct pid *p);

/* One tick; returns PWM counts 0..full. The integral stands still while the output is at an end and
 * the error would push it further (anti-windup). */
uint16_t pid_step(struct pid *p, int16_t reference, int16_t measured, uint16_t full);

#endif
