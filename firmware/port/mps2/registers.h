/* Peripherals of the mps2-an386 that the port uses: Arm's CMSDK UART, timers and watchdog, and the core's own. */
#ifndef PULSETRAINER_MPS2_REGISTERS_H
#define PULSETRAINER_MPS2_REGISTERS_H

#include <stdint.h>

#define CLOCK_HZ 25000000u

struct cmsdk_timer {
    volatile uint32_t control; /* 1: run; 8: interrupt */
    volatile uint32_t value;   /* counts down */
    volatile uint32_t reload;
    volatile uint32_t interrupt; /* write 1 to clear */
};
#define TIMER_RUN 1u
#define TIMER_INTERRUPT 8u

struct cmsdk_uart {
    volatile uint32_t data;
    volatile uint32_t state;
    volatile uint32_t control;
    volatile uint32_t interrupt; /* write 1 to clear */
    volatile uint32_t divider;
};
#define UART_TX_FULL 1u
#define UART_RX_FULL 2u
#define UART_TX_ENABLE 1u
#define UART_RX_ENABLE 2u
#define UART_RX_INTERRUPT_ENABLE 8u
#define UART_RX_INTERRUPT 2u

struct cmsdk_watchdog {
    volatile uint32_t load; /* writing it starts the count anew */
    volatile uint32_t value;
    volatile uint32_t control; /* 1: NMI when it first runs out; 2: reset when it does so again */
    volatile uint32_t clear;
};
#define WATCHDOG_INTERRUPT 1u
#define WATCHDOG_RESET 2u
#define WATCHDOG_UNLOCK 0x1ACCE551u

#define TIMER0 ((struct cmsdk_timer *)0x40000000u)
#define TIMER1 ((struct cmsdk_timer *)0x40001000u)
#define UART0 ((struct cmsdk_uart *)0x40004000u)
#define WATCHDOG ((struct cmsdk_watchdog *)0x40008000u)
#define WATCHDOG_LOCK (*(volatile uint32_t *)0x40008C00u)

/* Its first half. */
struct cmsdk_dual_timer {
    volatile uint32_t load; /* writing it starts the count anew */
    volatile uint32_t value;
    volatile uint32_t control;
    volatile uint32_t clear;
};
#define DUAL_TIMER_32_BITS 0x02u
#define DUAL_TIMER_INTERRUPT 0x20u
#define DUAL_TIMER_PERIODIC 0x40u
#define DUAL_TIMER_RUN 0x80u
#define DUAL_TIMER ((struct cmsdk_dual_timer *)0x40002000u)

#define IRQ_UART0_RX 0u
#define IRQ_TIMER0 8u
#define IRQ_DUAL_TIMER 10u
#define NVIC_ENABLE (*(volatile uint32_t *)0xE000E100u)
#define NVIC_PRIORITY ((volatile uint8_t *)0xE000E400u)
#define SCB_RESET (*(volatile uint32_t *)0xE000ED0Cu)
#define SCB_RESET_REQUEST 0x05FA0004u

#endif
