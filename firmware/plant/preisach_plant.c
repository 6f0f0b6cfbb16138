/* Static hysteresis of the simulated device: a Preisach plane with a smooth analytic density, evaluated
 * through its Everett function, plus a reversible part that grows with the field.
 *
 * everett(a, b) is the force gained when the field rises from b to a after everything was wiped out; the
 * force along any history is a signed sum of it over the remembered turning points. */
#include "plant.h"

/* The nominal device (seed 0), in A and N. The density is a product of two rational bumps, in the
 * coercive field (alpha - beta)/2 and in the interaction field (alpha + beta)/2. */
#define FULL_CURRENT R(1.5)
#define FULL_FORCE R(14.0)
#define IRREVERSIBLE_SHARE R(0.62)
#define COERCIVE_AT R(0.20)
#define COERCIVE_WIDTH R(0.13)
#define INTERACTION_AT R(0.56)
#define INTERACTION_WIDTH R(0.26)
#define REVERSIBLE_BEND R(0.8)
#define REVERSIBLE_BIAS R(0.25)
#define DEVICE_SPREAD R(0.08)

#define NODE_SPACING ((PLANT_FIELD_HIGH_A - PLANT_FIELD_LOW_A) / (real)(PLANT_NODES - 1))
#define NODES_PER_A (R(1) / NODE_SPACING)

struct density {
    real coercive_at, coercive_width, interaction_at, interaction_width;
};

static int32_t row(int32_t alpha)
{
    return alpha * (alpha + 1) / 2;
}

static real bump(real distance, real width)
{
    real x = distance / width;
    real d = R(1) + x * x;
    return R(1) / (d * d);
}

static real density_at(const struct density *d, real alpha, real beta)
{
    real coercive = bump(R(0.5) * (alpha - beta) - d->coercive_at, d->coercive_width);
    real interaction = bump(R(0.5) * (alpha + beta) - d->interaction_at, d->interaction_width);
    return coercive * interaction;
}

/* Sum the density over triangles: node (i, j) holds the cells j <= beta < alpha <= i; those on the
 * diagonal are cut in half by it. */
static void integrate(struct plant_preisach *p, const struct density *d)
{
    const real area = NODE_SPACING * NODE_SPACING;
    p->everett[0] = R(0);
    for (int32_t i = 1; i < PLANT_NODES; i++) {
        real alpha = PLANT_FIELD_LOW_A + NODE_SPACING * ((real)i - R(0.5));
        real strip = R(0);
        p->everett[row(i) + i] = R(0);
        for (int32_t j = i - 1; j >= 0; j--) {
            real beta = PLANT_FIELD_LOW_A + NODE_SPACING * ((real)j + R(0.5));
            real mass = area * density_at(d, alpha, beta);
            strip = strip + (j == i - 1 ? R(0.5) * mass : mass);
            p->everett[row(i) + j] = p->everett[row(i - 1) + j] + strip;
        }
    }
}

/* Bilinear between nodes, linear inside a cell on the diagonal, where only three corners exist. */
static real everett(const struct plant_preisach *p, real alpha, real beta)
{
    real x = (alpha - PLANT_FIELD_LOW_A) * NODES_PER_A;
    real y = (beta - PLANT_FIELD_LOW_A) * NODES_PER_A;
    int32_t i = (int32_t)x;
    int32_t j = (int32_t)y;
    if (i > PLANT_NODES - 2) {
        i = PLANT_NODES - 2;
    }
    if (j > i) {
        j = i;
    }
    const real *lower = p->everett + row(i) + j;
    const real *upper = p->everett + row(i + 1) + j;
    if (i == j) {
        return (x - y) * upper[0];
    }
    x = x - (real)i;
    y = y - (real)j;
    real below = lower[0] + y * (lower[1] - lower[0]);
    real above = upper[0] + y * (upper[1] - upper[0]);
    return below + x * (above - below);
}

/* The square of a flux that starts from a bias, over that at full current: so the force rises from 0 A on,
 * and a core that needs ever more field for the same flux bends it. */
static real reversible(const struct plant_preisach *p, real field)
{
    real x = field / FULL_CURRENT;
    real square = x * (x + R(2) * REVERSIBLE_BIAS) / (R(1) + R(2) * REVERSIBLE_BIAS);
    return p->reversible * square * (R(1) + p->bend) / (R(1) + p->bend * square);
}

static real vary(real nominal, struct plant_random *r, uint32_t seed)
{
    real draw = R(2) * plant_random_uniform(r) - R(1);
    return seed == 0U ? nominal : nominal * (R(1) + DEVICE_SPREAD * draw);
}

void plant_preisach_init(struct plant_preisach *p, uint32_t seed)
{
    struct plant_random device;
    struct density d;
    plant_random_init(&device, seed, 1U);
    d.coercive_at = vary(COERCIVE_AT, &device, seed);
    d.coercive_width = vary(COERCIVE_WIDTH, &device, seed);
    d.interaction_at = vary(INTERACTION_AT, &device, seed);
    d.interaction_width = vary(INTERACTION_WIDTH, &device, seed);
    real share = vary(IRREVERSIBLE_SHARE, &device, seed);
    p->bend = vary(REVERSIBLE_BEND, &device, seed);
    /* The strength spreads less than the shape, 13.2 to 14.3 N: nobody ships a solenoid that trips its
     * own 15 N limit. */
    real strength = seed == 0U ? FULL_FORCE : R(13.2) + R(1.1) * plant_random_uniform(&device);

    integrate(p, &d);
    /* Demagnetised at rest: whatever would already have switched below 0 A is tared away. */
    real gained = everett(p, FULL_CURRENT, PLANT_FIELD_LOW_A) - everett(p, R(0), PLANT_FIELD_LOW_A);
    real scale = strength * share / gained;
    for (int32_t k = 0; k < PLANT_NODES * (PLANT_NODES + 1) / 2; k++) {
        p->everett[k] = p->everett[k] * scale;
    }
    p->reversible = strength * (R(1) - share);

    p->turn_field[0] = PLANT_FIELD_LOW_A;
    p->turn_force[0] = R(0);
    p->turns = 1;
    p->field = R(0);
    p->force = everett(p, R(0), PLANT_FIELD_LOW_A);
    p->tare = p->force;
}

/* A full memory forgets its two innermost turning points, the smallest loop it holds. The new point carries
 * the present force, so nothing jumps now; the error shows, and ends, when that loop is wiped out. */
static void remember(struct plant_preisach *p)
{
    if (p->turns == PLANT_TURNS) {
        p->turns -= 2;
    }
    p->turn_field[p->turns] = p->field;
    p->turn_force[p->turns] = p->force;
    p->turns++;
}

real plant_preisach_step(struct plant_preisach *p, real field)
{
    real u = field < PLANT_FIELD_LOW_A ? PLANT_FIELD_LOW_A : field;
    u = u > PLANT_FIELD_HIGH_A ? PLANT_FIELD_HIGH_A : u;

    /* turn_field[0], [2], ... are minima: an odd count means that the field was rising. */
    int rising = (p->turns & 1) != 0;
    if (rising ? u < p->field : u > p->field) {
        remember(p);
        rising = !rising;
    }
    /* Wiping-out: a branch that passes an older turning point closes that loop. */
    if (rising) {
        while (p->turns >= 3 && p->turn_field[p->turns - 2] <= u) {
            p->turns -= 2;
        }
    } else {
        while (p->turns >= 4 && p->turn_field[p->turns - 2] >= u) {
            p->turns -= 2;
        }
    }
    real from = p->turn_field[p->turns - 1];
    real base = p->turn_force[p->turns - 1];
    p->field = u;
    p->force = rising ? base + everett(p, u, from) : base - everett(p, from, u);
    return p->force - p->tare + reversible(p, field);
}
