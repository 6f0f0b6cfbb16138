/* Vectors and reset. The floating-point unit comes first: a C prologue may already save its registers. */
    .syntax unified
    .cpu cortex-m4
    .thumb

    .section .vectors, "a"
    .word stack_top
    .word reset_handler
    .word nmi_handler /* the watchdog's first bite */
    .rept 13          /* faults and system exceptions */
    .word fault_handler
    .endr
    .word uart0_rx_handler /* interrupt 0 */
    .rept 7
    .word fault_handler
    .endr
    .word timer0_handler /* interrupt 8 */
    .word fault_handler
    .word dual_timer_handler /* interrupt 10 */
    .rept 21
    .word fault_handler
    .endr

    .text
    .thumb_func
    .global reset_handler
    .type reset_handler, %function
reset_handler:
    ldr r0, =0xE000ED88 /* CPACR: full access to coprocessors 10 and 11 */
    ldr r1, [r0]
    orr r1, r1, #0xF00000
    str r1, [r0]
    dsb
    isb

    ldr r0, =data_start
    ldr r1, =data_end
    ldr r2, =data_load
copy:
    cmp r0, r1
    bhs clear
    ldr r3, [r2], #4
    str r3, [r0], #4
    b copy
clear:
    ldr r0, =bss_start
    ldr r1, =bss_end
    movs r3, #0
zero:
    cmp r0, r1
    bhs run
    str r3, [r0], #4
    b zero
run:
    bl main
    b fault_handler /* main never returns */
    .size reset_handler, . - reset_handler
    .pool
