/* What the unit tests use of it, for the emulated Cortex-M4F; the rest is in port/mps2/memory.c. */
#ifndef PULSETRAINER_MPS2_STRING_H
#define PULSETRAINER_MPS2_STRING_H

#include <stddef.h>

void *memcpy(void *restrict to, const void *restrict from, size_t count);
void *memset(void *to, int value, size_t count);
int memcmp(const void *a, const void *b, size_t count);
void *memchr(const void *in, int value, size_t count);

#endif
