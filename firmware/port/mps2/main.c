/* The firmware as an image for the emulated Cortex-M4F.
 *
 * Idles in a busy loop: waiting for interrupts would let the emulator's clock jump. */
#include "app.h"
#include "board.h"

int main(void)
{
    board_init();
    app_init();
    board_start_tick();
    for (;;) {
        board_main_loop();
        app_poll();
        board_send();
    }
}
