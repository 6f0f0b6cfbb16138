/* A test is a function; CHECK names what failed and goes on, main's status is the number of failures. */
#ifndef PULSETRAINER_CHECK_H
#define PULSETRAINER_CHECK_H

#include <stdio.h>

static int check_failures;

#define CHECK(condition)                                                              \
    do {                                                                              \
        if (!(condition)) {                                                           \
            printf("%s:%d: in %s: %s\n", __FILE__, __LINE__, __func__, #condition);   \
            check_failures++;                                                         \
        }                                                                             \
    } while (0)

#define CHECK_EQUAL(got, expected)                                                    \
    do {                                                                              \
        long check_got = (long)(got), check_expected = (long)(expected);              \
        if (check_got != check_expected) {                                            \
            printf("%s:%d: in %s: %s is %ld, expected %ld\n", __FILE__, __LINE__,     \
                   __func__, #got, check_got, check_expected);                        \
            check_failures++;                                                         \
        }                                                                             \
    } while (0)

#define RUN(test)                                                                     \
    do {                                                                              \
        int check_before = check_failures;                                            \
        test();                                                                       \
        printf("%s %s\n", check_failures == check_before ? "ok  " : "FAIL", #test);   \
    } while (0)

#define CHECK_DONE() return check_failures != 0

#endif
