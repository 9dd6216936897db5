/* Strains at points of cells. */

#include "strain.h"

void strains(int32_t n, int32_t q, int32_t a, const double *gradient, const int32_t *dofs, const double *u,
             double *strain)
{
    for (int32_t i = 0; i < n * q; i++) {
        const int32_t *node = dofs + (int64_t)(i / q) * a;
        const double *g = gradient + (int64_t)i * a * 2;
        double xx = 0, yy = 0, xy = 0;
        for (int c = 0; c < a; c++) {
            const double *v = u + 2 * (int64_t)node[c];
            xx += g[2 * c] * v[0];
            yy += g[2 * c + 1] * v[1];
            xy += g[2 * c + 1] * v[0] + g[2 * c] * v[1];
        }
        strain[3 * i] = xx, strain[3 * i + 1] = yy, strain[3 * i + 2] = xy;
    }
}
