/* Displacement gradients, or strains, at points of cells. */

#include "strain.h"

void strains(int32_t n, int32_t q, int32_t a, int32_t m, int32_t d, int32_t n_terms, int32_t k, const int32_t *terms,
             const double *derivative, const int32_t *dofs, const double *u, double *strain)
{
    for (int64_t i = 0; i < (int64_t)n * q; i++) {
        const int32_t *node = dofs + i / q * a;
        double *e = strain + i * k;
        for (int j = 0; j < k; j++) e[j] = 0;
        for (int t = 0; t < n_terms; t++) {
            const int32_t *term = terms + 3 * t;
            const double *g = derivative + i * a * m + term[1], *v = u + term[0];
            double sum = 0;
            for (int c = 0; c < a; c++) sum += g[m * c] * v[(int64_t)d * node[c]];
            e[term[2]] += sum;
        }
    }
}
