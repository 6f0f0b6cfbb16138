/* The unit tests on the emulated Cortex-M4F: what they need of a C library, and an end with their status. */
#include <stdarg.h>
#include <stdint.h>

#include "semihost.h"
#include "stdio.h"
#include "string.h"

int test_main(void); /* the test program's main */
void uart0_rx_handler(void);
void timer0_handler(void);
void dual_timer_handler(void);
void nmi_handler(void);
void fault_handler(void);

int memcmp(const void *a, const void *b, size_t count)
{
    const uint8_t *x = a;
    const uint8_t *y = b;
    for (; count > 0; count--, x++, y++)
        if (*x != *y)
            return *x < *y ? -1 : 1;
    return 0;
}

void *memchr(const void *in, int value, size_t count)
{
    uint8_t *at = (uint8_t *)(uintptr_t)in;
    for (; count > 0; count--, at++)
        if (*at == (uint8_t)value)
            return at;
    return NULL;
}

static void say_number(long value)
{
    if (value < 0)
        semihost_say("-");
    semihost_decimal(value < 0 ? 0u - (uint32_t)value : (uint32_t)value);
}

int printf(const char *format, ...)
{
    char one[2] = {0, 0};
    va_list values;
    va_start(values, format);
    for (; *format != '\0'; format++) {
        if (*format != '%') {
            one[0] = *format;
            semihost_say(one);
            continue;
        }
        format++;
        if (*format == 's') {
            semihost_say(va_arg(values, const char *));
        } else if (*format == 'd') {
            say_number(va_arg(values, int));
        } else { /* ld */
            format++;
            say_number(va_arg(values, long));
        }
    }
    va_end(values);
    return 0;
}

int main(void)
{
    semihost_exit(test_main());
}

static void lost(void)
{
    semihost_say("an exception that nobody expected\n");
    semihost_exit(99);
}

void uart0_rx_handler(void)
{
    lost();
}

void timer0_handler(void)
{
    lost();
}

void dual_timer_handler(void)
{
    lost();
}

void nmi_handler(void)
{
    lost();
}

void fault_handler(void)
{
    lost();
}
