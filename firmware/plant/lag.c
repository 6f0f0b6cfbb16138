/* tau y' + y = u, exact for an input that is straight between ticks:
 * the error against a ramp decays, the ramp itself is followed tau late. */
#include "plant.h"

void plant_lag_init(struct plant_lag *lag, real tau_s, real at)
{
    real ticks = tau_s / PLANT_TICK_S;
    lag->loss = ticks > R(0) ? plant_exp_loss(R(1) / ticks) : R(1);
    lag->slope = R(1) - ticks * lag->loss;
    lag->input = at;
    lag->output = at;
}

real plant_lag_step(struct plant_lag *lag, real input)
{
    lag->output = lag->output + lag->loss * (lag->input - lag->output) + lag->slope * (input - lag->input);
    lag->input = input;
    return lag->output;
}
