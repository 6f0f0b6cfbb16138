#include "check.h"
#include "safety.h"

static struct safety s;
static struct safety_input in;
static struct hal_kept kept;

static void normal(void)
{
    safety_init(&s, &kept, true);
    (void)heat_tell(&s.heat, 0);
    s.current_trip = 16500;
    s.force_trip = 15000;
    s.heartbeat_ticks = 2000;
    s.on_ticks_limit = 9000000;
    in.reference = 5000;
    in.current = 5000;
    in.force = 3000;
    in.current_counts = 1024;
    in.force_counts = 910;
    in.duty = 1000;
    in.full = 7853;
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
    s.heartbeat_ticks = 60000;
    CHECK_EQUAL(until_fault(50000, &fault, true, true), 0);
}

static void one_sample_of_over_current_trips(void)
{
    normal();
    in.current = 16500;
    CHECK_EQUAL(safety_tick(&s, &in), PT_FAULT_NONE);
    in.current = 16501;
    CHECK_EQUAL(safety_tick(&s, &in), PT_FAULT_OVER_CURRENT);
    CHECK(!safety_is_soft(PT_FAULT_OVER_CURRENT));
}

static void three_samples_of_over_force_trip(void)
{
    uint8_t fault = 0;
    normal();
    in.force = 15001;
    CHECK_EQUAL(until_fault(10, &fault, true, true), SAFETY_FORCE_DEBOUNCE);
    CHECK_EQUAL(fault, PT_FAULT_OVER_FORCE);
    normal(); /* two bad ones and a good one do not */
    for (int k = 0; k < 100; k++) {
        in.force = k % 3 == 2 ? 14000 : 16000;
        CHECK_EQUAL(safety_tick(&s, &in), PT_FAULT_NONE);
    }
}

static void silence_trips_after_the_heartbeat_time(void)
{
    uint8_t fault = 0;
    normal();
    CHECK_EQUAL(until_fault(10000, &fault, true, true), 2001);
    CHECK_EQUAL(fault, PT_FAULT_HEARTBEAT);
    CHECK(safety_is_soft(fault));
    normal();
    for (int k = 0; k < 10; k++) {
        CHECK_EQUAL(until_fault(1999, &fault, true, true), 0);
        safety_alive(&s);
    }
    normal();
    in.armed = in.awaited = in.driving = false;
    CHECK_EQUAL(until_fault(10000, &fault, true, true), 0);
}

static void rails_trip(void)
{
    uint8_t fault = 0;
    normal();
    s.current_trip = 32767; /* else over-current is found first */
    in.current_counts = 4095;
    CHECK_EQUAL(until_fault(10, &fault, false, true), SAFETY_RAIL_DEBOUNCE);
    CHECK_EQUAL(fault, PT_FAULT_CURRENT_RAIL);
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
        in.reference = (int16_t)(in.reference + 15);
        in.force_counts ^= 1u;
        fault = safety_tick(&s, &in);
    }
    CHECK_EQUAL(fault, PT_FAULT_CURRENT_FROZEN);
    CHECK(ticks < 50);
}

static void a_frozen_force_reading_trips_after_a_stroke(void)
{
    uint8_t fault = PT_FAULT_NONE;
    normal();
    for (int16_t k = 0; k <= 1000 && fault == PT_FAULT_NONE; k++) {
        in.current = in.reference = (int16_t)(15 * k);
        in.current_counts ^= 1u;
        fault = safety_tick(&s, &in);
    }
    CHECK_EQUAL(fault, PT_FAULT_FORCE_FROZEN);
}

/* A reading that falls to zero in one tick has moved the current by a stroke; a force that happens to give the
 * same count twice is not frozen for that. The cause to be named is the current. */
static void a_lost_current_reading_is_not_blamed_on_the_force(void)
{
    uint8_t fault = PT_FAULT_NONE;
    normal();
    in.current = in.reference = 13567;
    in.duty = 4573;
    CHECK_EQUAL(until_fault(10, &fault, true, true), 0);
    in.current = 0;
    in.current_counts = 0;
    CHECK_EQUAL(until_fault(1000, &fault, false, false), SAFETY_NO_CURRENT_TICKS);
    CHECK_EQUAL(fault, PT_FAULT_NO_CURRENT);
}

static void full_drive_without_current_trips(void)
{
    uint8_t fault = 0;
    normal();
    in.duty = in.full;
    in.current = 1000;
    CHECK_EQUAL(until_fault(1000, &fault, true, true), SAFETY_WEAK_TICKS);
    CHECK_EQUAL(fault, PT_FAULT_NO_CURRENT);
    normal();
    in.duty = (uint16_t)(in.full / 4u + 1u);
    in.current = 0;
    CHECK_EQUAL(until_fault(1000, &fault, true, true), SAFETY_NO_CURRENT_TICKS);
    CHECK_EQUAL(fault, PT_FAULT_NO_CURRENT);
}

static void full_current_without_force_trips(void)
{
    uint8_t fault = 0;
    normal();
    s.heartbeat_ticks = 60000;
    in.current = in.reference = 14000;
    in.force = 100;
    CHECK_EQUAL(until_fault(10000, &fault, true, true), SAFETY_NO_FORCE_TICKS);
    CHECK_EQUAL(fault, PT_FAULT_NO_FORCE);
}

static void current_with_the_output_off_trips(void)
{
    uint8_t fault = 0;
    normal();
    in.armed = in.awaited = in.driving = false;
    in.reference = 0;
    in.current = 1200;
    CHECK_EQUAL(until_fault(10000, &fault, true, true), SAFETY_STRAY_TICKS);
    CHECK_EQUAL(fault, PT_FAULT_STRAY_CURRENT);
}

static void the_heat_model_stops_a_constant_overload(void)
{
    /* (1.25 A)^2 from cold at 1.5 A: 104.86 s * ln(2.25 / (2.25 - 1.5625)) = 124 s. */
    uint8_t fault = PT_FAULT_NONE;
    int32_t k = 0;
    normal();
    s.current_trip = 16500;
    in.current = in.reference = 15000;
    in.force = 14000;
    for (; k < 2000000 && fault == PT_FAULT_NONE; k++) {
        safety_alive(&s);
        in.current_counts ^= 1u;
        in.force_counts ^= 1u;
        fault = safety_tick(&s, &in);
    }
    CHECK_EQUAL(fault, PT_FAULT_COIL_HEAT);
    CHECK(k > 1230000 && k < 1260000);
    /* ARM does not forget the heat; it cools while the output is off. */
    safety_begin(&s);
    CHECK_EQUAL(until_fault(1, &fault, true, true), 1);
    in.armed = in.awaited = in.driving = false;
    in.current = in.reference = 0;
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
        in.current = in.reference = (int16_t)(phase < 1000 ? 15 * phase : 15000 - 15 * (phase - 1000) / 7);
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
    s.on_ticks_limit = 1000;
    CHECK_EQUAL(until_fault(10000, &fault, true, true), 1001);
    CHECK_EQUAL(fault, PT_FAULT_ON_TIME);
}

int main(void)
{
    RUN(nothing_wrong_nothing_found);
    RUN(one_sample_of_over_current_trips);
    RUN(three_samples_of_over_force_trip);
    RUN(silence_trips_after_the_heartbeat_time);
    RUN(rails_trip);
    RUN(a_frozen_current_reading_trips_once_the_reference_moves);
    RUN(a_frozen_force_reading_trips_after_a_stroke);
    RUN(a_lost_current_reading_is_not_blamed_on_the_force);
    RUN(full_drive_without_current_trips);
    RUN(full_current_without_force_trips);
    RUN(current_with_the_output_off_trips);
    RUN(the_heat_model_stops_a_constant_overload);
    RUN(a_continuous_full_stroke_pulse_is_not_too_hot);
    RUN(the_longest_on_time_ends_a_run);
    CHECK_DONE();
}
