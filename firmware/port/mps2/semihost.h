/* Words to the emulator's standard output, for test programs; the firmware itself never uses it. */
#ifndef PULSETRAINER_MPS2_SEMIHOST_H
#define PULSETRAINER_MPS2_SEMIHOST_H

#include <stdint.h>

void semihost_say(const char *text);
void semihost_hex(uint32_t value);
void semihost_decimal(uint32_t value);
void semihost_exit(int status) __attribute__((noreturn));

#endif
