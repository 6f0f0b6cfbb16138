#include "check.h"
#include "safety.h"

static struct safety s;
static struct safety_input in;
static struct hal_kept kept;

#define WINDOW (SAFETY_VOLTAGE_TICKS - 2) /* its turn comes second */

/* A current, and the duty that the nominal coil needs for it. */
static void drive(int16_t current_100uA)
{
    in.current_100uA = current_100uA;
    in.duty_counts = (uint16_t)(374 + current_100uA * 20423L / 65536);
}

/* What takes turns is told a few ticks sooner or later. */
static bool near(int32_t got, int32_t expected, int32_t by)
{
    return got >= expected - by && got <= expected + by;
}

static void normal(void)
{
    static const struct safety_limits limits = {16500, 15000, 2000, 9000000, PT_DEFAULT_FEED_RESISTANCE, PT_DEFAULT_FEED_INDUCTANCE};
    safety_init(&s, &kept, true, 0);
    (void)heat_tell(&s.heat, 0);
    safety_begin(&s, &limits);
    in.reference_100uA = 5000;
    drive(5000);
    in.force_mN = 3000;
    in.current_counts = 1024;
    in.force_counts = 910;
    in.full_counts = 7853;
    in.comparator = false;
    in.armed = true;
    in.awaited = true;
    in.driving = true;
}

/* Ticks until a fault, its id in *fault; readings dither by a count like living converters. */
static int32_t until_fault(int32_t at_most, uint8_t *fault, bool current_lives, bool force_lives)
{
    for (int32_t k = 1; k <= at_most; k++) {
        if (current_lives)
            in.current_counts ^= 1u;
        if (force_lives)
            in.force_counts ^= 1u;
        *fault = safety_tick(&s, &in);
        if (*fault != PT_FAULT_NONE)
            return k;
    }
    return 0;
}

static void nothing_wrong_nothing_found(void)
{
    uint8_t fault = 0;
    normal();
    s.limits.heartbeat_ticks = 60000;
    CHECK_EQUAL(until_fault(50000, &fault, true, true), 0);
}

static void one_sample_of_over_current_trips(void)
{
    normal();
    in.current_100uA = 16500;
    CHECK_EQUAL(safety_tick(&s, &in), PT_FAULT_NONE);
    in.current_100uA = 16501;
    CHECK_EQUAL(safety_tick(&s, &in), PT_FAULT_OVER_CURRENT);
    CHECK_EQUAL(safety_gravity(PT_FAULT_OVER_CURRENT), 2);
}

static void three_samples_of_over_force_trip(void)
{
    uint8_t fault = 0;
    normal();
    in.force_mN = 15001;
    CHECK_EQUAL(until_fault(10, &fault, true, true), 3);
    CHECK_EQUAL(fault, PT_FAULT_OVER_FORCE);
}

/* The over-force counter forgets slowly: what is above for more than a third of the time trips. */
static void now_and_then_over_force_trips_too(void)
{
    static const int16_t often[] = {16500, 16500, 14900};
    static const int16_t half[] = {15100, 14900};
    static const int16_t seldom[] = {16500, 14900, 14900, 14900};
    uint8_t fault = PT_FAULT_NONE;
    int32_t k = 0;
    normal();
    for (; k < 100 && fault == PT_FAULT_NONE; k++) {
        in.force_mN = often[k % 3];
        fault = safety_tick(&s, &in);
    }
    CHECK_EQUAL(fault, PT_FAULT_OVER_FORCE);
    CHECK_EQUAL(k, 5);
    normal();
    for (fault = PT_FAULT_NONE, k = 0; k < 100 && fault == PT_FAULT_NONE; k++) {
        in.force_mN = half[k % 2];
        fault = safety_tick(&s, &in);
    }
    CHECK_EQUAL(fault, PT_FAULT_OVER_FORCE);
    normal(); /* one wild sample in four does not */
    drive(15000);
    s.limits.heartbeat_ticks = 60000;
    for (k = 0; k < 1000; k++) {
        in.force_mN = seldom[k % 4];
        in.current_counts ^= 1u;
        CHECK_EQUAL(safety_tick(&s, &in), PT_FAULT_NONE);
    }
}

static void silence_trips_after_the_heartbeat_time(void)
{
    uint8_t fault = 0;
    normal();
    CHECK_EQUAL(until_fault(10000, &fault, true, true), 2001);
    CHECK_EQUAL(fault, PT_FAULT_HEARTBEAT);
    CHECK_EQUAL(safety_gravity(fault), SAFETY_RAMPS);
    normal();
    for (int k = 0; k < 10; k++) {
        CHECK_EQUAL(until_fault(1999, &fault, true, true), 0);
        safety_alive(&s);
    }
    normal();
    in.armed = in.awaited = in.driving = false;
    in.current_100uA = 0;
    CHECK_EQUAL(until_fault(10000, &fault, true, true), 0);
}

static void rails_trip(void)
{
    uint8_t fault = 0;
    normal();
    in.force_counts = 0;
    CHECK_EQUAL(until_fault(10, &fault, true, false), SAFETY_RAIL_DEBOUNCE);
    CHECK_EQUAL(fault, PT_FAULT_FORCE_RAIL);
    normal();
    in.force_counts = 4095;
    CHECK_EQUAL(until_fault(10, &fault, true, false), SAFETY_RAIL_DEBOUNCE);
    CHECK_EQUAL(fault, PT_FAULT_FORCE_RAIL);
}

static void a_frozen_current_reading_trips_once_the_reference_moves(void)
{
    uint8_t fault = 0;
    normal();
    CHECK_EQUAL(until_fault(1500, &fault, false, true), 0); /* constant reference: may well be constant */
    int32_t ticks = 0;
    for (; ticks < 200 && fault == PT_FAULT_NONE; ticks++) {
        in.reference_100uA = (int16_t)(in.reference_100uA + 15);
        in.force_counts ^= 1u;
        fault = safety_tick(&s, &in);
    }
    CHECK_EQUAL(fault, PT_FAULT_CURRENT_FROZEN);
    CHECK(ticks < 50);
}

/* Under a constant reference it is the integral that moves: half a count a tick for a reading two counts low. */
static void a_frozen_current_reading_trips_as_the_loop_winds_up(void)
{
    uint8_t fault = 0;
    int32_t ticks = 0;
    normal();
    uint16_t duty = in.duty_counts;
    in.current_100uA = 4990;
    for (; ticks < 2000 && fault == PT_FAULT_NONE; ticks++) {
        in.duty_counts = (uint16_t)(duty + ticks * 56 / 100);
        in.force_counts ^= 1u;
        fault = safety_tick(&s, &in);
    }
    CHECK_EQUAL(fault, PT_FAULT_CURRENT_FROZEN);
    CHECK(ticks < 730);
    CHECK(in.duty_counts - duty <= SAFETY_FROZEN_DUTY_COUNTS + 3); /* 0.12 A of the true current */
}

/* Mean duty of `percent` of what the compiled coil needs: until the fault in at most two windows, 0 if none. */
static int32_t voltage(int16_t current_100uA, int32_t percent)
{
    uint8_t fault = 0;
    normal();
    s.limits.heartbeat_ticks = 60000;
    drive(current_100uA);
    in.reference_100uA = current_100uA;
    in.force_mN = (int16_t)(current_100uA < 10000 ? current_100uA : 13000);
    in.duty_counts = (uint16_t)(374 + (in.duty_counts - 374) * percent / 100);
    int32_t ticks = until_fault(4096, &fault, true, true);
    CHECK(ticks == 0 || fault == PT_FAULT_CURRENT_IMPLAUSIBLE);
    return ticks;
}

/* Up to 10 ohm at 9 V: the bounds go with what the run takes for the coil. */
static void the_voltage_has_to_fit_the_coil_of_the_run(void)
{
    static const int32_t ohms[] = {4 * PT_DEFAULT_FEED_RESISTANCE / 5, 2 * PT_DEFAULT_FEED_RESISTANCE, 53600};
    static const int16_t percents[] = {60, 100, 150, 200, 20};
    for (uint16_t k = 0; k < 3; k++) {
        for (uint16_t j = 0; j < 5; j++) {
            uint8_t fault = 0;
            normal();
            safety_begin(&s, &(const struct safety_limits){16500, 15000, 60000, 9000000, ohms[k], PT_DEFAULT_FEED_INDUCTANCE});
            in.reference_100uA = 7000;
            drive(7000);
            in.force_mN = 6500;
            in.duty_counts = (uint16_t)(374 + (7000 * ohms[k] >> 16) * percents[j] / 100);
            int32_t ticks = until_fault(4096, &fault, true, true);
            bool wrong = percents[j] == 200 || (percents[j] == 20 && k > 0); /* where k is 0 that is within a diode's spread */
            CHECK_EQUAL(ticks, wrong ? WINDOW : 0);
            CHECK(ticks == 0 || fault == PT_FAULT_CURRENT_IMPLAUSIBLE);
        }
    }
}

/* A full stroke within the window takes what the coil's inductance asks for and no more. */
static void a_stroke_through_a_coil_of_more_inductance_is_honest(void)
{
    static const int32_t henries[] = {PT_DEFAULT_FEED_INDUCTANCE, 7900, 15900, 21000};
    for (uint16_t k = 0; k < 4; k++) {
        int32_t allowed = henries[k] < 7980 ? SAFETY_VOLTAGE_SPAN_COUNTS : henries[k] * 15 / 524 + SAFETY_VOLTAGE_DIODE_COUNTS;
        for (int32_t beyond = 0; beyond < 2; beyond++) {
            uint8_t fault = 0;
            normal();
            safety_begin(&s, &(const struct safety_limits){16500, 15000, 60000, 9000000, 10000, henries[k]});
            in.reference_100uA = 7000;
            drive(7000);
            in.force_mN = 6500;
            in.duty_counts = (uint16_t)(374 + (7000 * 15500 >> 16) + allowed + beyond);
            CHECK_EQUAL(until_fault(4096, &fault, true, true), beyond ? WINDOW : 0);
        }
    }
}

static void the_voltage_has_to_fit_the_current(void)
{
    for (int16_t current = 3000; current <= 15000; current = (int16_t)(current + 1000)) {
        CHECK_EQUAL(voltage(current, 153), 0);     /* copper 80 K warmer, coil + 5 %, supply - 10 % */
        CHECK_EQUAL(voltage(current, 51), 0);      /* twice the supply */
        CHECK_EQUAL(voltage(current, 200), WINDOW); /* a gain that lost half */
    }
    CHECK_EQUAL(voltage(15000, 20), WINDOW); /* a reading far too high */
    CHECK_EQUAL(voltage(500, 300), 0);     /* 50 mA: lost in a diode's spread, and harmless */
}

/* From 0.3 A on up, the reading standing at what it was: the stroke in 100 uA until the fault. */
static int16_t frozen_stroke(int16_t force_trip_mN)
{
    uint8_t fault = PT_FAULT_NONE;
    normal();
    safety_begin(&s, &(const struct safety_limits){16500, force_trip_mN, 60000, 9000000, PT_DEFAULT_FEED_RESISTANCE, PT_DEFAULT_FEED_INDUCTANCE});
    in.force_mN = (int16_t)(force_trip_mN - 10); /* at which no floor speaks first */
    int16_t k = 0;
    for (; k <= 12000 && fault == PT_FAULT_NONE; k = (int16_t)(k + 10)) {
        drive((int16_t)(3000 + k));
        in.reference_100uA = in.current_100uA;
        in.current_counts ^= 1u;
        fault = safety_tick(&s, &in);
    }
    CHECK_EQUAL(fault, PT_FAULT_FORCE_FROZEN);
    return k;
}

static void a_frozen_force_reading_trips_after_a_stroke(void)
{
    CHECK(near(frozen_stroke(15000), 9010, 40));
    CHECK(near(frozen_stroke(8000), 6210, 40));
    CHECK(near(frozen_stroke(3000), 4210, 40));
}

/* A reading that falls to zero in one tick has moved the current by a stroke; a force that happens to give the
 * same count twice is not frozen for that. The cause to be named is the current. */
static void a_lost_current_reading_is_not_blamed_on_the_force(void)
{
    uint8_t fault = PT_FAULT_NONE;
    normal();
    in.current_100uA = in.reference_100uA = 13567;
    in.duty_counts = 4573;
    CHECK_EQUAL(until_fault(10, &fault, true, true), 0);
    in.current_100uA = 0;
    in.current_counts = 0;
    CHECK(near(until_fault(1000, &fault, false, false), SAFETY_NO_CURRENT_TICKS, SAFETY_TURNS));
    CHECK_EQUAL(fault, PT_FAULT_NO_CURRENT);
}

static void full_drive_without_current_trips(void)
{
    uint8_t fault = 0;
    normal();
    in.duty_counts = in.full_counts;
    in.current_100uA = 1000;
    CHECK(near(until_fault(1000, &fault, true, true), SAFETY_WEAK_TICKS, SAFETY_TURNS));
    CHECK_EQUAL(fault, PT_FAULT_NO_CURRENT);
    normal();
    in.duty_counts = (uint16_t)(in.full_counts / 4u + 1u);
    in.current_100uA = 0;
    CHECK(near(until_fault(1000, &fault, true, true), SAFETY_NO_CURRENT_TICKS, SAFETY_TURNS + 1));
    CHECK_EQUAL(fault, PT_FAULT_NO_CURRENT);
}

static int32_t until_force_fault(int16_t force_trip_mN, int16_t current_100uA, int16_t force_mN, uint8_t *fault)
{
    normal();
    safety_begin(&s, &(const struct safety_limits){16500, force_trip_mN, 60000, 9000000, PT_DEFAULT_FEED_RESISTANCE, PT_DEFAULT_FEED_INDUCTANCE});
    drive(current_100uA);
    in.reference_100uA = current_100uA;
    in.force_mN = force_mN;
    return until_fault(10000, fault, true, true);
}

static void a_dead_force_sensor_is_found_where_the_trip_is_in_reach(void)
{
    uint8_t fault = 0;
    CHECK(until_force_fault(15000, 14000, 0, &fault) <= 800);
    CHECK_EQUAL(fault, PT_FAULT_NO_FORCE);
    CHECK(until_force_fault(15000, 6000, 0, &fault) <= 1000);
    CHECK_EQUAL(fault, PT_FAULT_NO_FORCE);
    CHECK(until_force_fault(3000, 3500, 0, &fault) <= 1200); /* 1 N of the 3 N */
    CHECK_EQUAL(fault, PT_FAULT_NO_FORCE);
    CHECK_EQUAL(until_force_fault(15000, 3500, -500, &fault), 0); /* a drifted zero: too little to judge by */
}

static void a_force_sensor_that_reads_half_is_found_at_the_trip(void)
{
    static const int16_t at_trip[][2] = {{3000, 5800}, {8000, 8400}}; /* mN; 100 uA at which that is the true force */
    uint8_t fault = 0;
    for (uint16_t k = 0; k < 2; k++) {
        CHECK(until_force_fault(at_trip[k][0], at_trip[k][1], (int16_t)(at_trip[k][0] / 2), &fault) > 0);
        CHECK_EQUAL(fault, PT_FAULT_FORCE_IMPLAUSIBLE);
        CHECK_EQUAL(until_force_fault(at_trip[k][0], at_trip[k][1], (int16_t)(at_trip[k][0] * 8 / 10), &fault), 0);
    }
}

static void too_much_force_for_the_current_is_found(void)
{
    uint8_t fault = 0;
    CHECK(until_force_fault(15000, 1000, 6000, &fault) > 0);
    CHECK_EQUAL(fault, PT_FAULT_FORCE_IMPLAUSIBLE);
    CHECK_EQUAL(until_force_fault(15000, 1000, 2500, &fault), 0);
}

/* Pulses of which none is long enough by itself: 20 ms of each half second at 1.2 A. */
static void no_force_is_counted_across_pulses(void)
{
    uint8_t fault = PT_FAULT_NONE;
    int32_t k = 0;
    normal();
    s.limits.heartbeat_ticks = 60000;
    in.force_mN = 0;
    for (; k < 60000 && fault == PT_FAULT_NONE; k++) {
        bool peak = k % 5000 < 600;
        drive(peak ? 12000 : 1000);
        in.reference_100uA = in.current_100uA;
        in.current_counts ^= 1u;
        in.force_counts ^= 1u;
        fault = safety_tick(&s, &in);
    }
    CHECK_EQUAL(fault, PT_FAULT_NO_FORCE);
    CHECK(k > 600 && k < 20000);
}

static void the_sensors_are_looked_at_before_a_play(void)
{
    static const struct {
        int16_t force_mN;
        int16_t current_100uA;
        uint8_t fault;
    } rows[] = {{0, 0, PT_FAULT_NONE},           {-740, 0, PT_FAULT_NONE},
                {-800, 0, PT_FAULT_FORCE_ZERO},  {1700, 0, PT_FAULT_NONE},
                {1800, 0, PT_FAULT_FORCE_ZERO},  {-1000, 0, PT_FAULT_FORCE_ZERO},
                {0, 900, PT_FAULT_NONE},         {0, 1100, PT_FAULT_STRAY_CURRENT}};
    for (uint16_t k = 0; k < sizeof rows / sizeof rows[0]; k++) {
        normal();
        in.armed = in.awaited = in.driving = false;
        in.force_mN = rows[k].force_mN;
        in.current_100uA = rows[k].current_100uA;
        for (int n = 0; n < 5000 && s.not_off < 900; n++)
            (void)safety_tick(&s, &in);
        CHECK_EQUAL(safety_before_arm(&s), rows[k].fault);
    }
    normal(); /* the current of a run that is just over is none that flows now */
    in.current_100uA = 10000;
    for (int n = 0; n < 2000; n++)
        (void)safety_tick(&s, &in);
    in.armed = in.awaited = in.driving = false;
    in.force_mN = in.current_100uA = 0;
    for (int n = 0; n < 400; n++)
        (void)safety_tick(&s, &in);
    CHECK_EQUAL(safety_before_arm(&s), PT_FAULT_NONE);
    safety_init(&s, &kept, true, -900); /* the first reading of all counts, too */
    CHECK_EQUAL(safety_before_arm(&s), PT_FAULT_FORCE_ZERO);
}

static void the_comparator_trips_in_three_ticks(void)
{
    uint8_t fault = 0;
    normal();
    in.comparator = true;
    CHECK_EQUAL(until_fault(10, &fault, true, true), 3);
    CHECK_EQUAL(fault, PT_FAULT_COMPARATOR);
    normal();
    for (int k = 0; k < 100; k++) { /* a spike now and then */
        in.comparator = k % 3 != 2;
        CHECK_EQUAL(safety_tick(&s, &in), PT_FAULT_NONE);
    }
}

static void current_with_the_output_off_is_the_gravest(void)
{
    uint8_t fault = 0;
    normal();
    in.armed = in.awaited = in.driving = false;
    in.reference_100uA = 0;
    in.current_100uA = 1200;
    CHECK_EQUAL(until_fault(10000, &fault, true, true), SAFETY_OFF_TICKS);
    CHECK_EQUAL(fault, PT_FAULT_OUTPUT_NOT_OFF);
    CHECK(safety_gravity(fault) > safety_gravity(PT_FAULT_OVER_CURRENT));
    CHECK(safety_gravity(PT_FAULT_OVER_CURRENT) > safety_gravity(PT_FAULT_HEARTBEAT));
    normal(); /* 1.65 A dying away through 0.2 H and 5 ohm */
    in.armed = in.awaited = in.driving = false;
    for (int32_t k = 0, current = 16500 * 256; k < 5000; k++) {
        in.current_100uA = (int16_t)(current / 256);
        CHECK_EQUAL(safety_tick(&s, &in), PT_FAULT_NONE);
        current -= (current + 1200 * 256) / 400;
        current = current > 0 ? current : 0;
    }
}

static void current_at_a_reference_of_zero_trips(void)
{
    uint8_t fault = 0;
    normal();
    in.reference_100uA = 0;
    drive(1200);
    s.limits.heartbeat_ticks = 60000;
    CHECK(near(until_fault(10000, &fault, true, true), SAFETY_STRAY_TICKS, SAFETY_TURNS));
    CHECK_EQUAL(fault, PT_FAULT_STRAY_CURRENT);
}

static void the_heat_model_stops_a_constant_overload(void)
{
    /* (1.25 A)^2 from cold at 1.5 A: 104.86 s * ln(2.25 / (2.25 - 1.5625)) = 124 s. */
    uint8_t fault = PT_FAULT_NONE;
    int32_t k = 0;
    normal();
    s.limits.current_trip_100uA = 16500;
    in.reference_100uA = 15000;
    drive(15000);
    in.force_mN = 14000;
    for (; k < 2000000 && fault == PT_FAULT_NONE; k++) {
        safety_alive(&s);
        in.current_counts ^= 1u;
        in.force_counts ^= 1u;
        fault = safety_tick(&s, &in);
    }
    CHECK_EQUAL(fault, PT_FAULT_COIL_HEAT);
    CHECK(k > 1230000 && k < 1260000);
    /* ARM does not forget the heat; it cools while the output is off. */
    safety_begin(&s, &(const struct safety_limits){16500, 15000, 2000, 9000000, PT_DEFAULT_FEED_RESISTANCE, PT_DEFAULT_FEED_INDUCTANCE});
    CHECK_EQUAL(until_fault(1, &fault, true, true), 1);
    in.armed = in.awaited = in.driving = false;
    in.reference_100uA = 0;
    in.force_mN = 0;
    drive(0);
    CHECK_EQUAL(until_fault(200000, &fault, true, true), 0);
    in.armed = in.awaited = in.driving = true;
    CHECK_EQUAL(until_fault(1000, &fault, true, true), 0);
}

static void a_continuous_full_stroke_pulse_is_not_too_hot(void)
{
    uint8_t fault = PT_FAULT_NONE;
    normal();
    for (int32_t k = 0; k < 3000000 && fault == PT_FAULT_NONE; k++) {
        int32_t phase = k % 8000;
        in.reference_100uA = (int16_t)(phase < 1000 ? 15 * phase : 15000 - 15 * (phase - 1000) / 7);
        drive(in.reference_100uA);
        in.force_mN = (int16_t)(in.current_100uA < 5000 ? in.current_100uA * 2 / 5 : in.current_100uA * 6L / 5 - 4000);
        safety_alive(&s);
        in.current_counts ^= 1u;
        in.force_counts ^= 1u;
        fault = safety_tick(&s, &in);
    }
    CHECK_EQUAL(fault, PT_FAULT_NONE);
}

static void the_longest_on_time_ends_a_run(void)
{
    uint8_t fault = 0;
    normal();
    s.limits.on_ticks = 1000;
    CHECK_EQUAL(until_fault(10000, &fault, true, true), 1001);
    CHECK_EQUAL(fault, PT_FAULT_ON_TIME);
}

int main(void)
{
    RUN(nothing_wrong_nothing_found);
    RUN(one_sample_of_over_current_trips);
    RUN(three_samples_of_over_force_trip);
    RUN(now_and_then_over_force_trips_too);
    RUN(silence_trips_after_the_heartbeat_time);
    RUN(rails_trip);
    RUN(a_frozen_current_reading_trips_once_the_reference_moves);
    RUN(a_frozen_current_reading_trips_as_the_loop_winds_up);
    RUN(the_voltage_has_to_fit_the_current);
    RUN(the_voltage_has_to_fit_the_coil_of_the_run);
    RUN(a_stroke_through_a_coil_of_more_inductance_is_honest);
    RUN(a_frozen_force_reading_trips_after_a_stroke);
    RUN(a_lost_current_reading_is_not_blamed_on_the_force);
    RUN(full_drive_without_current_trips);
    RUN(a_dead_force_sensor_is_found_where_the_trip_is_in_reach);
    RUN(a_force_sensor_that_reads_half_is_found_at_the_trip);
    RUN(too_much_force_for_the_current_is_found);
    RUN(no_force_is_counted_across_pulses);
    RUN(the_sensors_are_looked_at_before_a_play);
    RUN(the_comparator_trips_in_three_ticks);
    RUN(current_with_the_output_off_is_the_gravest);
    RUN(current_at_a_reference_of_zero_trips);
    RUN(the_heat_model_stops_a_constant_overload);
    RUN(a_continuous_full_stroke_pulse_is_not_too_hot);
    RUN(the_longest_on_time_ends_a_run);
    CHECK_DONE();
}
