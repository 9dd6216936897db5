/* The radial return of J2 plasticity, but for plane stress: see return_map.py. */

#include <math.h>

#include "radial_return.h"

static const double deviatoric[4][4] = {
    {2.0 / 3, -1.0 / 3, -1.0 / 3, 0}, {-1.0 / 3, 2.0 / 3, -1.0 / 3, 0}, {-1.0 / 3, -1.0 / 3, 2.0 / 3, 0}, {0, 0, 0, 0.5}};

int32_t radial_return(int32_t n, int32_t k, const int32_t *places, const double *strain, const double *old_plastic,
                      const double *old_peeq, double lam, double mu, double yield_stress, double hardening,
                      const double *elastic, double *stress, double *moduli, double *plastic, double *peeq)
{
    int32_t yielding = 0;
    for (int64_t i = 0; i < n; i++) {
        const double *ep = old_plastic + 4 * i;
        double e[4] = {0, 0, 0, 0};
        for (int j = 0; j < k; j++) e[places[j]] = strain[k * i + j];
        const double x = e[0] - ep[0], y = e[1] - ep[1], z = e[2] - ep[2], shear = 0.5 * e[3] - ep[3];
        const double mean = (x + y + z) / 3, pressure = (3 * lam + 2 * mu) * mean;
        const double d[4] = {2 * mu * (x - mean), 2 * mu * (y - mean), 2 * mu * (z - mean), 2 * mu * shear};
        const double q = sqrt(1.5 * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + 2 * d[3] * d[3]));
        const double excess = q - yield_stress - hardening * old_peeq[i];
        double *s = stress + 4 * i, *C = moduli + k * k * i;
        if (!(excess > 0)) {
            for (int j = 0; j < 4; j++) {
                plastic[4 * i + j] = ep[j];
                s[j] = d[j] + (j < 3 ? pressure : 0);
            }
            peeq[i] = old_peeq[i];
            for (int j = 0; j < k * k; j++) C[j] = elastic[j];
            continue;
        }
        yielding++;
        const double d_peeq = excess / (3 * mu + hardening), scale = 3 * mu * d_peeq / q, r = sqrt(1.5) / q;
        for (int j = 0; j < 4; j++) {
            plastic[4 * i + j] = ep[j] + 1.5 * d_peeq / q * d[j];
            s[j] = (1 - scale) * d[j] + (j < 3 ? pressure : 0);
        }
        peeq[i] = old_peeq[i] + d_peeq;
        const double bulk = lam + 2 * mu / 3, g = 2 * mu * (1 - scale);
        const double loss = 2 * mu * (3 * mu / (3 * mu + hardening) - scale);
        for (int row = 0; row < k; row++) {
            const int a = places[row];
            for (int column = 0; column < k; column++) {
                const int b = places[column];
                const double volumetric = a < 3 && b < 3 ? bulk : 0;
                C[k * row + column] = g * deviatoric[a][b] + volumetric - loss * (r * d[a]) * (r * d[b]);
            }
        }
    }
    return yielding;
}
