#include "app.h"

#include "commands.h"
#include "control.h"
#include "hal.h"
#include "link.h"

void app_init(void)
{
    control_init();
    commands_init();
    link_init();
}

void app_tick(void)
{
    control_tick();
}

void app_poll(void)
{
    control_watch();
    link_poll();
    if (control_is_alive()) /* the tick has run since the last time: both contexts are */
        hal_watchdog_feed();
}
