/* A main loop that hangs: the watchdog first takes the output away, then restarts the board, and the next
 * start knows why. Prints one line per start: the reset cause, the boot nonce, the number of missed ticks. */
#include "app.h"
#include "board.h"
#include "hal.h"
#include "protocol.h"
#include "semihost.h"

int main(void)
{
    board_init();
    app_init();
    semihost_decimal(hal_reset_cause());
    semihost_say(" ");
    semihost_hex(hal_boot_nonce());
    board_start_tick();
    uint32_t begun = board_cycles();
    while (board_cycles() - begun < 25000000u) /* a second of good health */
        app_poll();
    semihost_say(" ");
    semihost_decimal(board_missed());
    semihost_say("\n");
    if (hal_reset_cause() == PT_RESET_WATCHDOG)
        semihost_exit(0);
    for (;;) {
    }
}
