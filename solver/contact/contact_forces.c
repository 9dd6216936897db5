/* Contact forces at the points of one side as forces on the nodes of both. */

#include "contact_forces.h"

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
