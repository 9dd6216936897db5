/* Trial tractions at the points of one side of a contact, and forces on the nodes of both. */

#include "contact_points.h"

void trial_traction(int32_t m, const double *stress, const double *outward, const double *opening, const double *normal,
                    const double *gamma, double *stress_vector, double *gap, double *slip, double *trial)
{
    for (int32_t i = 0; i < m; i++) {
        const double *s = stress + 4 * i, *N = outward + 2 * i, *n = normal + 2 * i, *d = opening + 2 * i;
        double *t = stress_vector + 2 * i;
        t[0] = s[0] * N[0] + s[3] * N[1];
        t[1] = s[3] * N[0] + s[1] * N[1];
        gap[i] = d[0] * n[0] + d[1] * n[1];
        slip[i] = -d[0] * n[1] + d[1] * n[0];
        trial[2 * i] = t[0] * n[0] + t[1] * n[1] - gamma[i] * gap[i];
        trial[2 * i + 1] = -t[0] * n[1] + t[1] * n[0] - gamma[i] * slip[i];
    }
}

void contact_forces(int32_t n, int32_t q, int32_t k, int32_t o, const double *force, const double *trace,
                    const int32_t *own_nodes, const double *shape, const int32_t *opposite_nodes, double *own,
                    double *opposite)
{
    for (int32_t i = 0; i < n * q; i++) {
        const double *f = force + 2 * i;
        if (f[0] == 0 && f[1] == 0) continue;
        for (int a = 0; a < k; a++)
            for (int j = 0; j < 2; j++) own[2 * own_nodes[i / q * k + a] + j] += trace[i * k + a] * f[j];
        for (int a = 0; a < o; a++)
            for (int j = 0; j < 2; j++) opposite[2 * opposite_nodes[i * o + a] + j] -= shape[i * o + a] * f[j];
    }
}
