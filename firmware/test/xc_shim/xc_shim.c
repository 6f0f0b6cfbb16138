#include "xc_shim.h"

#include <stdio.h>
#include <stdlib.h>

#define LOG 65536
#define FIFO 4u

#define DEFINE(name, reset) volatile uint16_t name = (reset);
XC_SHIM_REGISTERS(DEFINE)
#undef DEFINE

static struct xc_shim_entry entries[LOG];
static int32_t count;
static volatile uint16_t *stuck;
static int32_t polls;
static const uint8_t *rx_bytes;
static uint16_t rx_left;
static uint8_t sent[4096];
static uint16_t sent_count;
static uint16_t in_fifo;
static int early;
static int unready;
static int locked;
static uint32_t noise = 1;

void _U1RXInterrupt(void);
void _U1TXInterrupt(void);
void _ADCAN2Interrupt(void);
void _T1Interrupt(void);

void xc_shim_reset(uint16_t rcon)
{
#define RESET_ONE(name, reset) name = (reset);
    XC_SHIM_REGISTERS(RESET_ONE)
#undef RESET_ONE
    RCON = rcon;
    count = 0;
    stuck = NULL;
    rx_left = 0;
    sent_count = 0;
    in_fifo = 0;
    early = 0;
    unready = 0;
    locked = 0;
}

void xc_shim_lock_pwm(void)
{
    locked = 1;
    polls = 0;
}

void xc_shim_forget(void)
{
    count = 0;
}

int32_t xc_shim_count(void)
{
    return count;
}

const struct xc_shim_entry *xc_shim_entry(int32_t at)
{
    return &entries[at];
}

void xc_shim_wait_for_ever(volatile uint16_t *reg)
{
    stuck = reg;
    polls = 0;
}

static void fail(const char *what, const char *name)
{
    printf("register shim: %s %s\n", what, name);
    exit(3);
}

/* What the hardware answers to a write. */
static void react(volatile uint16_t *reg, uint16_t value)
{
    if (reg == &OSCCON && (value & 1u)) {
        _COSC = value >> 8;
        _LOCK = 1;
        OSCCON = (uint16_t)((value & 0xFFFEu) | (((uint32_t)value << 4) & 0x7000u));
    } else if (reg == &ACLKCON) {
        _APLLCK = value >> 15;
    } else if (reg == &_C0PWR || reg == &_C2PWR) {
        if (!(ADCON1L & 0x8000u))
            fail("powered before the converter was switched on:", "core");
        *(reg == &_C0PWR ? &_C0RDY : &_C2RDY) = value;
    } else if (reg == &_C0EN || reg == &_C2EN) {
        if (value && !(reg == &_C0EN ? _C0RDY : _C2RDY))
            fail("enabled before it was ready:", "core");
    } else if (reg == &_CAL0RUN || reg == &_CAL2RUN) {
        if (!(reg == &_CAL0RUN ? _CAL0EN && _C0EN : _CAL2EN && _C2EN))
            fail("calibrated before it was enabled:", "core");
        *(reg == &_CAL0RUN ? &_CAL0RDY : &_CAL2RDY) = value;
    } else if (reg == &_SWCTRG) {
        noise = noise * 1664525u + 1013904223u;
        ADCBUF0 = (uint16_t)(noise >> 30);
        ADCBUF2 = (uint16_t)(0x200u + (noise >> 28 & 3u));
        _AN0RDY = 1;
        _AN2RDY = 1;
    } else if (reg == &U1TXREG) {
        if (sent_count < sizeof sent)
            sent[sent_count++] = (uint8_t)value;
        if (++in_fifo == FIFO)
            U1STA |= 0x0200u;
        U1STA &= 0xFEFFu;
    }
}

void xc_shim_write(volatile uint16_t *reg, const char *name, uint16_t value)
{
    if (count == LOG)
        fail("log is full at", name);
    entries[count].name = name;
    entries[count].value = value;
    count++;
    uint16_t status = U1STA & 0x0301u; /* read-only */
    if (locked && (reg == &IOCON1 || reg == &FCLCON1))
        return;
    *reg = value;
    if (reg == &U1STA)
        U1STA = (uint16_t)((value & ~0x0301u) | status);
    react(reg, value);
}

uint16_t xc_shim_read(volatile uint16_t *reg)
{
    if ((reg == stuck || (locked && reg == &IOCON1)) && ++polls > 1000)
        fail("waits for ever:", "the watchdog resets the device here");
    if (reg == stuck)
        return 0;
    if (reg == &U1RXREG && rx_left > 0) {
        uint8_t byte = *rx_bytes++;
        if (--rx_left == 0)
            U1STA &= 0xFFFEu;
        return byte;
    }
    if (reg == &ADCBUF0)
        _AN0RDY = 0;
    if (reg == &ADCBUF2)
        _AN2RDY = 0;
    if (early && reg == &_LOCK) { /* between clearing the tick's flag and the end of the tick */
        early = 0;
        _ADCAN2IF = 1;
    }
    return *reg;
}

void xc_shim_receive(const uint8_t *bytes, uint16_t n)
{
    rx_bytes = bytes;
    rx_left = n;
    if (n == 0)
        return;
    U1STA |= 1u;
    _U1RXIF = 1;
    if (_U1RXIE)
        _U1RXInterrupt();
}

uint16_t xc_shim_sent(uint8_t *bytes, uint16_t most)
{
    while (_U1TXIE && _U1TXIF) {
        in_fifo = 0;
        U1STA &= 0xFDFFu;
        _U1TXInterrupt();
        if (in_fifo)
            _U1TXIF = 1; /* the hardware: there is room again */
    }
    U1STA |= 0x0100u;
    uint16_t n = sent_count < most ? sent_count : most;
    for (uint16_t k = 0; k < n; k++)
        bytes[k] = sent[k];
    sent_count = 0;
    return n;
}

void xc_shim_overrun(void)
{
    U1STA |= 2u;
    _U1RXIF = 1;
    _U1RXInterrupt();
}

void xc_shim_tick(uint16_t current, uint16_t force)
{
    ADCBUF0 = current;
    ADCBUF2 = force;
    _AN0RDY = (uint16_t)!unready;
    _AN2RDY = 1;
    _ADCAN2IF = 1;
    if (_ADCAN2IE)
        _ADCAN2Interrupt();
}

void xc_shim_no_tick(void)
{
    _T1IF = 1;
    if (_T1IE)
        _T1Interrupt();
}

void xc_shim_unready(void)
{
    unready = 1;
}

void xc_shim_next_conversion_early(void)
{
    early = 1;
}
