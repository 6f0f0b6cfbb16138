/* The plant without the firmware, for tests: a program of its own, in no port.
 *
 *   harness [base=as-built|ideal] [drive=duty|current] [NAME=VALUE ...] < in > out
 *   harness list
 *
 * One binary double per tick comes in: the duty 0..1, or with drive=current the coil current in A, as if
 * from an ideal driver. Seven go out: true current [A], field [A], magnetic force [N], force on the finger
 * [N], force as sensed [N], and the two conversions. `list` prints the parameters as tab-separated text.
 * Exit status 2: a parameter that does not exist (-1) or is outside its range (-2). */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "plant.h"

#define PWM_PERIOD 8192U

static struct solenoid solenoid;
static struct solenoid_params params;

static int list(void)
{
    for (int32_t k = 0; k < plant_parameter_count; k++) {
        const struct plant_parameter *row = &plant_parameters[k];
        printf("%s\t%s\t%g\t%g\t%d\t%s\n", row->name, row->unit, row->low, row->high, row->zero_absent,
               row->meaning);
    }
    return 0;
}

/* 0 for an argument that was understood. */
static int take(char *argument, int *imposed)
{
    if (strcmp(argument, "base=ideal") == 0) {
        solenoid_ideal(&params);
        return 0;
    }
    if (strcmp(argument, "base=as-built") == 0 || strcmp(argument, "drive=duty") == 0) {
        return 0;
    }
    if (strcmp(argument, "drive=current") == 0) {
        *imposed = 1;
        return 0;
    }
    char *equals = strchr(argument, '=');
    if (equals == NULL) {
        return -1;
    }
    *equals = '\0';
    return solenoid_set(&params, argument, strtod(equals + 1, NULL));
}

int main(int argc, char **argv)
{
    int imposed = 0;
    if (argc == 2 && strcmp(argv[1], "list") == 0) {
        return list();
    }
    solenoid_as_built(&params);
    for (int k = 1; k < argc; k++) {
        int result = take(argv[k], &imposed);
        if (result != 0) {
            fprintf(stderr, "%s: %d\n", argv[k], result);
            return 2;
        }
    }
    solenoid_init(&solenoid, &params);

    double in;
    while (fread(&in, sizeof in, 1, stdin) == 1) {
        if (imposed) {
            plant_step_current(&solenoid, (real)in);
        } else {
            solenoid_step(&solenoid, (uint16_t)(in * PWM_PERIOD + 0.5), (uint16_t)PWM_PERIOD);
        }
        const double out[7] = {(double)solenoid.current, (double)solenoid.field,  (double)solenoid.magnetic,
                               (double)solenoid.force,   (double)solenoid.sensed, solenoid_adc_current(&solenoid),
                               solenoid_adc_force(&solenoid)};
        if (fwrite(out, sizeof out, 1, stdout) != 1) {
            return 1;
        }
    }
    return 0;
}
