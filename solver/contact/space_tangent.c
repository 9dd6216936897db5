/* The consistent linearisation of the contact forces in space, added up over the points of one side in the slots of a
 * block matrix.
 *
 * With jump = v(x) - v(y) and d = x - y, the variation of the closest point is d xi = A (jump . tau + d . v'(y)), where
 * tau are the opposite facet's tangents and A is the inverse of tau . tau - d . y'', kept on the edge or at the corner
 * where the closest point lies. The normal turns by d n = -tau^c w_c, w_c = v'_c(y) . n + b_cd d xi_d, with b = n . y''
 * and tau^c dual to tau_c. Its components along the tangents t of the frame are turn_k = d n . t_k; d t_1 = -turn_1 n +
 * about t_2 and d t_2 = -turn_2 n - about t_1, where the frame turns about its normal by about = spin . turn. The variation
 * of the gap d . n is jump . n + d . d n; the variation of the step's slip (u(x) - u(y)) . t_k is jump . t_k +
 * (u(x) - u(y)) . d t_k - u'(y) . t_k d xi. The trial traction is the own stress's in the turning frame, less gamma times
 * gap and slips. The law's derivatives take both variations to the variation of pressure and shears. */

#include "space_tangent.h"

enum { MOST = 80 };     /* nodes of a cell (degree 3: 64) and of the opposite facet (16) */
enum { D = 3, P = 2 };  /* components of a displacement; coordinates on a facet */
enum { N, T1, T2 };     /* components in the frame: normal and tangents */

/* A derivative at one point by the displacements of the own cell's nodes, then of the opposite facet's. */
typedef double Row[MOST][D];

typedef struct {
    Row trial[D];   /* of the trial traction, in the frame */
    Row opening[D]; /* of gap and slips */
    Row turn[P];    /* of the normal along the tangents */
    Row xi[P];      /* of the partner */
} Rates;

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* The derivative of the own stress vector by the own nodes. */
static void stress_rates(const Side *s, int32_t i, Row stress[D])
{
    for (int r = 0; r < D; r++) {
        const double *C = s->moduli + s->g * ((int64_t)D * i + r);
        for (int c = 0; c < s->a + s->o; c++)
            for (int j = 0; j < D; j++) stress[r][c][j] = 0;
        for (int c = 0; c < s->a; c++) {
            const double *derivative = s->derivative + s->m * ((int64_t)s->a * i + c);
            for (int t = 0; t < s->g; t++) stress[r][c][s->terms[2 * t]] += C[t] * derivative[s->terms[2 * t + 1]];
        }
    }
}

/* The components along the frame's tangents of the vectors dual to the facet's tangents. */
static void dual_components(const double tangent[P][D], const double *frame, double dual[P][P])
{
    const double g11 = dot(tangent[0], tangent[0]), g12 = dot(tangent[0], tangent[1]), g22 = dot(tangent[1], tangent[1]);
    const double det = g11 * g22 - g12 * g12;
    for (int k = 0; k < P; k++) {
        const double one = dot(tangent[0], frame + D * (T1 + k)), two = dot(tangent[1], frame + D * (T1 + k));
        dual[0][k] = (g22 * one - g12 * two) / det;
        dual[1][k] = (g11 * two - g12 * one) / det;
    }
}

/* What the motion of partner and frame adds to the rates at the point i. */
static void follow(const Side *s, int32_t i, const double *jump, const double slope[P][MOST], Rates *d)
{
    const int32_t columns = s->a + s->o;
    const double *frame = s->frame + D * D * (int64_t)i, *n = frame, *gamma = s->gamma + D * (int64_t)i;
    const double *apart = s->separation + D * (int64_t)i, *stress = s->stress_vector + D * (int64_t)i;
    const double(*tau)[D] = (const double(*)[D])(s->tangent + P * D * (int64_t)i);
    const double(*bend)[P] = (const double(*)[P])(s->bend + P * P * (int64_t)i);
    const double(*along)[P] = (const double(*)[P])(s->along + P * P * (int64_t)i);
    const double *opening = s->opening + D * (int64_t)i, *strayed = s->strayed + (1 + P * P) * (int64_t)i;
    const double rise = strayed[0], *drift = strayed + 1, *spin = s->spin + P * (int64_t)i;
    double dual[P][P], own[D], aside[P];
    dual_components(tau, frame, dual);
    for (int r = 0; r < D; r++) own[r] = dot(frame + D * r, stress);
    for (int k = 0; k < P; k++) aside[k] = dot(frame + D * (T1 + k), apart);
    for (int c = 0; c < columns; c++)
        for (int j = 0; j < D; j++) {
            double push[P], w[P];
            for (int e = 0; e < P; e++) push[e] = jump[c] * tau[e][j] + slope[e][c] * apart[j];
            for (int e = 0; e < P; e++) d->xi[e][c][j] = along[e][0] * push[0] + along[e][1] * push[1];
            for (int e = 0; e < P; e++)
                w[e] = slope[e][c] * n[j] + bend[e][0] * d->xi[0][c][j] + bend[e][1] * d->xi[1][c][j];
            for (int k = 0; k < P; k++) d->turn[k][c][j] = -(dual[0][k] * w[0] + dual[1][k] * w[1]);
            const double turn[P] = {d->turn[0][c][j], d->turn[1][c][j]}, about = spin[0] * turn[0] + spin[1] * turn[1];
            const double gap = aside[0] * turn[0] + aside[1] * turn[1];
            const double across[P] = {about * own[T2], -about * own[T1]};
            const double slid[P] = {about * opening[T2], -about * opening[T1]};
            d->opening[N][c][j] += gap;
            d->trial[N][c][j] += own[T1] * turn[0] + own[T2] * turn[1] - gamma[N] * gap;
            for (int k = 0; k < P; k++) {
                const double slip = slid[k] - rise * turn[k] - drift[k] * d->xi[0][c][j] - drift[P + k] * d->xi[1][c][j];
                d->opening[T1 + k][c][j] += slip;
                d->trial[T1 + k][c][j] += across[k] - own[N] * turn[k] - gamma[T1 + k] * slip;
            }
        }
}

/* All rates at the point i. */
static void linearise(const Side *s, int32_t i, Rates *d)
{
    const int32_t a = s->a, o = s->o, columns = a + o;
    const double *frame = s->frame + D * D * (int64_t)i, *gamma = s->gamma + D * (int64_t)i;
    double jump[MOST], slope[P][MOST];
    Row stress[D];
    stress_rates(s, i, stress);
    for (int c = 0; c < a; c++) jump[c] = s->shape[(int64_t)i * a + c], slope[0][c] = slope[1][c] = 0;
    for (int c = 0; c < o; c++) {
        jump[a + c] = -s->partner_shape[(int64_t)i * o + c];
        for (int e = 0; e < P; e++) slope[e][a + c] = s->partner_slope[((int64_t)P * i + e) * o + c];
    }
    for (int r = 0; r < D; r++) {
        const double *f = frame + D * r;
        for (int c = 0; c < columns; c++)
            for (int j = 0; j < D; j++) {
                d->opening[r][c][j] = jump[c] * f[j];
                d->trial[r][c][j] = f[0] * stress[0][c][j] + f[1] * stress[1][c][j] + f[2] * stress[2][c][j]
                                    - gamma[r] * jump[c] * f[j];
            }
    }
    for (int e = 0; e < P; e++)
        for (int c = 0; c < columns; c++)
            for (int j = 0; j < D; j++) d->turn[e][c][j] = d->xi[e][c][j] = 0;
    if (s->moves) follow(s, i, jump, slope, d);
}

/* The derivative (component, then displacement) of the contact force per area at the point i by the column c. */
static void force_rate(const Side *s, int32_t i, const Rates *d, int c, double force[D][D])
{
    const double *frame = s->frame + D * D * (int64_t)i, *f = s->traction + D * (int64_t)i;
    const double *spin = s->spin + P * (int64_t)i;
    const double *A = s->by_trial + D * D * (int64_t)i, *B = s->by_opening + D * D * (int64_t)i;
    for (int j = 0; j < D; j++) {
        double rate[D];
        for (int r = 0; r < D; r++) {
            rate[r] = 0;
            for (int q = 0; q < D; q++) rate[r] += A[D * r + q] * d->trial[q][c][j];
            if (!s->has_by_opening) continue;
            for (int q = 0; q < D; q++) rate[r] += B[D * r + q] * d->opening[q][c][j];
        }
        const double turn[P] = {d->turn[0][c][j], d->turn[1][c][j]}, about = spin[0] * turn[0] + spin[1] * turn[1];
        rate[N] -= f[T1] * turn[0] + f[T2] * turn[1];
        rate[T1] += f[N] * turn[0] - about * f[T2];
        rate[T2] += f[N] * turn[1] + about * f[T1];
        for (int l = 0; l < D; l++)
            force[l][j] = frame[l] * rate[N] + frame[D + l] * rate[T1] + frame[2 * D + l] * rate[T2];
    }
}

void contact_tangent(const Side *s, const int32_t *place, const int32_t *slots, double *values)
{
    const int32_t a = s->a, k = s->k, o = s->o, columns = a + o, rows = k + o;
    for (int32_t i = 0; i < s->n * s->q; i++) {
        if (!s->active[i]) continue;
        Rates d;
        linearise(s, i, &d);
        const int32_t facet = i / s->q, *slot = slots + (int64_t)place[i] * rows * columns;
        const double w = -s->share * s->weight[i], *frame = s->frame + D * D * (int64_t)i;
        const double *f = s->traction + D * (int64_t)i;
        double traction[D];
        for (int l = 0; l < D; l++) traction[l] = frame[l] * f[N] + frame[D + l] * f[T1] + frame[2 * D + l] * f[T2];
        for (int c = 0; c < columns; c++) {
            double force[D][D];
            force_rate(s, i, &d, c, force);
            for (int r = 0; r < rows; r++) {
                double *block = values + D * D * (int64_t)slot[r * columns + c];
                if (r < k) {
                    const double v = w * s->shape[(int64_t)i * a + s->trace[facet * k + r]];
                    for (int l = 0; l < D; l++)
                        for (int j = 0; j < D; j++) block[D * l + j] += v * force[l][j];
                    continue;
                }
                const double v = -w * s->partner_shape[(int64_t)i * o + r - k];
                const double *slope = s->partner_slope + (int64_t)P * i * o + r - k;
                for (int j = 0; j < D; j++) {
                    /* the shape function at the partner changes as it moves along the facet */
                    const double moved = w * (slope[0] * d.xi[0][c][j] + slope[o] * d.xi[1][c][j]);
                    for (int l = 0; l < D; l++) block[D * l + j] += v * force[l][j] - moved * traction[l];
                }
            }
        }
    }
}

void point_rates(const Side *s, const double *own, const double *opposite, double *trial, double *opening)
{
    for (int32_t i = 0; i < s->n * s->q; i++, trial += D, opening += D) {
        Rates d;
        linearise(s, i, &d);
        for (int r = 0; r < D; r++) {
            trial[r] = opening[r] = 0;
            for (int c = 0; c < s->a + s->o; c++) {
                const double *u = c < s->a ? own + (int64_t)D * (s->a * (i / s->q) + c)
                                           : opposite + (int64_t)D * (s->o * i + c - s->a);
                for (int j = 0; j < D; j++) {
                    trial[r] += d.trial[r][c][j] * u[j];
                    opening[r] += d.opening[r][c][j] * u[j];
                }
            }
        }
    }
}
