/* Closest points on polynomial facets: see geometry/curve.py for the meaning of every argument. */

#include <math.h>

#include "closest_point.h"

enum { MOST = 5 };  /* nodes of a facet (degree 4) */
enum { NONE = -2 }; /* facet is faced */
static const double TIE = 1e-10; /* of two facets as near, which meet at an angle, the first one, whatever the rounding */

typedef struct {
    double y[2], t[2], k[2]; /* position, first and second derivative */
} Frame;

/* The frame at xi of the facet with nodes X, and the values N and slopes dN of its p + 1 shape functions, which are given
   by their monomial coefficients. */
static Frame frame(int p, const double *coefficients, const double *X, double xi, double *N, double *dN)
{
    Frame f = {{0, 0}, {0, 0}, {0, 0}};
    for (int a = 0; a <= p; a++) {
        const double *c = coefficients + a * (p + 1);
        double v = c[p], d = 0, dd = 0;
        for (int i = p - 1; i >= 0; i--) { /* Horner */
            dd = dd * xi + 2 * d;
            d = d * xi + v;
            v = v * xi + c[i];
        }
        N[a] = v, dN[a] = d;
        for (int i = 0; i < 2; i++) {
            f.y[i] += v * X[2 * a + i];
            f.t[i] += d * X[2 * a + i];
            f.k[i] += dd * X[2 * a + i];
        }
    }
    return f;
}

/* Newton's method on one facet, kept between low and high. */
static double closest_on_facet(int p, const double *coefficients, const double *X, const double *x, double xi,
                               double low, double high, int32_t steps)
{
    double N[MOST], dN[MOST];
    for (int step = 0; step < steps; step++) {
        const Frame f = frame(p, coefficients, X, xi, N, dN);
        const double d[2] = {x[0] - f.y[0], x[1] - f.y[1]};
        const double speed2 = f.t[0] * f.t[0] + f.t[1] * f.t[1];
        /* beyond the centre of curvature the distance is no longer convex: fall back to the first-order metric */
        double metric = speed2 - (d[0] * f.k[0] + d[1] * f.k[1]);
        if (!(metric > 0.1 * speed2)) metric = speed2;
        double next = xi + (d[0] * f.t[0] + d[1] * f.t[1]) / metric;
        if (next < low) next = low;
        if (next > high) next = high;
        const double moved = fabs(next - xi);
        xi = next;
        if (!(moved >= 1e-14)) break;
    }
    return xi;
}

int32_t closest_points(int32_t m, const double *x, const double *outward, int32_t p, const double *X,
                       const int32_t *before, const int32_t *after, const double *coefficients, const int32_t *home,
                       const int32_t *faced, int32_t reach, double margin, double end_margin, int32_t steps, int32_t *facet, double *xi,
                       double *point, double *normal, double *tangent, double *bend, double *shape, double *slope,
                       uint8_t *slides, uint8_t *found, int32_t *lost)
{
    int32_t n_lost = 0;
    for (int32_t i = 0; i < m; i++, x += 2, outward += 2) {
        const int32_t near[3] = {before[home[i]], home[i], after[home[i]]};
        double least = INFINITY, N[MOST], dN[MOST], low_best = 0, high_best = 1;
        facet[i] = -1;
        for (int c = 1 - reach; c <= 1 + reach; c++) {
            const int32_t k = near[c];
            if (k < 0) continue;
            const double beyond_end = faced[i] == NONE ? 0 : end_margin;
            const double low = before[k] < 0 ? -beyond_end : -margin;
            const double high = 1 + (after[k] < 0 ? beyond_end : margin);
            const double at = closest_on_facet(p, coefficients, X + 2 * (p + 1) * k, x, 1 - 0.5 * c, low, high, steps);
            const Frame f = frame(p, coefficients, X + 2 * (p + 1) * k, at, N, dN);
            const double d2 = (x[0] - f.y[0]) * (x[0] - f.y[0]) + (x[1] - f.y[1]) * (x[1] - f.y[1]);
            if (d2 < least * (1 - TIE) || facet[i] < 0) {
                least = d2, facet[i] = k, xi[i] = at, low_best = low, high_best = high;
            }
        }
        const int32_t k = facet[i];
        const Frame f = frame(p, coefficients, X + 2 * (p + 1) * k, xi[i], shape + i * (p + 1), slope + i * (p + 1));
        const double speed = hypot(f.t[0], f.t[1]);
        const double d[2] = {x[0] - f.y[0], x[1] - f.y[1]};
        const double along = (d[0] * f.t[0] + d[1] * f.t[1]) / (speed * speed); /* what is left of the Newton step */
        const int clamped = xi[i] <= low_best || xi[i] >= high_best;
        const int beyond = (before[k] < 0 && xi[i] <= low_best && along < 0)
                           || (after[k] < 0 && xi[i] >= high_best && along > 0);
        double *n = normal + 2 * i;
        n[0] = f.t[1] / speed, n[1] = -f.t[0] / speed;
        for (int j = 0; j < 2; j++) point[2 * i + j] = f.y[j], tangent[2 * i + j] = f.t[j];
        bend[i] = n[0] * f.k[0] + n[1] * f.k[1];
        slides[i] = !clamped;
        found[i] = !beyond && n[0] * outward[0] + n[1] * outward[1] < 0;
        if (!clamped && !(fabs(along) <= 1e-9 * (1 + hypot(d[0], d[1]) / speed))) {
            if (!n_lost) *lost = i;
            n_lost++;
        }
    }
    return n_lost;
}
