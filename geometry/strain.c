/* Displacement gradients, or strains, at points of cells. */

#include "strain.h"

/* Small strains in a plane, the most frequent case: the loop below with all sizes known. */
static void plane_strains(int64_t n_points, int32_t q, int32_t a, const double *derivative, const int32_t *dofs,
                          const double *u, double *strain)
{
    for (int64_t i = 0; i < n_points; i++) {
        const int32_t *node = dofs + i / q * a;
        const double *g = derivative + i * a * 2;
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

void strains(int32_t n, int32_t q, int32_t a, int32_t m, int32_t d, int32_t n_terms, int32_t k, const int32_t *terms,
             const double *derivative, const int32_t *dofs, const double *u, double *strain)
{
    if (d == 2 && m == 2 && n_terms == 4 && k == 3) {
        plane_strains((int64_t)n * q, q, a, derivative, dofs, u, strain);
        return;
    }
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

void add_forces(int32_t n, int32_t q, int32_t a, int32_t m, int32_t d, int32_t n_terms, int32_t k, const int32_t *terms,
                const double *derivative, const int32_t *dofs, const double *stress, double *force)
{
    for (int64_t i = 0; i < (int64_t)n * q; i++) {
        const int32_t *node = dofs + i / q * a;
        const double *s = stress + i * k;
        for (int t = 0; t < n_terms; t++) {
            const int32_t *term = terms + 3 * t;
            const double *g = derivative + i * a * m + term[1];
            double *f = force + term[0];
            for (int c = 0; c < a; c++) f[(int64_t)d * node[c]] += g[m * c] * s[term[2]];
        }
    }
}
