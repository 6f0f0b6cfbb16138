/* Stands in for the vendor's header on this computer: registers that log every write and answer as the
 * hardware would. Written by us; it knows names and resets, nothing of addresses. */
#ifndef PULSETRAINER_XC_SHIM_H
#define PULSETRAINER_XC_SHIM_H

#include <stdint.h>

#define XC_SHIM 1

/* X(NAME, value at reset). PENH and PENL are set at reset, as on the device. */
#define XC_SHIM_REGISTERS(X)                                                                              \
    X(OSCCON, 0) X(PLLFBD, 0x30) X(_PLLPRE, 0) X(_PLLPOST, 1) X(_COSC, 0) X(_LOCK, 0)                     \
    X(ACLKCON, 0) X(_APLLCK, 0) X(RCON, 0)                                                                \
    X(_LATA4, 1) X(_TRISA4, 1) X(_ANSA0, 1) X(_ANSA1, 1) X(_ANSA2, 1)                                     \
    X(_ANSC0, 1) X(_ANSC1, 1) X(_TRISC0, 1) X(_TRISC1, 1) X(_U1RXR, 0) X(_RP48R, 0)                       \
    X(PTCON, 0) X(PTCON2, 0) X(PTPER, 0xFFF8) X(PWMCON1, 0) X(IOCON1, 0xC000) X(FCLCON1, 0)               \
    X(PDC1, 0) X(PHASE1, 0) X(DTR1, 0) X(ALTDTR1, 0) X(TRIG1, 0) X(TRGCON1, 0) X(LEBCON1, 0)              \
    X(LEBDLY1, 0) X(CMP1CON, 0) X(CMP1DAC, 0)                                                             \
    X(ADCON1L, 0) X(ADCON1H, 0x0060) X(ADCON2L, 0) X(ADCON2H, 0) X(ADCON3L, 0) X(ADCON3H, 0)              \
    X(ADCON4L, 0) X(ADCON4H, 0) X(ADCON5H, 0) X(ADCORE0L, 0) X(ADCORE0H, 0x0300)                          \
    X(ADCORE2L, 0) X(ADCORE2H, 0x0300) X(ADMOD0L, 0) X(ADTRIG0L, 0) X(ADTRIG0H, 0) X(ADIEL, 0)            \
    X(_C0PWR, 0) X(_C0RDY, 0) X(_C0EN, 0) X(_C2PWR, 0) X(_C2RDY, 0) X(_C2EN, 0)                           \
    X(_CAL0EN, 0) X(_CAL0DIFF, 0) X(_CAL0RUN, 0) X(_CAL0RDY, 0)                                           \
    X(_CAL2EN, 0) X(_CAL2DIFF, 0) X(_CAL2RUN, 0) X(_CAL2RDY, 0)                                           \
    X(_SWCTRG, 0) X(_AN0RDY, 0) X(_AN2RDY, 0) X(ADCBUF0, 0) X(ADCBUF2, 0)                                               \
    X(_ADCAN2IP, 4) X(_ADCAN2IF, 0) X(_ADCAN2IE, 0)                                                       \
    X(T1CON, 0) X(TMR1, 0) X(PR1, 0xFFFF) X(_T1IF, 0) X(_T1IP, 4) X(_T1IE, 0) X(_AC1IF, 0)                                                     \
    X(U1MODE, 0) X(U1STA, 0x0110) X(U1BRG, 0) X(U1RXREG, 0) X(U1TXREG, 0)                                 \
    X(_U1RXIP, 4) X(_U1RXIF, 0) X(_U1RXIE, 0) X(_U1TXIP, 4) X(_U1TXIF, 0) X(_U1TXIE, 0)                   \
    X(WATCHDOG, 0) X(RESET, 0)

#define XC_SHIM_DECLARE(name, reset) extern volatile uint16_t name;
XC_SHIM_REGISTERS(XC_SHIM_DECLARE)
#undef XC_SHIM_DECLARE

void xc_shim_write(volatile uint16_t *reg, const char *name, uint16_t value);
uint16_t xc_shim_read(volatile uint16_t *reg);

#define REG_WRITE(reg, value) xc_shim_write(&(reg), #reg, (uint16_t)(value))
#define REG_READ(reg) xc_shim_read(&(reg))
#define OSCCONH_WRITE(value) REG_WRITE(OSCCON, ((uint16_t)(value) << 8) | (OSCCON & 0xFFu))
#define OSCCONL_WRITE(value) REG_WRITE(OSCCON, ((uint16_t)(value) & 0xFFu) | (OSCCON & 0xFF00u))
#define INTERRUPT(name) void name(void); void name(void)
#define PERSISTENT
#define MEMORY_BARRIER() ((void)0)
#define RESET_DEVICE() REG_WRITE(RESET, 1)
#define ClrWdt() REG_WRITE(WATCHDOG, 1)
#define Nop() ((void)0)

#endif
