/* The firmware as a port calls it. */
#ifndef PULSETRAINER_APP_H
#define PULSETRAINER_APP_H

void app_init(void); /* with the output off and the first readings there */
void app_tick(void); /* 10 kHz, interrupt context */
void app_poll(void); /* main loop, as often as possible */

#endif
