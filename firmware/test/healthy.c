/* Plays with nothing wrong: any fault is a false one.
 *
 *   healthy FIRST COUNT      plays number FIRST to FIRST + COUNT - 1; each number is a device, a signal, a trip
 *
 * Devices: twenty, drawn around the as-built one by the parameters of the bench. Signals: six inverted pulses, sines,
 * squares, saws, plateaus. Noise as built, and three times that. Each second play has a trip of 3 or 8 N and a
 * signal that stays below it by a tenth. Exit status 1: a false trip. */
#include <stdio.h>
#include <stdlib.h>

#include "breaks.h"
#include "control.h"
#include "drives.h"
#include "world.h"

#define SAMPLES 6000u
#define DEVICES 20u
#define KINDS 10u

static uint32_t drawn;

static double draw(double low, double high)
{
    drawn = drawn * 1664525u + 1013904223u;
    return low + (high - low) * (double)(drawn >> 8) / 16777216.0;
}

/* A quarter more copper, a tenth of supply, half the inductance; lags, creep, friction and heat up to twice the as-built. */
static void draw_device(struct solenoid_params *p, uint32_t device, uint32_t noise_seed, double noise)
{
    drawn = device * 2654435761u + 1u;
    (void)draw(0, 1);
    solenoid_as_built(p);
    const struct {
        const char *name;
        double value;
    } settings[] = {
        {"seed", (double)device},
        {"noise-seed", (double)(noise_seed % 65536u)},
        {"resistance", draw(4.25, 6.0)},
        {"supply", draw(11.0, 13.0)},
        {"inductance", draw(0.008, 0.02)},
        {"noise", 0.003 * noise},
        {"current-noise", 0.0003 * noise},
        {"field-lag", draw(0.001, 0.006)},
        {"creep", draw(0.0, 0.06)},
        {"coulomb", draw(0.05, 0.4)},
        {"thermal-drift", draw(0.0, 0.012)},
        {"condition-offset", draw(-0.15, 0.3)},
    };
    for (size_t k = 0; k < sizeof settings / sizeof settings[0]; k++) {
        if (solenoid_set(p, settings[k].name, settings[k].value) != 0) {
            fprintf(stderr, "%s is outside its range\n", settings[k].name);
            exit(2);
        }
    }
}

static uint32_t kind;
static int32_t most_100uA;
static uint32_t period;

static int32_t triangle(uint32_t k) /* 0..1000 */
{
    int32_t phase = (int32_t)(k % period) * 2000 / (int32_t)period;
    return phase < 1000 ? phase : 2000 - phase;
}

static int16_t sample(uint32_t k)
{
    int32_t part = 0; /* of 15000, as the drives */
    if (kind < 6u) {
        uint32_t at = k / 20u % drives[kind].count;
        uint32_t next = (at + 1u) % drives[kind].count;
        part = drives[kind].at[at] + (drives[kind].at[next] - drives[kind].at[at]) * (int32_t)(k % 20u) / 20;
    } else if (kind == 6u) { /* a sine, by a parabola on either side */
        int32_t x = triangle(k) - 500;
        part = 7500 + 30 * x - (x > 0 ? x * x : -x * x) * 3 / 100;
        part = part < 0 ? 0 : part > 15000 ? 15000 : part;
    } else if (kind == 7u) {
        part = k % period < period / 2u ? 15000 : 1500;
    } else if (kind == 8u) {
        part = (int32_t)(k % period) * 15000 / (int32_t)period;
    } else {
        part = (int32_t)(1u + k / 1200u) * 15000 / 5;
    }
    return (int16_t)(part * most_100uA / 15000);
}

static bool play(uint32_t number)
{
    static struct solenoid_params p;
    static const int32_t trips_mN[] = {15000, 3000, 15000, 8000};
    static const int32_t most[] = {15000, 4700, 15000, 7000}; /* 100 uA: 14, 2.5 at most and 6.8 N */
    uint32_t device = 1u + number % DEVICES;
    kind = number / DEVICES % KINDS;
    uint32_t trip = number / (DEVICES * KINDS) % 4u;
    bool loud = number / (DEVICES * KINDS * 4u) % 2u != 0;
    draw_device(&p, device, number, loud ? 3.0 : 1.0);
    drawn = number * 2246822519u + 7u;
    (void)draw(0, 1);
    period = (uint32_t)draw(250, 2000);
    most_100uA = (int32_t)(most[trip] * draw(0.6, 1.0));
    if (kind == 9u && most_100uA > 12000)
        most_100uA = 12000; /* a plateau for ever would be too hot in truth */
    if (!world_start(&p, trips_mN[trip], sample, SAMPLES)) {
        printf("play %u: refused, fault %u\n", number, control.fault);
        return false;
    }
    while (world_drives())
        world_tick();
    for (uint32_t k = 0; k < 6000u; k++) /* and nothing afterwards */
        world_tick();
    if (control.worst == PT_FAULT_NONE)
        return true;
    printf("play %u: device %u, kind %u, trip %d mN, %s: fault %u at tick %u (reference %d, current %d, force %d mN)\n", number,
           device, kind, trips_mN[trip], loud ? "loud" : "as built", control.fault, control.snapshot.tick,
           control.snapshot.reference_100uA, control.snapshot.current_100uA, control.snapshot.force_mN);
    return false;
}

int main(int argc, char **argv)
{
    if (argc != 3) {
        fprintf(stderr, "usage: healthy FIRST COUNT\n");
        return 2;
    }
    uint32_t first = (uint32_t)strtoul(argv[1], NULL, 10);
    uint32_t count = (uint32_t)strtoul(argv[2], NULL, 10);
    uint32_t tripped = 0;
    for (uint32_t k = first; k < first + count; k++)
        tripped += !play(k);
    printf("plays %u false trips %u\n", count, tripped);
    return tripped != 0;
}
