#include "semihost.h"

#define SYS_WRITE0 0x04u
#define SYS_EXIT_EXTENDED 0x20u
#define APPLICATION_EXIT 0x20026u

static void call(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
}

void semihost_say(const char *text)
{
    call(SYS_WRITE0, text);
}

void semihost_hex(uint32_t value)
{
    char text[9];
    for (int k = 7; k >= 0; k--) {
        text[k] = "0123456789abcdef"[value & 15u];
        value >>= 4;
    }
    text[8] = '\0';
    semihost_say(text);
}

void semihost_decimal(uint32_t value)
{
    char text[11];
    int k = 10;
    text[k] = '\0';
    do {
        text[--k] = (char)('0' + value % 10u);
        value /= 10u;
    } while (value > 0);
    semihost_say(text + k);
}

void semihost_exit(int status)
{
    const uint32_t block[2] = {APPLICATION_EXIT, (uint32_t)status};
    for (;;)
        call(SYS_EXIT_EXTENDED, block);
}
