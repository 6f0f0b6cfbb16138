/* The transcendental numbers of initialisation, from + - * / alone: libm may differ from machine to
 * machine in the last bit, a Taylor series in a fixed order does not. */
#include "plant.h"

/* 1 - exp(-x) directly, because 1 minus a number near 1 would cost a slow lag its digits. Halve x until
 * the series is short, then undo: loss(2x) = loss(x) (2 - loss(x)). */
real plant_exp_loss(real x)
{
    int doublings = 0;
    if (x > R(50)) {
        return R(1); /* exp(-50) is below the resolution of a double */
    }
    while (x > R(0.25)) {
        x = x * R(0.5);
        doublings++;
    }
    real term = x;
    real sum = x;
    for (int n = 2; n < 14; n++) {
        term = -term * x / (real)n;
        sum = sum + term;
    }
    while (doublings-- > 0) {
        sum = sum * (R(2) - sum);
    }
    return sum;
}

/* |angle| <= pi: enough for a rotation by one tick below the Nyquist frequency. */
void plant_cos_sin(real angle, real *cosine, real *sine)
{
    real term = R(1);
    real even = R(1);
    real odd = R(0);
    for (int n = 1; n < 28; n += 2) {
        term = term * angle / (real)n;
        odd = odd + term;
        term = -term * angle / (real)(n + 1);
        even = even + term;
    }
    *cosine = even;
    *sine = odd;
}

static void multiply_2x2(const real a[4], const real b[4], real out[4])
{
    real c[4];
    c[0] = a[0] * b[0] + a[1] * b[2];
    c[1] = a[0] * b[1] + a[1] * b[3];
    c[2] = a[2] * b[0] + a[3] * b[2];
    c[3] = a[2] * b[1] + a[3] * b[3];
    for (int k = 0; k < 4; k++) {
        out[k] = c[k];
    }
}

/* Matrix exponential by scaling and squaring, rows first; |a| up to about 8. */
void plant_exp_2x2(const real a[4], real out[4])
{
    const int squarings = 6;
    real scaled[4];
    real term[4] = {R(1), R(0), R(0), R(1)};
    real sum[4] = {R(1), R(0), R(0), R(1)};
    for (int k = 0; k < 4; k++) {
        scaled[k] = a[k] / R(64);
    }
    for (int n = 1; n < 12; n++) {
        multiply_2x2(term, scaled, term);
        for (int k = 0; k < 4; k++) {
            term[k] = term[k] / (real)n;
            sum[k] = sum[k] + term[k];
        }
    }
    for (int n = 0; n < squarings; n++) {
        multiply_2x2(sum, sum, sum);
    }
    for (int k = 0; k < 4; k++) {
        out[k] = sum[k];
    }
}
