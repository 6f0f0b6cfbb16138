/* xorshift64*: small, quick, and the same sequence everywhere. */
#include "plant.h"

static uint64_t next_word(struct plant_random *r)
{
    r->state ^= r->state >> 12;
    r->state ^= r->state << 25;
    r->state ^= r->state >> 27;
    return r->state * UINT64_C(0x2545F4914F6CDD1D);
}

/* Streams of one seed must not resemble each other: mix both (splitmix64), never start from 0. */
void plant_random_init(struct plant_random *r, uint32_t seed, uint32_t stream)
{
    uint64_t z = ((uint64_t)stream << 32 | seed) + UINT64_C(0x9E3779B97F4A7C15);
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    z ^= z >> 31;
    r->state = z | 1U;
}

real plant_random_uniform(struct plant_random *r)
{
    return (real)(uint32_t)(next_word(r) >> 40) * R(1.0 / 16777216.0);
}

static int32_t sum_of_halves(uint64_t word)
{
    return (int32_t)(word & 0xFFFFU) + (int32_t)(word >> 16 & 0xFFFFU) + (int32_t)(word >> 32 & 0xFFFFU) +
           (int32_t)(word >> 48);
}

/* Eight 16-bit uniforms: mean 8 * 65535/2, standard deviation sqrt(8 (65536^2 - 1)/12) = 53510.4. */
real plant_random_normal(struct plant_random *r)
{
    int32_t sum = sum_of_halves(next_word(r));
    sum += sum_of_halves(next_word(r));
    return (real)(sum - 262140) * R(1.0 / 53510.4);
}
