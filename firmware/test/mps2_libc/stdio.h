/* The one function of it that the unit tests use, for the emulated Cortex-M4F: %s, %d and %ld only. */
#ifndef PULSETRAINER_MPS2_STDIO_H
#define PULSETRAINER_MPS2_STDIO_H

int printf(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
