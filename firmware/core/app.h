/* The device: its states, its tick, its main loop. */
#ifndef PULSETRAINER_APP_H
#define PULSETRAINER_APP_H

#include <stdbool.h>
#include <stdint.h>

#include "frame.h"
#include "pid.h"
#include "protocol.h"
#include "safety.h"
#include "telemetry.h"
#include "wave.h"

#define APP_RAMP 15 /* 100 uA a tick: the full 1.5 A goes to zero in 100 ms */
#define APP_RAMP_TICKS 1001u

struct app_snapshot {
    uint32_t tick;
    int16_t reference;
    int16_t current;
    int16_t force;
    uint16_t duty;
    uint8_t state;
};

struct app {
    volatile uint8_t state;   /* PT_STATE_... */
    volatile uint8_t fault;   /* the first cause, latched until CLEAR_FAULT */
    volatile uint8_t worst;   /* the gravest since then */
    uint32_t beat;            /* the largest heartbeat counter since the greeting */
    int16_t current;          /* as just read */
    int16_t force;
    struct app_snapshot snapshot;
    volatile uint32_t tick;   /* of the session */
    uint8_t session;
    uint32_t nonce;
    bool greeted;
    bool in_tick;
    volatile bool ticked;     /* since the main loop last looked */
    int16_t reference;        /* after the slew limit: what the PID gets */
    uint16_t duty;
    int32_t param[PT_PARAM_COUNT];
    struct wave wave;
    struct pid pid;
    struct safety safety;
    struct telemetry telemetry;
    struct frame_decoder decoder;
    /* The last answered command and its reply, replayed when the command comes again. */
    bool reply_valid;
    uint8_t reply_to_type;
    uint8_t reply_to_seq;
    uint16_t reply_to_crc;
    uint8_t reply_type;
    uint8_t reply_length;
    uint8_t reply[PT_MAX_PAYLOAD];
};

extern struct app app;

void app_init(void);
void app_tick(void); /* 10 kHz, interrupt context */
void app_poll(void); /* main loop, as often as possible */

/* Commands: PT_NAK_CODE_... or 0. */
uint8_t app_wave_begin(uint32_t total, uint16_t ticks_per_sample, uint32_t crc);
uint8_t app_wave_data(uint32_t offset, const uint8_t *samples, uint8_t count);
uint8_t app_wave_commit(uint32_t count, uint32_t crc);
uint8_t app_arm(uint32_t nonce);
uint8_t app_start(void);
uint8_t app_stop(void);
uint8_t app_clear_fault(uint8_t fault, uint8_t worst);
void app_beat(uint32_t counter);
uint8_t app_coil_heat(uint16_t per_mille);
void app_greet(bool same_major);
uint8_t app_stream(uint16_t decimation);
uint8_t app_set_param(uint8_t id, int32_t value);

int32_t app_param_minimum(uint8_t id);
int32_t app_param_maximum(uint8_t id);

#endif
