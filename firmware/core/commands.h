/* What a host may ask, checked: ranges, order, versions. Returns a NAK code or 0. Main loop only. */
#ifndef PULSETRAINER_COMMANDS_H
#define PULSETRAINER_COMMANDS_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol.h"

/* Main only. */
struct commands {
    uint32_t nonce;   /* of this start */
    uint32_t beat;    /* the largest heartbeat counter since the greeting */
    bool greeted;     /* by a host of the same major version */
    int32_t param[PT_PARAM_COUNT];
};
extern struct commands commands;

void commands_init(void);
void commands_greet(uint8_t major, uint8_t minor);
void commands_beat(uint32_t counter);
uint8_t commands_wave_begin(uint32_t total, uint16_t ticks_per_sample, uint32_t crc);
uint8_t commands_wave_data(uint32_t offset, const uint8_t *samples, uint8_t count);
uint8_t commands_arm(uint32_t nonce);
uint8_t commands_stream(uint16_t decimation);
uint8_t commands_set_param(uint8_t id, int32_t value);
uint8_t commands_coil_heat(uint16_t per_mille);

int32_t commands_param_minimum(uint8_t id);
int32_t commands_param_maximum(uint8_t id);

#endif
