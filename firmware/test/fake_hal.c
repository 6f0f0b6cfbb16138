#include "fake_hal.h"

#include <string.h>

#include "app.h"
#include "control.h"
#include "hal.h"
#include "units.h"

struct fake fake;
void (*fake_after_tick)(void);
void (*fake_on_critical)(bool enter);

static uint8_t rx[1024];
static uint16_t rx_head, rx_tail;
static struct frame_decoder host;
static uint8_t reply_bytes[PT_MAX_PAYLOAD];
static struct frame reply;
static uint8_t blocks[512][PT_MAX_PAYLOAD];
static uint8_t block_length[512];
static uint16_t block_head, block_tail;
static uint8_t next_seq;
static uint32_t beats;
static struct hal_kept kept;

void fake_reset(void)
{
    memset(&fake, 0, sizeof fake);
    fake.force_current = fake.force_force = -1;
    fake.tx_space = 4096;
    fake.nonce = 0xC0FFEEu;
    rx_head = rx_tail = 0;
    block_head = block_tail = 0;
    frame_decoder_init(&host);
    beats = 0;
    app_init();
    (void)heat_tell(&control.safety.heat, 0);
}

static void coil_step(void)
{
    /* 12 V, 5 ohm, 20 mH: 0.08 units a tick per PWM count, 2.5 % loss a tick. */
    int32_t drive = fake.pwm_enabled ? (int32_t)fake.pwm * 20 : 0;
    fake.current += drive - fake.current / 40;
}

void fake_ticks_without_main(uint32_t n)
{
    for (uint32_t k = 0; k < n; k++) {
        app_tick();
        if (fake_after_tick != NULL)
            fake_after_tick();
        coil_step();
    }
}

void fake_ticks(uint32_t n)
{
    for (uint32_t k = 0; k < n; k++) {
        fake_ticks_without_main(1);
        app_poll();
    }
}

bool fake_output_on(void)
{
    return fake.pwm_enabled && fake.pwm > 0;
}

void fake_wire(const uint8_t *bytes, uint16_t count)
{
    for (uint16_t k = 0; k < count; k++)
        rx[rx_head++ % sizeof rx] = bytes[k];
}

void fake_receive(const uint8_t *bytes, uint16_t count)
{
    fake_wire(bytes, count);
    app_poll();
}

struct frame fake_command_seq(uint8_t type, uint8_t seq, const uint8_t *payload, uint8_t length)
{
    uint8_t wire[FRAME_MAX_ENCODED];
    uint16_t n = frame_encode(wire, type, seq, payload, length, true);
    for (uint16_t k = 0; k < n; k++)
        rx[rx_head++ % sizeof rx] = wire[k];
    memset(&reply, 0, sizeof reply);
    app_poll();
    return reply;
}

struct frame fake_command(uint8_t type, const uint8_t *payload, uint8_t length)
{
    return fake_command_seq(type, ++next_seq, payload, length);
}

struct frame fake_beat(void)
{
    uint8_t p[PT_HEARTBEAT_LEN];
    put_u32(p + PT_HEARTBEAT_COUNTER, ++beats);
    return fake_command(PT_HEARTBEAT, p, sizeof p);
}

struct frame fake_clear_fault(void)
{
    const uint8_t p[PT_CLEAR_FAULT_LEN] = {control.fault, control.worst};
    return fake_command(PT_CLEAR_FAULT, p, sizeof p);
}

uint16_t fake_telemetry(uint8_t *payload)
{
    if (block_tail == block_head)
        return 0;
    uint16_t length = block_length[block_tail % 512u];
    memcpy(payload, blocks[block_tail++ % 512u], length);
    return length;
}

/* 14 N from 1.5 A on and 2 N at 0.5 A, straight between and to zero; a count is 4.4 mN. */
static int32_t force_counts(int32_t current_counts)
{
    if (current_counts > 3072)
        current_counts = 3072;
    return current_counts < 1024 ? current_counts * 455 / 1024 : 455 + (current_counts - 1024) * 4 / 3;
}

bool hal_adc_read(struct hal_adc *out)
{
    static uint16_t dither;
    if (fake.nest_read && control.in_tick) {
        fake.nest_read = false;
        app_tick();
    }
    dither ^= 1u;
    int32_t counts = fake.current / 256 * 4095 / 20000;
    out->current = (uint16_t)(fake.force_current >= 0 ? fake.force_current : counts);
    /* The force of the as-built device at the first rise, about; never two equal readings, like a living converter. */
    out->force = (uint16_t)(fake.force_force >= 0 ? fake.force_force : 228 + force_counts(counts) + dither);
    return !fake.stale;
}

void hal_pwm_enable(void)
{
    fake.pwm_enabled = true;
}

void hal_pwm_set(uint16_t on_counts)
{
    if (fake.nest_set && control.in_tick) {
        fake.nest_set = false;
        app_tick();
    }
    fake.pwm = on_counts;
}

bool hal_comparator(void)
{
    return fake.comparator;
}

bool hal_tick_lost(void)
{
    bool was = fake.tick_lost;
    fake.tick_lost = false;
    return was;
}

void hal_pwm_kill(void)
{
    fake.pwm_enabled = false;
    fake.pwm = 0;
    fake.kills++;
}

bool hal_tick_overrun(void)
{
    bool was = fake.overrun;
    fake.overrun = false;
    return was;
}

bool hal_uart_rx(uint8_t *byte)
{
    if (rx_head == rx_tail)
        return false;
    *byte = rx[rx_tail++ % sizeof rx];
    return true;
}

uint16_t hal_uart_tx_space(void)
{
    return fake.tx_space;
}

bool hal_uart_tx_idle(void)
{
    return true;
}

void hal_uart_tx(const uint8_t *bytes, uint16_t count)
{
    struct frame f;
    for (uint16_t k = 0; k < count; k++) {
        if (!frame_decode(&host, bytes[k], &f))
            continue;
        if (f.type == PT_TELEMETRY || f.type == PT_TELEMETRY_DUTY) {
            block_length[block_head % 512u] = f.length;
            memcpy(blocks[block_head++ % 512u], f.payload, f.length);
        } else {
            memcpy(reply_bytes, f.payload, f.length);
            reply = f;
            reply.payload = reply_bytes;
        }
    }
}

void hal_watchdog_feed(void)
{
    fake.fed++;
}

void hal_critical_enter(void)
{
    if (fake_on_critical != NULL)
        fake_on_critical(true);
}

void hal_critical_exit(void)
{
    if (fake_on_critical != NULL)
        fake_on_critical(false);
}

struct hal_kept *hal_kept(void)
{
    return &kept;
}

uint8_t hal_reset_cause(void)
{
    return fake.reset_cause;
}

uint32_t hal_boot_nonce(void)
{
    return fake.nonce;
}

uint32_t hal_build_hash(void)
{
    return 0x12345678u;
}

const char *hal_serial(void)
{
    return "SIXTEEN-LETTERS!";
}
