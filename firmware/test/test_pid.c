#include "check.h"
#include "pid.h"
#include "protocol.h"

#define FULL 7853u

static const int32_t initial[PT_PARAM_COUNT] = {
#define ROW(name, id, minimum, start, maximum) [id] = start,
    PT_PARAMETERS(ROW)
#undef ROW
};
static const int32_t largest[PT_PARAM_COUNT] = {
#define ROW(name, id, minimum, start, maximum) [id] = maximum,
    PT_PARAMETERS(ROW)
#undef ROW
};

static void set(struct pid *p, const int32_t *gains)
{
    p->gains.kp = gains[PT_PARAM_PID_KP];
    p->gains.ki = gains[PT_PARAM_PID_KI];
    p->gains.feed_resistance = gains[PT_PARAM_FEED_RESISTANCE];
    p->gains.feed_inductance = gains[PT_PARAM_FEED_INDUCTANCE];
    p->gains.feed_offset = gains[PT_PARAM_FEED_OFFSET];
    pid_reset(p);
}

/* A coil of 5 ohm and 20 mH at 12 V, current in units of 100 uA scaled by 4096; two ticks of filter. */
struct coil {
    int64_t current;
    int16_t delayed[2];
};

static int16_t coil_step(struct coil *c, uint16_t on)
{
    int64_t microvolts = (int64_t)on * 12000000 / (int64_t)FULL - (int64_t)(FULL - on) * 600000 / (int64_t)FULL;
    int64_t drop = c->current * 5 * 100 / 4096;                 /* microvolts: 5 ohm times 100 uA */
    c->current += (microvolts - drop) * 4096 / 20000;           /* 100 us / 20 mH, in 100 uA */
    if (c->current < 0)
        c->current = 0;
    int16_t seen = c->delayed[0];
    c->delayed[0] = c->delayed[1];
    c->delayed[1] = (int16_t)(c->current / 4096);
    return seen;
}

static void holds_a_constant_reference(void)
{
    struct pid p;
    struct coil c = {0, {0, 0}};
    int16_t seen = 0;
    set(&p, initial);
    for (int k = 0; k < 2000; k++)
        seen = coil_step(&c, pid_step(&p, 10000, seen, FULL));
    CHECK(seen > 9990 && seen < 10010);
}

static void follows_the_steepest_pulse_within_one_percent(void)
{
    /* Up in 100 ms, down in 100 ms, 0..1.5 A, the integrator not warmed up. */
    struct pid p;
    struct coil c = {0, {0, 0}};
    int16_t seen = 0;
    int32_t worst = 0;
    set(&p, initial);
    for (int k = 0; k < 20000; k++) {
        int32_t phase = k % 2000;
        int16_t reference = (int16_t)(phase < 1000 ? 15 * phase : 15 * (2000 - phase));
        int32_t error = (int32_t)reference - seen;
        worst = error > worst ? error : -error > worst ? -error : worst;
        seen = coil_step(&c, pid_step(&p, reference, seen, FULL));
    }
    printf("     worst error %ld of 15000\n", (long)worst);
    CHECK(worst < 150);
}

static void does_not_wind_up(void)
{
    /* A second at full drive without reaching the reference, then a reachable one: back within 5 ms. */
    struct pid p;
    struct coil c = {0, {0, 0}};
    int16_t seen = 0;
    set(&p, initial);
    for (int k = 0; k < 10000; k++) {
        uint16_t on = pid_step(&p, 15000, seen, FULL);
        seen = coil_step(&c, (uint16_t)(on / 2u)); /* a sagging supply */
    }
    int16_t worst = 0;
    for (int k = 0; k < 400; k++) {
        seen = coil_step(&c, pid_step(&p, 5000, seen, FULL));
        if (k >= 200 && seen > worst)
            worst = seen;
    }
    CHECK(worst < 5500);
}

static void no_input_overflows(void)
{
    /* Run under -fsanitize=undefined: an overflow would be reported. */
    struct pid p;
    const int16_t references[3] = {0, 7500, 15000};
    const int16_t readings[3] = {0, 15000, 20000};
    set(&p, largest);
    for (int k = 0; k < 30000; k++) {
        uint16_t on = pid_step(&p, references[(k / 500) % 3], readings[(k / 700) % 3], FULL);
        CHECK(on <= FULL);
    }
}

int main(void)
{
    RUN(holds_a_constant_reference);
    RUN(follows_the_steepest_pulse_within_one_percent);
    RUN(does_not_wind_up);
    RUN(no_input_overflows);
    CHECK_DONE();
}
