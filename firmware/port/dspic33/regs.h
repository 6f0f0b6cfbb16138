/* Access to registers: plain on the device, through functions that log where test/xc_shim stands in for
 * the vendor's header. Names that begin with an underscore are single fields of a register, as the vendor's
 * header defines them: it knows their positions, and the compiler sets one bit without touching its
 * neighbours, which an interrupt may be changing. */
#ifndef PULSETRAINER_REGS_H
#define PULSETRAINER_REGS_H

#include <stdint.h>
#include <xc.h>

#ifndef XC_SHIM
#define REG_WRITE(reg, value) ((void)((reg) = (value)))
#define REG_READ(reg) ((uint16_t)(reg))
#define INTERRUPT(name) void __attribute__((interrupt, auto_psv)) name(void)
#define PERSISTENT __attribute__((persistent)) /* not cleared at start-up */
#define MEMORY_BARRIER() __asm__ volatile("" ::: "memory")
#define RESET_DEVICE() __asm__ volatile("reset")
#define OSCCONH_WRITE(value) __builtin_write_OSCCONH((unsigned char)(value)) /* with the unlock sequence */
#define OSCCONL_WRITE(value) __builtin_write_OSCCONL((unsigned char)(value))
#endif

#endif
