/* The stiffness of a cell, for every shape, order and kinematics. */

#include <math.h>
#include <string.h>

#include "stiffness.h"

enum { Q, NODES, GEOMETRY, DIMENSION, STRAINS, TERMS, HAS_HOOP, IS_GIVEN, SIZES };

/* derivative (d + 2, a) by the axes, over the radius, and the value; returns the volume of the point. */
static double derive(int q, int point, int a, int g, int d, int has_hoop, const double *nodes, const double *basis,
                     const double *x, double *derivative)
{
    double J[3][3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 1}}, I[3][3], radius = 1;
    for (int j = 0; j < d; j++) {
        const double *slope = nodes + ((int64_t)(1 + j) * q + point) * g;
        for (int i = 0; i < d; i++) {
            double sum = 0;
            for (int b = 0; b < g; b++) sum += slope[b] * x[3 * b + i];
            J[i][j] = sum;
        }
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int r = (j + 1) % 3, s = (j + 2) % 3, t = (i + 1) % 3, u = (i + 2) % 3;
            I[i][j] = J[r][t] * J[s][u] - J[r][u] * J[s][t];
        }
    const double determinant = J[0][0] * I[0][0] + J[0][1] * I[1][0] + J[0][2] * I[2][0];
    if (has_hoop) {
        radius = 0;
        for (int b = 0; b < g; b++) radius += nodes[(int64_t)point * g + b] * x[3 * b];
    }
    const double *value = basis + (int64_t)point * a;
    for (int i = 0; i < d; i++)
        for (int b = 0; b < a; b++) {
            double sum = 0;
            for (int j = 0; j < d; j++) sum += basis[((int64_t)(1 + j) * q + point) * a + b] * I[j][i];
            derivative[i * a + b] = sum / determinant;
        }
    for (int b = 0; b < a; b++) derivative[d * a + b] = value[b] / radius;
    for (int b = 0; b < a; b++) derivative[(d + 1) * a + b] = value[b];
    return fabs(determinant) * radius;
}

void stiffness(double *A, const double *w, const double *c, const double *x, const int *entity,
               const uint8_t *permutation, void *data)
{
    (void)entity, (void)permutation, (void)data;
    const int q = c[Q], a = c[NODES], g = c[GEOMETRY], d = c[DIMENSION], k = c[STRAINS], n_terms = c[TERMS];
    const double *terms = c + SIZES, *weight = terms + 3 * n_terms, *nodes = weight + q;
    const double *basis = nodes + (1 + d) * q * g, *moduli = basis + (1 + d) * q * a;
    const int n = d * a;
    double derivative[(d + 2) * a]; /* of the basis */
    double stress[k * n];           /* (k, d, a) by the displacements of the nodes */
    double sum[n * n];              /* (d, a, d, a) */
    memset(sum, 0, sizeof sum);
    for (int point = 0; point < q; point++) {
        const double *C = c[IS_GIVEN] != 0 ? w + point * k * k : moduli;
        const double volume =
            weight[point] * derive(q, point, a, g, d, c[HAS_HOOP] != 0, nodes, basis, x, derivative);
        memset(stress, 0, sizeof stress);
        for (int t = 0; t < n_terms; t++) {
            const int component = terms[3 * t], place = terms[3 * t + 2];
            const double *by = derivative + (int)terms[3 * t + 1] * a;
            for (int s = 0; s < k; s++) {
                const double modulus = volume * C[s * k + place];
                if (modulus == 0) continue;
                double *to = stress + s * n + component * a;
                for (int b = 0; b < a; b++) to[b] += modulus * by[b];
            }
        }
        for (int t = 0; t < n_terms; t++) {
            const double *by = derivative + (int)terms[3 * t + 1] * a, *of = stress + (int)terms[3 * t + 2] * n;
            double *row = sum + (int)terms[3 * t] * a * n;
            for (int b = 0; b < a; b++, row += n)
                for (int j = 0; j < n; j++) row[j] += by[b] * of[j];
        }
    }
    for (int i = 0; i < d; i++)
        for (int b = 0; b < a; b++)
            for (int j = 0; j < d; j++)
                for (int e = 0; e < a; e++) A[(b * d + i) * n + e * d + j] += sum[((i * a + b) * d + j) * a + e];
}
