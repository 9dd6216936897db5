/* The radial return of J2 plasticity, but for plane stress: see return_map.py. */

#include <math.h>

#include "radial_return.h"

static const double deviatoric[6][6] = {
    {2.0 / 3, -1.0 / 3, -1.0 / 3, 0, 0, 0}, {-1.0 / 3, 2.0 / 3, -1.0 / 3, 0, 0, 0},
    {-1.0 / 3, -1.0 / 3, 2.0 / 3, 0, 0, 0}, {0, 0, 0, 0.5, 0, 0}, {0, 0, 0, 0, 0.5, 0}, {0, 0, 0, 0, 0, 0.5}};

/* Of stresses with s components: inlined below for each s, so that the loops have known lengths. */
static inline int32_t returned(const int s, int32_t n, int32_t k, const int32_t *places, const double *strain,
                               const double *old_plastic, const double *old_peeq, double lam, double mu,
                               double yield_stress, double hardening, const double *elastic, double *stress,
                               double *moduli, double *plastic, double *peeq)
{
    int32_t yielding = 0;
    for (int64_t i = 0; i < n; i++) {
        const double *ep = old_plastic + s * i;
        double e[6] = {0, 0, 0, 0, 0, 0};
        for (int j = 0; j < k; j++) e[places[j]] = strain[k * i + j];
        const double x = e[0] - ep[0], y = e[1] - ep[1], z = e[2] - ep[2];
        const double mean = (x + y + z) / 3, pressure = (3 * lam + 2 * mu) * mean;
        double d[6] = {2 * mu * (x - mean), 2 * mu * (y - mean), 2 * mu * (z - mean)}, shear = 0;
        for (int j = 3; j < s; j++) {
            d[j] = 2 * mu * (0.5 * e[j] - ep[j]);
            shear += d[j] * d[j];
        }
        const double q = sqrt(1.5 * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + 2 * shear));
        const double excess = q - yield_stress - hardening * old_peeq[i];
        double *out = stress + s * i, *C = moduli + k * k * i;
        if (!(excess > 0)) {
            for (int j = 0; j < s; j++) {
                plastic[s * i + j] = ep[j];
                out[j] = d[j] + (j < 3 ? pressure : 0);
            }
            peeq[i] = old_peeq[i];
            for (int j = 0; j < k * k; j++) C[j] = elastic[j];
            continue;
        }
        yielding++;
        const double d_peeq = excess / (3 * mu + hardening), scale = 3 * mu * d_peeq / q, r = sqrt(1.5) / q;
        for (int j = 0; j < s; j++) {
            plastic[s * i + j] = ep[j] + 1.5 * d_peeq / q * d[j];
            out[j] = (1 - scale) * d[j] + (j < 3 ? pressure : 0);
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

int32_t radial_return(int32_t n, int32_t s, int32_t k, const int32_t *places, const double *strain,
                      const double *old_plastic, const double *old_peeq, double lam, double mu, double yield_stress,
                      double hardening, const double *elastic, double *stress, double *moduli, double *plastic,
                      double *peeq)
{
    if (s == 4)
        return returned(4, n, k, places, strain, old_plastic, old_peeq, lam, mu, yield_stress, hardening, elastic,
                        stress, moduli, plastic, peeq);
    return returned(6, n, k, places, strain, old_plastic, old_peeq, lam, mu, yield_stress, hardening, elastic, stress,
                    moduli, plastic, peeq);
}
