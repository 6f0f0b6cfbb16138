/* UART1 at 921600 baud through two rings. Receiving interrupts the tick (a byte every 760 cycles, four of
 * them fit the hardware), sending waits for it. */
#include "board.h"
#include "frame.h"
#include "hal.h"
#include "regs.h"

#define RX_RING 256u /* powers of two */
#define TX_RING 512u
typedef char uart_takes_the_longest_frame[RX_RING > FRAME_MAX_ENCODED && TX_RING >= 2u * FRAME_MAX_ENCODED ? 1 : -1];

#define U1MODE_ON 0x8008u /* UARTEN, BRGH: four cycles a bit count; 8N1 */
#define U1STA_UTXEN 0x0400u
#define U1STA_UTXBF 0x0200u
#define U1STA_TRMT 0x0100u
#define U1STA_OERR 0x0002u
#define U1STA_URXDA 0x0001u

#define PPS_LOCK 0x40u /* IOLOCK in the low byte of OSCCON */
#define PPS_U1TX 1u
#define PPS_RP49 49u

static volatile uint8_t rx[RX_RING];
static volatile uint16_t rx_head; /* both run freely */
static volatile uint16_t rx_tail;
static volatile uint8_t tx[TX_RING];
static volatile uint16_t tx_head;
static volatile uint16_t tx_tail;

void board_uart(void)
{
    REG_WRITE(_ANSC0, 0);
    REG_WRITE(_ANSC1, 0);
    REG_WRITE(_TRISC0, 0);
    REG_WRITE(_TRISC1, 1);
    OSCCONL_WRITE(REG_READ(OSCCON) & 0xFFu & ~PPS_LOCK);
    REG_WRITE(_U1RXR, PPS_RP49);
    REG_WRITE(_RP48R, PPS_U1TX);
    OSCCONL_WRITE((REG_READ(OSCCON) & 0xFFu) | PPS_LOCK);
    REG_WRITE(U1MODE, 0);
    REG_WRITE(U1BRG, BOARD_BRG);
    REG_WRITE(U1STA, 0);
    REG_WRITE(U1MODE, U1MODE_ON);
    REG_WRITE(U1STA, U1STA_UTXEN);
    REG_WRITE(_U1RXIP, 6);
    REG_WRITE(_U1TXIP, 4);
    REG_WRITE(_U1RXIF, 0);
    REG_WRITE(_U1TXIF, 0);
    REG_WRITE(_U1RXIE, 1);
}

INTERRUPT(_U1RXInterrupt)
{
    REG_WRITE(_U1RXIF, 0);
    while (REG_READ(U1STA) & U1STA_URXDA) {
        uint8_t byte = (uint8_t)REG_READ(U1RXREG);
        /* No room: the frame is damaged, the host will send it again. */
        if ((uint16_t)(rx_head - rx_tail) < RX_RING) {
            rx[rx_head & (RX_RING - 1u)] = byte;
            rx_head = (uint16_t)(rx_head + 1u);
        }
    }
    /* After an overrun the receiver stands still until this bit is cleared. */
    if (REG_READ(U1STA) & U1STA_OERR)
        REG_WRITE(U1STA, U1STA_UTXEN);
}

INTERRUPT(_U1TXInterrupt)
{
    REG_WRITE(_U1TXIF, 0);
    while (tx_tail != tx_head && (REG_READ(U1STA) & U1STA_UTXBF) == 0) {
        REG_WRITE(U1TXREG, tx[tx_tail & (TX_RING - 1u)]);
        tx_tail = (uint16_t)(tx_tail + 1u);
    }
    if (tx_tail == tx_head)
        REG_WRITE(_U1TXIE, 0);
}

bool hal_uart_rx(uint8_t *byte)
{
    if (rx_tail == rx_head)
        return false;
    *byte = rx[rx_tail & (RX_RING - 1u)];
    rx_tail = (uint16_t)(rx_tail + 1u);
    return true;
}

uint16_t hal_uart_tx_space(void)
{
    return (uint16_t)(TX_RING - (uint16_t)(tx_head - tx_tail));
}

bool hal_uart_tx_idle(void)
{
    return tx_tail == tx_head && (REG_READ(U1STA) & U1STA_TRMT) != 0;
}

void hal_uart_tx(const uint8_t *bytes, uint16_t count)
{
    for (uint16_t k = 0; k < count; k++) {
        tx[tx_head & (TX_RING - 1u)] = bytes[k];
        tx_head = (uint16_t)(tx_head + 1u);
    }
    /* If the interrupt has just emptied the ring it runs once more for nothing, never once too little. */
    REG_WRITE(_U1TXIE, 1);
    REG_WRITE(_U1TXIF, 1);
}
