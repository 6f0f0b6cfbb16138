/* Ids, payload layouts and limits of the wire protocol.
 * Made from pulsetrainer/device/messages.py by `make -C firmware header`; a test keeps the two equal. */
#ifndef PULSETRAINER_PROTOCOL_H
#define PULSETRAINER_PROTOCOL_H

#include <stdint.h>


#ifndef PT_PROTOCOL_MAJOR
#define PT_PROTOCOL_MAJOR 1u
#endif
#ifndef PT_PROTOCOL_MINOR
#define PT_PROTOCOL_MINOR 0u
#endif
#ifndef PT_FIRMWARE_MAJOR
#define PT_FIRMWARE_MAJOR 0u
#endif
#ifndef PT_FIRMWARE_MINOR
#define PT_FIRMWARE_MINOR 1u
#endif
#ifndef PT_FIRMWARE_PATCH
#define PT_FIRMWARE_PATCH 0u
#endif

#define PT_MAGIC 0x52545031uL
#define PT_MAX_PAYLOAD 128u
#define PT_TICK_RATE_HZ 10000u
#define PT_WAVE_BUFFER_SAMPLES 1024u
#define PT_MAX_TICKS_PER_SAMPLE 10000u
#define PT_MAX_DECIMATION 10000u
#define PT_HEARTBEAT_MAX_MS 200u
#define PT_FLAG_LAST 1u
#define PT_FLAG_SLEW 2u

/* what the device is doing */
#define PT_STATE_IDLE 0u
#define PT_STATE_ARMED 1u
#define PT_STATE_RUNNING 2u
#define PT_STATE_RAMPING 3u
#define PT_STATE_FAULT 4u

/* first cause of a latched fault */
#define PT_FAULT_NONE 0u
#define PT_FAULT_HEARTBEAT 1u
#define PT_FAULT_OVER_CURRENT 2u
#define PT_FAULT_OVER_FORCE 3u
#define PT_FAULT_UNDERRUN 4u
#define PT_FAULT_COIL_HEAT 5u
#define PT_FAULT_ON_TIME 6u
#define PT_FAULT_CURRENT_RAIL 7u
#define PT_FAULT_FORCE_RAIL 8u
#define PT_FAULT_CURRENT_FROZEN 9u
#define PT_FAULT_FORCE_FROZEN 10u
#define PT_FAULT_NO_CURRENT 11u
#define PT_FAULT_NO_FORCE 12u
#define PT_FAULT_TICK_OVERRUN 13u
#define PT_FAULT_WAVE_CRC 14u
#define PT_FAULT_STRAY_CURRENT 15u

/* why a command was refused */
#define PT_NAK_CODE_UNKNOWN 1u
#define PT_NAK_CODE_LENGTH 2u
#define PT_NAK_CODE_STATE 3u
#define PT_NAK_CODE_RANGE 4u
#define PT_NAK_CODE_OFFSET 5u
#define PT_NAK_CODE_CREDIT 6u
#define PT_NAK_CODE_VERSION 7u
#define PT_NAK_CODE_NONCE 8u
#define PT_NAK_CODE_CRC 9u
#define PT_NAK_CODE_FAULT 10u
#define PT_NAK_CODE_PARAM 11u

/* why the device last started */
#define PT_RESET_POWER 0u
#define PT_RESET_EXTERNAL 1u
#define PT_RESET_WATCHDOG 2u
#define PT_RESET_BROWN_OUT 3u
#define PT_RESET_SOFTWARE 4u

/* parameters: X(NAME, id, minimum, default, absolute maximum) */
#define PT_PARAMETERS(X) \
    X(CURRENT_LIMIT, 0, 0, 15000, 15000) \
    X(CURRENT_TRIP, 1, 0, 16500, 16500) \
    X(FORCE_TRIP, 2, 0, 15000, 15000) \
    X(SLEW_LIMIT, 3, 1, 150, 150) \
    X(ON_TIME, 4, 1, 900, 900) \
    X(HEARTBEAT, 5, 20, 200, 200) \
    X(PID_KP, 6, 0, 7680, 32767) \
    X(PID_KI, 7, 0, 3680, 32767) \
    X(FEED_RESISTANCE, 8, 0, 20423, 65535) \
    X(FEED_INDUCTANCE, 9, 0, 3191, 65535) \
    X(FEED_OFFSET, 10, 0, 374, 1000)
#define PT_PARAM_CURRENT_LIMIT 0u
#define PT_PARAM_CURRENT_TRIP 1u
#define PT_PARAM_FORCE_TRIP 2u
#define PT_PARAM_SLEW_LIMIT 3u
#define PT_PARAM_ON_TIME 4u
#define PT_PARAM_HEARTBEAT 5u
#define PT_PARAM_PID_KP 6u
#define PT_PARAM_PID_KI 7u
#define PT_PARAM_FEED_RESISTANCE 8u
#define PT_PARAM_FEED_INDUCTANCE 9u
#define PT_PARAM_FEED_OFFSET 10u
#define PT_PARAM_COUNT 11u

/* messages: type id, offset of each field, length of the fixed part */

#define PT_HELLO 0x01u
#define PT_HELLO_MAGIC 0u
#define PT_HELLO_MAJOR 4u
#define PT_HELLO_MINOR 5u
#define PT_HELLO_LEN 6u

#define PT_STATUS 0x02u
#define PT_STATUS_LEN 0u

#define PT_HEARTBEAT 0x03u
#define PT_HEARTBEAT_LEN 0u

#define PT_GET_PARAM 0x04u
#define PT_GET_PARAM_ID 0u
#define PT_GET_PARAM_LEN 1u

#define PT_SET_PARAM 0x05u
#define PT_SET_PARAM_ID 0u
#define PT_SET_PARAM_VALUE 1u
#define PT_SET_PARAM_LEN 5u

#define PT_WAVE_BEGIN 0x06u
#define PT_WAVE_BEGIN_TOTAL 0u
#define PT_WAVE_BEGIN_TICKS_PER_SAMPLE 4u
#define PT_WAVE_BEGIN_CRC32 6u
#define PT_WAVE_BEGIN_LEN 10u

#define PT_WAVE_DATA 0x07u
#define PT_WAVE_DATA_OFFSET 0u
#define PT_WAVE_DATA_COUNT 4u
#define PT_WAVE_DATA_LEN 5u
#define PT_WAVE_DATA_ITEM 2u
#define PT_WAVE_DATA_MAX_ITEMS 61u

#define PT_WAVE_COMMIT 0x08u
#define PT_WAVE_COMMIT_COUNT 0u
#define PT_WAVE_COMMIT_CRC32 4u
#define PT_WAVE_COMMIT_LEN 8u

#define PT_ARM 0x09u
#define PT_ARM_NONCE 0u
#define PT_ARM_LEN 4u

#define PT_START 0x0Au
#define PT_START_LEN 0u

#define PT_STOP 0x0Bu
#define PT_STOP_LEN 0u

#define PT_CLEAR_FAULT 0x0Cu
#define PT_CLEAR_FAULT_LEN 0u

#define PT_STREAM 0x0Du
#define PT_STREAM_DECIMATION 0u
#define PT_STREAM_LEN 2u

#define PT_HELLO_REPLY 0x81u
#define PT_HELLO_REPLY_MAGIC 0u
#define PT_HELLO_REPLY_MAJOR 4u
#define PT_HELLO_REPLY_MINOR 5u
#define PT_HELLO_REPLY_FIRMWARE_MAJOR 6u
#define PT_HELLO_REPLY_FIRMWARE_MINOR 7u
#define PT_HELLO_REPLY_FIRMWARE_PATCH 8u
#define PT_HELLO_REPLY_BUILD_HASH 9u
#define PT_HELLO_REPLY_CAPABILITIES 13u
#define PT_HELLO_REPLY_RX_WINDOW 17u
#define PT_HELLO_REPLY_TICK_RATE_HZ 19u
#define PT_HELLO_REPLY_WAVE_BUFFER 23u
#define PT_HELLO_REPLY_CURRENT_LIMIT 25u
#define PT_HELLO_REPLY_CURRENT_TRIP 27u
#define PT_HELLO_REPLY_FORCE_TRIP 29u
#define PT_HELLO_REPLY_SLEW_LIMIT 31u
#define PT_HELLO_REPLY_ON_TIME_S 33u
#define PT_HELLO_REPLY_HEARTBEAT_MS 35u
#define PT_HELLO_REPLY_RESET_CAUSE 37u
#define PT_HELLO_REPLY_BOOT_NONCE 38u
#define PT_HELLO_REPLY_SERIAL 42u
#define PT_HELLO_REPLY_LEN 58u

#define PT_STATUS_REPLY 0x82u
#define PT_STATUS_REPLY_STATE 0u
#define PT_STATUS_REPLY_FAULT 1u
#define PT_STATUS_REPLY_SESSION 2u
#define PT_STATUS_REPLY_TICK 3u
#define PT_STATUS_REPLY_PRODUCED 7u
#define PT_STATUS_REPLY_DROPPED 11u
#define PT_STATUS_REPLY_FAULT_TICK 15u
#define PT_STATUS_REPLY_FAULT_REFERENCE 19u
#define PT_STATUS_REPLY_FAULT_CURRENT 21u
#define PT_STATUS_REPLY_FAULT_FORCE 23u
#define PT_STATUS_REPLY_FAULT_DUTY 25u
#define PT_STATUS_REPLY_FAULT_STATE 27u
#define PT_STATUS_REPLY_RESET_CAUSE 28u
#define PT_STATUS_REPLY_BOOT_NONCE 29u
#define PT_STATUS_REPLY_LEN 33u

#define PT_ACK 0x83u
#define PT_ACK_CREDIT 0u
#define PT_ACK_STATE 2u
#define PT_ACK_FAULT 3u
#define PT_ACK_SESSION 4u
#define PT_ACK_TICK 5u
#define PT_ACK_PRODUCED 9u
#define PT_ACK_LEN 13u

#define PT_NAK 0x84u
#define PT_NAK_CODE 0u
#define PT_NAK_COMMAND 1u
#define PT_NAK_STATE 2u
#define PT_NAK_FAULT 3u
#define PT_NAK_LEN 4u

#define PT_PARAM_REPLY 0x85u
#define PT_PARAM_REPLY_ID 0u
#define PT_PARAM_REPLY_VALUE 1u
#define PT_PARAM_REPLY_MINIMUM 5u
#define PT_PARAM_REPLY_MAXIMUM 9u
#define PT_PARAM_REPLY_LEN 13u

#define PT_TELEMETRY 0x90u
#define PT_TELEMETRY_SESSION 0u
#define PT_TELEMETRY_FLAGS 1u
#define PT_TELEMETRY_FIRST_TICK 2u
#define PT_TELEMETRY_DROPPED 6u
#define PT_TELEMETRY_COUNT 8u
#define PT_TELEMETRY_LEN 9u
#define PT_TELEMETRY_ITEM 6u
#define PT_TELEMETRY_MAX_ITEMS 19u

/* commands: X(NAME, bytes of one item of the counted tail or 0) */
#define PT_COMMANDS(X) \
    X(HELLO, 0) \
    X(STATUS, 0) \
    X(HEARTBEAT, 0) \
    X(GET_PARAM, 0) \
    X(SET_PARAM, 0) \
    X(WAVE_BEGIN, 0) \
    X(WAVE_DATA, 2) \
    X(WAVE_COMMIT, 0) \
    X(ARM, 0) \
    X(START, 0) \
    X(STOP, 0) \
    X(CLEAR_FAULT, 0) \
    X(STREAM, 0)

#endif
