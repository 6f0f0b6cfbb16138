/* The firmware as a process of this computer, on a pty.
 *
 *   firmware [--ideal] [--set NAME=VALUE]... [--speed max|steady|real] [--break WHAT@SECONDS]... [--serial N] [--leash]
 *   firmware --list          the plant's parameters and what can be broken
 *
 * Prints the pty's path on its first line and serves it until the host program closes it. --leash: also
 * ends when standard input does, that is, when the program that started it is gone, however it went.
 * Exit status: 0 the host left, 2 bad arguments, 3 no pty. */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "app.h"
#include "plant.h"
#include "port.h"
#include "protocol.h"

static int master = -1;
static int slave = -1; /* ours until the host has spoken: without any slave open the pty reports a hang-up */
static bool leash;

static int64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static int list(void)
{
    for (int32_t k = 0; k < plant_parameter_count; k++)
        printf("%s\t%s\t%.9g\t%.9g\t%s\n", plant_parameters[k].name, plant_parameters[k].unit,
               plant_parameters[k].low, plant_parameters[k].high, plant_parameters[k].meaning);
    printf("\n");
    board_list_breaks();
    return 0;
}

static int complain(const char *what, const char *argument)
{
    fprintf(stderr, "%s: %s\n", what, argument);
    return 2;
}

static int set_parameter(struct solenoid_params *p, char *assignment)
{
    char *equals = strchr(assignment, '=');
    if (equals == NULL)
        return complain("expected NAME=VALUE", assignment);
    *equals = '\0';
    char *end = NULL;
    double value = strtod(equals + 1, &end);
    int result = end == equals + 1 || *end != '\0' ? -2 : solenoid_set(p, assignment, value);
    *equals = '=';
    if (result == 0)
        return 0;
    return complain(result == -1 ? "no such parameter" : "outside its range", assignment);
}

static int open_pty(void)
{
    struct termios raw;
    master = posix_openpt(O_RDWR | O_NOCTTY);
    if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0)
        return -1;
    const char *path = ptsname(master);
    if (path == NULL || (slave = open(path, O_RDWR | O_NOCTTY)) < 0)
        return -1;
    if (tcgetattr(slave, &raw) != 0)
        return -1;
    raw.c_iflag = 0;
    raw.c_oflag = 0;
    raw.c_lflag = 0;
    raw.c_cflag = CS8 | CREAD | CLOCAL;
    if (tcsetattr(slave, TCSANOW, &raw) != 0 || fcntl(master, F_SETFL, O_NONBLOCK) != 0)
        return -1;
    printf("%s\n", path);
    return fflush(stdout);
}

/* False when the host has left. */
static bool read_host(void)
{
    uint8_t bytes[1024];
    int32_t room = board_receive_room();
    if (room == 0)
        return true;
    ssize_t n = read(master, bytes, room < (int32_t)sizeof bytes ? (size_t)room : sizeof bytes);
    if (n > 0) {
        if (slave >= 0) {
            (void)close(slave);
            slave = -1;
        }
        board_receive(bytes, (int32_t)n);
        return true;
    }
    return n < 0 && (errno == EAGAIN || errno == EINTR);
}

static void write_host(void)
{
    int32_t count;
    const uint8_t *bytes;
    while (bytes = board_to_send(&count), count > 0) {
        ssize_t n = write(master, bytes, (size_t)count);
        if (n <= 0)
            return;
        board_sent((int32_t)n);
    }
}

/* False when the program at the other end of the leash is gone. */
static bool wait_host(int32_t timeout_ms)
{
    int32_t pending;
    (void)board_to_send(&pending);
    struct pollfd f[2];
    f[0].fd = master;
    f[0].events = (short)(POLLIN | (pending > 0 ? POLLOUT : 0));
    f[1].fd = leash ? STDIN_FILENO : -1;
    f[1].events = POLLIN;
    f[0].revents = f[1].revents = 0;
    if (poll(f, 2, timeout_ms) <= 0 || f[1].revents == 0)
        return true;
    char ignored[64];
    return read(STDIN_FILENO, ignored, sizeof ignored) > 0;
}

static void serve(void)
{
    for (uint32_t round = 0;; round++) {
        if (!read_host())
            return;
        if (board_main_loop_runs())
            do
                app_poll();
            while (board_received());
        write_host();
        int32_t n = pace_ticks(now_ns());
        for (int32_t k = 0; k < n; k++)
            board_tick();
        /* In full flight look at the leash only now and then: it is one more system call. */
        if (n == 0 ? !wait_host(pace_wait_ms(now_ns())) : (round % 256u == 0 && !wait_host(0)))
            return;
    }
}

int main(int argc, char **argv)
{
    static struct solenoid_params params;
    enum pace_speed speed = PACE_MAX;
    solenoid_as_built(&params);
    for (int k = 1; k < argc; k++) {
        const char *option = argv[k];
        char *value = k + 1 < argc ? argv[k + 1] : NULL;
        if (strcmp(option, "--list") == 0) {
            return list();
        } else if (strcmp(option, "--ideal") == 0) {
            solenoid_ideal(&params);
        } else if (strcmp(option, "--leash") == 0) {
            leash = true;
        } else if (strcmp(option, "--set") == 0 && value != NULL) {
            if (set_parameter(&params, argv[++k]) != 0)
                return 2;
        } else if (strcmp(option, "--serial") == 0 && value != NULL) {
            board_number(strtoul(argv[++k], NULL, 10) % 100000000u);
        } else if (strcmp(option, "--break") == 0 && value != NULL) {
            if (!board_break(argv[++k]))
                return complain("nothing to break", value);
        } else if (strcmp(option, "--speed") == 0 && value != NULL) {
            k++;
            if (strcmp(value, "real") == 0)
                speed = PACE_REAL;
            else if (strcmp(value, "steady") == 0)
                speed = PACE_STEADY;
            else if (strcmp(value, "max") != 0)
                return complain("speed is max, steady or real, not", value);
        } else {
            return complain("unknown option", option);
        }
    }
    board_init(&params, PT_RESET_POWER);
    if (open_pty() != 0) {
        perror("no pty");
        return 3;
    }
    pace_init(speed, now_ns());
    serve();
    return 0;
}
