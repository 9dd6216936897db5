/* The consistent linearisation of the contact forces, added up over the points of one side in the slots of a block
 * matrix.
 *
 * With jump = v(x) - v(y), the variation of the closest point is d xi = (jump . tau + d . v'(y)) / (|tau|^2 - g b),
 * where tau and b are the opposite curve's tangent and n . y'' and d = x - y; the normal turns by
 * -(v'(y) . n + b d xi) / |tau| about the unit tangent. At a vertex of the curve xi stands still. The variation of the
 * gap d . n is jump . n less, at a vertex, d . tau times the turn; the variation of the step's slip (u(x) - u(y)) . tau is
 * jump . tau + (u(x) - u(y)) . n d turn - u'(y) . tau d xi. The trial traction is the own stress's in the turning frame,
 * less gamma times gap and slip. The law's derivatives take both variations to the variation of pressure and shear. */

#include <math.h>

#include "contact_tangent.h"

enum { MOST = 24 }; /* nodes of a cell (degree 4: 15) and of the opposite facet (5) */
enum { X, Y, D };   /* components of a displacement; so many */
enum { N, T };      /* components in the frame: normal and tangent */

/* A derivative at one point by the displacements of the own cell's nodes, then of the opposite facet's. */
typedef double Row[MOST][D];

typedef struct {
    Row trial[D];   /* of the trial traction, in the frame */
    Row opening[D]; /* of gap and slip */
    Row turn, xi;   /* of the frame and of the partner */
} Rates;

/* The derivative of the own stress vector by the own nodes, in x and y. */
static void stress_rates(const Side *s, int32_t i, Row stress[D])
{
    for (int r = X; r <= Y; r++) {
        const double *C = s->moduli + s->g * (D * i + r);
        for (int c = 0; c < s->a + s->o; c++) stress[r][c][X] = stress[r][c][Y] = 0;
        for (int c = 0; c < s->a; c++) {
            const double *derivative = s->derivative + s->m * (s->a * i + c);
            for (int t = 0; t < s->g; t++) stress[r][c][s->terms[2 * t]] += C[t] * derivative[s->terms[2 * t + 1]];
        }
    }
}

/* All rates at the point i; rates of the opening only if they are wanted. */
static void linearise(const Side *s, int32_t i, int with_opening, Rates *d)
{
    const int32_t a = s->a, o = s->o, columns = a + o;
    const double *n = s->normal + D * i, of_gap = s->gamma[2 * i], of_slip = s->gamma[2 * i + 1];
    const double unit[D] = {-n[Y], n[X]}; /* tangent */
    double jump[MOST], slope[MOST];
    Row stress[D];
    stress_rates(s, i, stress);
    for (int c = 0; c < a; c++) jump[c] = s->shape[i * a + c], slope[c] = 0;
    for (int c = 0; c < o; c++) {
        jump[a + c] = -s->partner_shape[i * o + c];
        slope[a + c] = s->partner_slope[i * o + c];
    }
    for (int c = 0; c < columns; c++)
        for (int j = X; j <= Y; j++) {
            d->trial[N][c][j] = n[X] * stress[X][c][j] + n[Y] * stress[Y][c][j] - of_gap * jump[c] * n[j];
            d->trial[T][c][j] = n[X] * stress[Y][c][j] - n[Y] * stress[X][c][j] - of_slip * jump[c] * unit[j];
            d->turn[c][j] = d->xi[c][j] = 0;
        }
    if (with_opening)
        for (int c = 0; c < columns; c++)
            for (int j = X; j <= Y; j++) {
                d->opening[N][c][j] = jump[c] * n[j];
                d->opening[T][c][j] = jump[c] * unit[j];
            }
    if (!s->moves) return;
    const double *tau = s->tangent + D * i, *apart = s->separation + D * i, *t = s->stress_vector + D * i;
    const double bend = s->bend[i], speed = sqrt(tau[X] * tau[X] + tau[Y] * tau[Y]);
    const double gap = apart[X] * n[X] + apart[Y] * n[Y], aside = apart[X] * tau[X] + apart[Y] * tau[Y];
    const double along = s->slides[i] ? 1 / (speed * speed - gap * bend) : 0;
    const double rise = s->strayed[2 * i], drift = s->strayed[2 * i + 1];
    const double lever = (of_gap * aside - (t[X] * tau[X] + t[Y] * tau[Y])) / speed;
    const double across = t[X] * n[X] + t[Y] * n[Y] - of_slip * rise;
    for (int c = 0; c < columns; c++)
        for (int j = X; j <= Y; j++) {
            const double xi = along * (jump[c] * tau[j] + slope[c] * apart[j]);
            const double turn = (slope[c] * n[j] + bend * xi) / speed;
            d->xi[c][j] = xi;
            d->turn[c][j] = turn;
            d->trial[N][c][j] += lever * turn;
            d->trial[T][c][j] += of_slip * drift * xi + across * turn;
            if (with_opening) {
                d->opening[N][c][j] -= aside / speed * turn;
                d->opening[T][c][j] += rise * turn - drift * xi;
            }
        }
}

void contact_tangent(const Side *s, const int32_t *place, const int32_t *slots, const int32_t *number, double *values)
{
    const int32_t a = s->a, k = s->k, o = s->o, columns = a + o, rows = k + o;
    for (int32_t i = 0; i < s->n * s->q; i++) {
        if (!s->active[i]) continue;
        Rates d;
        linearise(s, i, s->has_by_opening, &d);
        const int32_t facet = i / s->q, *slot = slots + (int64_t)place[i] * rows * columns;
        const double w = -s->share * s->weight[i], *n = s->normal + D * i, unit[D] = {-n[Y], n[X]};
        const double pressure = s->traction[D * i + N], shear = s->traction[D * i + T];
        const double *A = s->by_trial + D * D * i, *B = s->has_by_opening ? s->by_opening + D * D * i : 0;
        double force[MOST][D][D]; /* derivative of pressure n + shear unit: component, then displacement */
        for (int c = 0; c < columns; c++)
            for (int j = X; j <= Y; j++) {
                double dp = A[0] * d.trial[N][c][j] + A[1] * d.trial[T][c][j] + shear * d.turn[c][j];
                double dq = A[2] * d.trial[N][c][j] + A[3] * d.trial[T][c][j] - pressure * d.turn[c][j];
                if (B) {
                    dp += B[0] * d.opening[N][c][j] + B[1] * d.opening[T][c][j];
                    dq += B[2] * d.opening[N][c][j] + B[3] * d.opening[T][c][j];
                }
                for (int l = X; l <= Y; l++) force[c][l][j] = n[l] * dp + unit[l] * dq;
            }
        for (int r = 0; r < rows; r++) {
            const int own = r < k;
            const double v = w * (own ? s->shape[i * a + s->trace[facet * k + r]] : -s->partner_shape[i * o + r - k]);
            const double slope = own ? 0 : w * s->partner_slope[i * o + r - k];
            double slid[D]; /* what the force on the row changes as its partner moves along the facet */
            for (int l = X; l <= Y; l++) slid[l] = slope * (pressure * n[l] + shear * unit[l]);
            for (int c = 0; c < columns; c++) {
                double *block = values + D * D * (int64_t)number[slot[r * columns + c]];
                for (int l = X; l <= Y; l++)
                    for (int j = X; j <= Y; j++) block[D * l + j] += v * force[c][l][j] - slid[l] * d.xi[c][j];
            }
        }
    }
}

void point_rates(const Side *s, const double *own, const double *opposite, double *trial, double *opening)
{
    for (int32_t i = 0; i < s->n * s->q; i++, trial += D, opening += D) {
        Rates d;
        linearise(s, i, 1, &d);
        for (int r = N; r <= T; r++) {
            trial[r] = opening[r] = 0;
            for (int c = 0; c < s->a + s->o; c++) {
                const double *u = c < s->a ? own + D * (s->a * (i / s->q) + c) : opposite + D * (s->o * i + c - s->a);
                for (int j = X; j <= Y; j++) {
                    trial[r] += d.trial[r][c][j] * u[j];
                    opening[r] += d.opening[r][c][j] * u[j];
                }
            }
        }
    }
}
