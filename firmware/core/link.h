/* Frames in, replies and telemetry out; a repeated command is answered from memory. Main loop only. */
#ifndef PULSETRAINER_LINK_H
#define PULSETRAINER_LINK_H

void link_init(void);
void link_poll(void);

#endif
