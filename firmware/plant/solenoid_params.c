/* Everything about the device that can be chosen by name, and the two devices that ship. */
#include <stddef.h>

#include "plant.h"

/* What the device of the paper has beyond static hysteresis: the numbers to tune against its figures. */
#define AS_BUILT_COULOMB_N R(0.2)
#define AS_BUILT_FIELD_LAG_S R(0.0027)
#define AS_BUILT_CREEP R(0.03)
#define AS_BUILT_THERMAL_DRIFT R(0.006)

#define EFFECT 1  /* an imperfection: 0 is absent, whatever its range */
#define SETTING 0 /* has a default and always counts */
#define AT(member) ((uint16_t)offsetof(struct solenoid_params, member))

const struct plant_parameter plant_parameters[] = {
    {"seed", "1", 0, 16777215, SETTING, AT(seed), "which device (0: the nominal one) and which noise"},
    {"noise-seed", "1", 0, 65535, SETTING, AT(noise_seed), "another draw of the noise of the same device"},
    {"supply", "V", 6, 24, SETTING, AT(supply), "supply of the coil driver"},
    {"supply-sag", "ohm", 0, 5, EFFECT, AT(supply_sag), "the supply gives less the more current it gives"},
    {"resistance", "ohm", 0.05, 100000, SETTING, AT(resistance), "cold coil"},
    {"inductance", "H", 0.00005, 0.2, SETTING, AT(inductance), "coil"},
    {"coil", "1", 0, 16777215, SETTING, AT(coil),
     "another coil and adapter, drawn: 2 to 10 ohm, 5 to 100 mH, 9 to 24 V (0: as set)"},
    {"ambient", "K", -60, 80, EFFECT, AT(ambient),
     "temperature of the room above that at calibration: 0.39 % of the copper's resistance and half of that of the force a kelvin"},
    {"noise", "1", 0, 0.1, EFFECT, AT(noise), "force noise per sample, rms over the 15 N range"},
    {"current-noise", "A", 0, 0.1, EFFECT, AT(current_noise), "current noise per sample, rms"},

    {"delay", "s", 0, 0.05, EFFECT, AT(delay), "transport delay between current and field"},
    {"field-lag", "s", 0, 0.5, EFFECT, AT(field_lag), "eddy currents: the field follows the current late"},
    {"rate-widening", "A/(A/s)^0.5", 0, 0.1, EFFECT, AT(rate_widening),
     "excess loss: the field trails by this times the root of its rate"},
    {"load-dependence", "A/N", -0.01, 0.01, EFFECT, AT(load_dependence),
     "the effective current moves with the force"},
    {"accommodation", "1", 0, 0.5, EFFECT, AT(accommodation),
     "weight of the force as it was a path of current ago"},
    {"accommodation-path", "A", 1, 1000, SETTING, AT(accommodation_path), "e-fold of that path"},
    {"thermal-drift", "1/A^2", 0, 0.1, EFFECT, AT(thermal_drift),
     "loss of force per low-passed square of the current; warms the copper too"},
    {"thermal-tau", "s", 0.1, 10000, SETTING, AT(thermal_tau), "time constant of that low-pass"},
    {"coulomb", "N", 0, 3, EFFECT, AT(coulomb), "dry friction between plunger and finger"},
    {"stick-slip", "N", 0, 5, EFFECT, AT(stick_slip), "imbalance at which a stuck plunger jumps"},
    {"resonance", "Hz", 1, 2000, EFFECT, AT(resonance), "natural frequency of plunger and finger"},
    {"resonance-zeta", "1", 0.01, 2, SETTING, AT(resonance_zeta), "its damping ratio"},
    {"creep", "1", 0, 0.5, EFFECT, AT(creep), "slow part of the finger's yielding over the fast part"},
    {"creep-tau", "s", 0.01, 100, SETTING, AT(creep_tau), "middle time constant of the slow part"},
    {"viscous", "N s/A", -0.1, 0.1, EFFECT, AT(viscous), "force proportional to the rate of the current"},
    {"output-lag", "s", 0, 0.5, EFFECT, AT(output_lag), "first-order lag of the force"},
    {"periodic", "N", 0, 5, EFFECT, AT(periodic), "amplitude of a disturbance at a fixed frequency"},
    {"periodic-frequency", "Hz", 0.01, 4000, SETTING, AT(periodic_frequency), "that frequency"},
    {"offset-drift", "N/s", -0.1, 0.1, EFFECT, AT(offset_drift), "the force sensor's zero moves with time"},
    {"step", "N", -5, 5, EFFECT, AT(step), "sudden change of the force sensor's zero"},
    {"step-gain", "1", -0.5, 0.5, EFFECT, AT(step_gain), "sudden relative change of its gain"},
    {"step-time", "s", 0, 100000, SETTING, AT(step_time), "when, after power-on"},
    {"condition-gain", "1", -0.5, 0.5, EFFECT, AT(condition_gain), "relative gain error from power-on"},
    {"condition-offset", "N", -5, 5, EFFECT, AT(condition_offset), "zero error from power-on"},
    {"outliers", "1", 0, 0.5, EFFECT, AT(outliers), "probability that a force sample is wild"},
    {"outlier-size", "N", 0.01, 10, SETTING, AT(outlier_size), "largest error of a wild sample"},
    {"saturation", "N", 0.5, 17, EFFECT, AT(saturation), "upper rail of the force amplifier"},
    {"quantisation", "N", 0.001, 5, EFFECT, AT(quantisation), "step of the force reading"},
};
const int32_t plant_parameter_count = (int32_t)(sizeof plant_parameters / sizeof plant_parameters[0]);

static real *member(struct solenoid_params *p, const struct plant_parameter *row)
{
    return (real *)(void *)((unsigned char *)p + row->offset);
}

static int same(const char *a, const char *b)
{
    while (*a != '\0' && *a == *b) {
        a++;
        b++;
    }
    return *a == *b;
}

void solenoid_ideal(struct solenoid_params *p)
{
    for (int32_t k = 0; k < plant_parameter_count; k++) {
        *member(p, &plant_parameters[k]) = R(0);
    }
    p->supply = R(12);
    p->resistance = R(5);
    p->inductance = R(0.012);
    p->noise = R(0.003);
    p->current_noise = R(0.0003);
    p->accommodation_path = R(30);
    p->thermal_tau = R(20);
    p->resonance_zeta = R(0.2);
    p->creep_tau = R(1);
    p->periodic_frequency = R(7);
    p->step_time = R(20);
    p->outlier_size = R(4);
}

void solenoid_as_built(struct solenoid_params *p)
{
    solenoid_ideal(p);
    p->coulomb = AS_BUILT_COULOMB_N;
    p->field_lag = AS_BUILT_FIELD_LAG_S;
    p->creep = AS_BUILT_CREEP;
    p->thermal_drift = AS_BUILT_THERMAL_DRIFT;
}

int solenoid_set(struct solenoid_params *p, const char *name, double value)
{
    for (int32_t k = 0; k < plant_parameter_count; k++) {
        const struct plant_parameter *row = &plant_parameters[k];
        if (!same(row->name, name)) {
            continue;
        }
        int inside = value >= row->low && value <= row->high; /* false for NaN */
        int absent = row->zero_absent && value >= 0 && value <= 0;
        if (!inside && !absent) {
            return -2;
        }
        *member(p, row) = (real)value;
        return 0;
    }
    return -1;
}
