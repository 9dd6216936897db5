/* The consistent linearisation of the contact forces, added up over the points of one side in the slots of a block
 * matrix.
 *
 * With jump = v(x) - v(y), the variation of the closest point is d xi = (jump . tau + d . v'(y)) / (|tau|^2 - g b),
 * where tau and b are the opposite curve's tangent and n . y'' and d = x - y; the normal turns by
 * -(v'(y) . n + b d xi) / |tau| about the unit tangent. At a vertex of the curve xi stands still. */

#include <math.h>

#include "contact_tangent.h"

enum { TIED, REFERENCE, CURRENT };
enum { MOST = 24 }; /* nodes of a cell (degree 4: 15) and of the opposite facet (5) */

/* Derivatives at one point by the displacements of the own cell's nodes, then of the opposite facet's. */
typedef struct {
    double jump[MOST], traction[MOST][2][2]; /* of the traction sigma N: component, then displacement */
    double pressure[MOST][2], turn[MOST][2], xi[MOST][2];
    double unit[2]; /* tangent of the opposite */
} Rates;

static void linearise(const Side *s, int32_t i, Rates *d)
{
    const int32_t a = s->a, o = s->o, columns = a + o;
    const double *N = s->outward + 2 * i, *C = s->moduli + 9 * i, *nu = s->normal + 2 * i, g = s->gamma[i];
    double slope[MOST];
    for (int c = 0; c < a; c++) {
        d->jump[c] = s->own_shape[i * a + c], slope[c] = 0;
        const double gx = s->gradient[2 * (i * a + c)], gy = s->gradient[2 * (i * a + c) + 1];
        double stress[3][2]; /* xx, yy, xy from a displacement of this node in x and y */
        for (int r = 0; r < 3; r++) {
            stress[r][0] = C[3 * r] * gx + C[3 * r + 2] * gy;
            stress[r][1] = C[3 * r + 1] * gy + C[3 * r + 2] * gx;
        }
        for (int j = 0; j < 2; j++) {
            d->traction[c][0][j] = N[0] * stress[0][j] + N[1] * stress[2][j];
            d->traction[c][1][j] = N[0] * stress[2][j] + N[1] * stress[1][j];
        }
    }
    for (int c = 0; c < o; c++) {
        d->jump[a + c] = -s->shape[i * o + c], slope[a + c] = s->slope[i * o + c];
        for (int j = 0; j < 4; j++) d->traction[a + c][j / 2][j % 2] = 0;
    }
    for (int c = 0; c < columns; c++)
        for (int j = 0; j < 2; j++) {
            const double along = nu[0] * d->traction[c][0][j] + nu[1] * d->traction[c][1][j];
            d->pressure[c][j] = along - g * d->jump[c] * nu[j];
            d->turn[c][j] = d->xi[c][j] = 0;
        }
    d->unit[0] = d->unit[1] = 0;
    if (s->kinematics != CURRENT) return;
    const double *tau = s->tangent + 2 * i, *x_y = s->separation + 2 * i, *t = s->traction + 2 * i, b = s->bend[i];
    const double speed = sqrt(tau[0] * tau[0] + tau[1] * tau[1]);
    const double slide = s->slides[i] ? 1 / (speed * speed - s->gap[i] * b) : 0;
    d->unit[0] = tau[0] / speed, d->unit[1] = tau[1] / speed;
    /* p follows the turning normal through t . n and, where y is a vertex, through the gap */
    const double lever = g * (x_y[0] * d->unit[0] + x_y[1] * d->unit[1]) - (t[0] * d->unit[0] + t[1] * d->unit[1]);
    for (int c = 0; c < columns; c++)
        for (int j = 0; j < 2; j++) {
            d->xi[c][j] = slide * (d->jump[c] * tau[j] + slope[c] * x_y[j]);
            d->turn[c][j] = (slope[c] * nu[j] + b * d->xi[c][j]) / speed;
            d->pressure[c][j] += lever * d->turn[c][j];
        }
}

void contact_tangent(const Side *s, const int32_t *base, const int32_t *low, const int32_t *slots, double *values)
{
    const int32_t a = s->a, k = s->k, o = s->o, columns = a + o, rows = k + o;
    for (int32_t i = 0; i < s->n * s->q; i++) {
        if (!s->active[i]) continue;
        Rates d;
        linearise(s, i, &d);
        const int32_t f = i / s->q, *slot = slots + (int64_t)(base[f] + s->facet[i] - low[f]) * rows * columns;
        const double w = -s->share * s->weight[i], g = s->gamma[i], p = s->pressure[i], *nu = s->normal + 2 * i;
        for (int r = 0; r < rows; r++) {
            const int own = r < k;
            const double jump = own ? s->own_shape[i * a + s->trace[f * k + r]] : -s->shape[i * o + r - k];
            const double slope = own ? 0 : s->slope[i * o + r - k];
            const double v = w * jump, turned = v * p, slid = w * p * slope;
            const double x[2] = {v * nu[0], v * nu[1]}, y[2] = {turned * d.unit[0], turned * d.unit[1]};
            const double z[2] = {slid * nu[0], slid * nu[1]};
            for (int c = 0; c < columns; c++) {
                double *block = values + 4 * (int64_t)slot[r * columns + c];
                for (int ij = 0; ij < 4; ij++) {
                    const int l = ij / 2, j = ij % 2;
                    block[ij] += s->kinematics == TIED ? v * (d.traction[c][l][j] - (l == j ? g * d.jump[c] : 0))
                                                       : x[l] * d.pressure[c][j] - y[l] * d.turn[c][j] - z[l] * d.xi[c][j];
                }
            }
        }
    }
}

void contact_pressure_rate(const Side *s, const double *own, const double *opposite, double *rate)
{
    for (int32_t i = 0; i < s->n * s->q; i++) {
        Rates d;
        linearise(s, i, &d);
        rate[i] = 0;
        for (int j = 0; j < 2 * s->a; j++) rate[i] += d.pressure[j / 2][j % 2] * own[2 * s->a * (i / s->q) + j];
        for (int j = 0; j < 2 * s->o; j++) rate[i] += d.pressure[s->a + j / 2][j % 2] * opposite[2 * s->o * i + j];
    }
}
