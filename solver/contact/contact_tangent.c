/* The consistent linearisation of the contact forces, added up over the points of one side in the slots of a block
 * matrix.
 *
 * With jump = v(x) - v(y), the variation of the closest point is d xi = (jump . tau + d . v'(y)) / (|tau|^2 - g b),
 * where tau and b are the opposite curve's tangent and n . y'' and d = x - y; the normal turns by
 * -(v'(y) . n + b d xi) / |tau| about the unit tangent. At a vertex of the curve xi stands still. The law's derivative
 * takes the trial traction's variation to that of pressure and shear; that of the
 * step's slip (u(x) - u(y)) . tau is jump . tau + (u(x) - u(y)) . n d turn - u'(y) . tau d xi. */

#include <math.h>

#include "contact_tangent.h"

enum { MOST = 24 }; /* nodes of a cell (degree 4: 15) and of the opposite facet (5) */

/* Derivatives at one point by the displacements of the own cell's nodes, then of the opposite facet's. */
typedef struct {
    double pressure[MOST][2], shear[MOST][2]; /* of the trial traction */
    double turn[MOST][2], xi[MOST][2];
} Rates;

static void linearise(const Side *s, int32_t i, Rates *d)
{
    const int32_t a = s->a, o = s->o, columns = a + o;
    const double *C = s->moduli + 8 * i, *n = s->normal + 2 * i, g = s->gamma[2 * i], h = s->gamma[2 * i + 1];
    double jump[MOST], slope[MOST], stress[MOST][2][2]; /* of the stress vector: component, then displacement */
    for (int c = 0; c < a; c++) {
        jump[c] = s->own_shape[i * a + c], slope[c] = 0;
        const double gx = s->gradient[2 * (i * a + c)], gy = s->gradient[2 * (i * a + c) + 1];
        for (int r = 0; r < 2; r++) {
            stress[c][r][0] = C[4 * r] * gx + C[4 * r + 2] * gy;
            stress[c][r][1] = C[4 * r + 1] * gy + C[4 * r + 3] * gx;
        }
    }
    for (int c = 0; c < o; c++) {
        jump[a + c] = -s->shape[i * o + c], slope[a + c] = s->slope[i * o + c];
        for (int j = 0; j < 4; j++) stress[a + c][j / 2][j % 2] = 0;
    }
    for (int c = 0; c < columns; c++)
        for (int j = 0; j < 2; j++) {
            const double *t[2] = {stress[c][0], stress[c][1]}, across = j ? n[0] : -n[1];
            d->pressure[c][j] = n[0] * t[0][j] + n[1] * t[1][j] - g * jump[c] * n[j];
            d->shear[c][j] = n[0] * t[1][j] - n[1] * t[0][j] - h * jump[c] * across;
            d->turn[c][j] = d->xi[c][j] = 0;
        }
    if (!s->moves) return;
    const double *tau = s->tangent + 2 * i, *x_y = s->separation + 2 * i, *t = s->stress_vector + 2 * i, b = s->bend[i];
    const double speed = sqrt(tau[0] * tau[0] + tau[1] * tau[1]);
    const double slide = s->slides[i] ? 1 / (speed * speed - (x_y[0] * n[0] + x_y[1] * n[1]) * b) : 0;
    /* the trial pressure follows the turning normal through t . n and, where y is a vertex, through the gap */
    const double lever = (g * (x_y[0] * tau[0] + x_y[1] * tau[1]) - (t[0] * tau[0] + t[1] * tau[1])) / speed;
    const double *strayed = s->strayed + 2 * i, across = t[0] * n[0] + t[1] * n[1] - s->gamma[2 * i + 1] * strayed[0];
    for (int c = 0; c < columns; c++)
        for (int j = 0; j < 2; j++) {
            d->xi[c][j] = slide * (jump[c] * tau[j] + slope[c] * x_y[j]);
            d->turn[c][j] = (slope[c] * n[j] + b * d->xi[c][j]) / speed;
            d->pressure[c][j] += lever * d->turn[c][j];
            d->shear[c][j] += s->gamma[2 * i + 1] * strayed[1] * d->xi[c][j] + across * d->turn[c][j];
        }
}

void contact_tangent(const Side *s, const int32_t *place, const int32_t *slots, double *values)
{
    const int32_t a = s->a, k = s->k, o = s->o, columns = a + o, rows = k + o;
    for (int32_t i = 0; i < s->n * s->q; i++) {
        if (!s->active[i]) continue;
        Rates d;
        linearise(s, i, &d);
        const int32_t f = i / s->q, *slot = slots + (int64_t)place[i] * rows * columns;
        const double w = -s->share * s->weight[i], *n = s->normal + 2 * i, tau[2] = {-n[1], n[0]};
        const double *D = s->derivative + 4 * i, p = s->traction[2 * i], q = s->traction[2 * i + 1];
        double force[MOST][4]; /* derivative of p n + q tau: component, then displacement */
        for (int c = 0; c < columns; c++)
            for (int ij = 0; ij < 4; ij++) {
                const int l = ij / 2, j = ij % 2;
                const double dp = D[0] * d.pressure[c][j] + D[1] * d.shear[c][j] + q * d.turn[c][j];
                const double dq = D[2] * d.pressure[c][j] + D[3] * d.shear[c][j] - p * d.turn[c][j];
                force[c][ij] = n[l] * dp + tau[l] * dq;
            }
        for (int r = 0; r < rows; r++) {
            const int own = r < k;
            const double v = w * (own ? s->own_shape[i * a + s->trace[f * k + r]] : -s->shape[i * o + r - k]);
            const double slope = own ? 0 : w * s->slope[i * o + r - k];
            const double slid[2] = {slope * (p * n[0] + q * tau[0]), slope * (p * n[1] + q * tau[1])};
            for (int c = 0; c < columns; c++) {
                double *block = values + 4 * (int64_t)slot[r * columns + c];
                for (int ij = 0; ij < 4; ij++) block[ij] += v * force[c][ij] - slid[ij / 2] * d.xi[c][ij % 2];
            }
        }
    }
}

void trial_rate(const Side *s, const double *own, const double *opposite, double *rate)
{
    for (int32_t i = 0; i < s->n * s->q; i++) {
        Rates d;
        linearise(s, i, &d);
        double *r = rate + 2 * i;
        r[0] = r[1] = 0;
        for (int c = 0; c < s->a + s->o; c++) {
            const double *u = c < s->a ? own + 2 * (s->a * (i / s->q) + c) : opposite + 2 * (s->o * i + c - s->a);
            for (int j = 0; j < 2; j++) r[0] += d.pressure[c][j] * u[j], r[1] += d.shear[c][j] * u[j];
        }
    }
}
