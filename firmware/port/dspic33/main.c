/* The firmware of the dsPIC33EP64GS504: configuration bits and the main loop. */
#include "app.h"
#include "board.h"
#include "regs.h"

#ifndef XC_SHIM
#pragma config FNOSC = FRC      /* start on the FRC, board_clock() switches to its PLL */
#pragma config IESO = OFF
#pragma config POSCMD = NONE
#pragma config OSCIOFNC = ON
#pragma config FCKSM = CSECME   /* clock switching and the fail-safe monitor */
#pragma config PLLKEN = ON
#pragma config IOL1WAY = ON
#pragma config WDTEN = ON       /* from reset on, not to be switched off by software */
#pragma config WDTPRE = PR32    /* 32 kHz / 32 / 256: 256 ms */
#pragma config WDTPOST = PS256
#pragma config WINDIS = OFF
#pragma config PWMLOCK = OFF    /* erased it is ON: each write to IOCON1 and FCLCON1 would want a key first */
#pragma config JTAGEN = OFF
#pragma config ICS = PGD1
#endif

int main(void)
{
    board_start();
    for (;;)
        app_poll();
}
