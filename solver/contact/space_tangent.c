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
 * gap and slips. The law's derivatives take both variations to the variation of pressure and shears.
 *
 * All of this depends on jump, v'(y) and the rate of the stress alone, twelve numbers. So the kernel takes unit values of
 * them to rates of the force once a point, and these to the nodes. Consecutive points of one pair of facets are added up
 * before they go to the matrix. */

#include "space_tangent.h"

enum { ROWS = 32, COLUMNS = 80 }; /* nodes of both facets (degree 3: 16 each), of the cell (64) and the opposite facet */
enum { D = 3, P = 2 };            /* components of a displacement; coordinates on a facet */
enum { N, T1, T2 };               /* components in the frame: normal and tangents */
enum { UNITS = D * (2 + P) };     /* unit directions */

/* What displacements do at a point. */
typedef struct {
    double jump[D], slope[P][D], stress[D]; /* v(x) - v(y), v'(y), and the rate of the own stress vector */
} Direction;

typedef struct {
    double trial[D], opening[D]; /* of the trial traction, and of gap and slips, in the frame */
    double turn[P], xi[P];       /* of the normal along the tangents, and of the partner */
} Rates;

/* The state at a point. */
typedef struct {
    const double *frame, *gamma, *apart, *opening, *strayed, *spin, *traction, *by_trial, *by_opening;
    const double (*tau)[D], (*bend)[P], (*along)[P];
    double dual[P][P]; /* components along the frame's tangents of the vectors dual to the facet's tangents */
    double own[D];     /* the own stress vector in the frame */
    double aside[P];   /* components of the distance along the tangents */
    int moves;
} Point;

/* The derivatives of the force per area and of the partner by the columns of a point: nodes of the own cell, then of the
 * opposite facet. */
typedef struct {
    double force[COLUMNS][D][D], xi[COLUMNS][P][D]; /* the last index is of the displacement */
} Columns;

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static Point point(const Side *s, int64_t i)
{
    Point p = {
        .frame = s->frame + D * D * i,
        .gamma = s->gamma + D * i,
        .apart = s->separation + D * i,
        .opening = s->opening + D * i,
        .strayed = s->strayed + (1 + P * P) * i,
        .spin = s->spin + P * i,
        .traction = s->traction + D * i,
        .by_trial = s->by_trial + D * D * i,
        .by_opening = s->has_by_opening ? s->by_opening + D * D * i : 0,
        .tau = (const double(*)[D])(s->tangent + P * D * i),
        .bend = (const double(*)[P])(s->bend + P * P * i),
        .along = (const double(*)[P])(s->along + P * P * i),
        .moves = s->moves,
    };
    const double g11 = dot(p.tau[0], p.tau[0]), g12 = dot(p.tau[0], p.tau[1]), g22 = dot(p.tau[1], p.tau[1]);
    const double det = g11 * g22 - g12 * g12;
    for (int k = 0; k < P; k++) {
        const double *t = p.frame + D * (T1 + k), one = dot(p.tau[0], t), two = dot(p.tau[1], t);
        p.dual[0][k] = (g22 * one - g12 * two) / det;
        p.dual[1][k] = (g11 * two - g12 * one) / det;
        p.aside[k] = dot(t, p.apart);
    }
    for (int r = 0; r < D; r++) p.own[r] = dot(p.frame + D * r, s->stress_vector + D * i);
    return p;
}

/* How partner and normal move. */
static void follow(const Point *p, const Direction *d, Rates *r)
{
    double push[P], w[P];
    for (int e = 0; e < P; e++) push[e] = dot(d->jump, p->tau[e]) + dot(d->slope[e], p->apart);
    for (int e = 0; e < P; e++) r->xi[e] = p->along[e][0] * push[0] + p->along[e][1] * push[1];
    for (int e = 0; e < P; e++)
        w[e] = dot(d->slope[e], p->frame) + p->bend[e][0] * r->xi[0] + p->bend[e][1] * r->xi[1];
    for (int k = 0; k < P; k++) r->turn[k] = -(p->dual[0][k] * w[0] + p->dual[1][k] * w[1]);
}

static Rates rates(const Point *p, const Direction *d)
{
    Rates r = {{0}, {0}, {0}, {0}};
    if (p->moves) follow(p, d, &r);
    const double rise = p->strayed[0], *drift = p->strayed + 1, *turn = r.turn;
    const double about = p->spin[0] * turn[0] + p->spin[1] * turn[1];
    const double slid[P] = {about * p->opening[T2], -about * p->opening[T1]};
    r.opening[N] = dot(d->jump, p->frame) + p->aside[0] * turn[0] + p->aside[1] * turn[1];
    for (int k = 0; k < P; k++)
        r.opening[T1 + k] = dot(d->jump, p->frame + D * (T1 + k)) + slid[k] - rise * turn[k] - drift[k] * r.xi[0]
                            - drift[P + k] * r.xi[1];
    const double turned[D] = {p->own[T1] * turn[0] + p->own[T2] * turn[1], about * p->own[T2] - p->own[N] * turn[0],
                              -about * p->own[T1] - p->own[N] * turn[1]};
    for (int c = 0; c < D; c++) r.trial[c] = dot(d->stress, p->frame + D * c) + turned[c] - p->gamma[c] * r.opening[c];
    return r;
}

/* The rate of the contact force per area. */
static void force_rate(const Point *p, const Rates *r, double *force)
{
    const double *f = p->traction, *turn = r->turn, about = p->spin[0] * turn[0] + p->spin[1] * turn[1];
    double rate[D];
    for (int c = 0; c < D; c++) {
        rate[c] = dot(p->by_trial + D * c, r->trial);
        if (p->by_opening) rate[c] += dot(p->by_opening + D * c, r->opening);
    }
    rate[N] -= f[T1] * turn[0] + f[T2] * turn[1];
    rate[T1] += f[N] * turn[0] - about * f[T2];
    rate[T2] += f[N] * turn[1] + about * f[T1];
    for (int l = 0; l < D; l++)
        force[l] = p->frame[l] * rate[N] + p->frame[D + l] * rate[T1] + p->frame[2 * D + l] * rate[T2];
}

/* The derivatives by all columns, from those by the unit directions. */
static void linearise(const Side *s, int64_t i, const Point *p, Columns *all)
{
    const int32_t a = s->a, o = s->o, g = s->g;
    double force[UNITS][D], xi[UNITS][P]; /* by jump, v'(y) along both coordinates, and stress */
    for (int unit = 0; unit < UNITS; unit++) {
        Direction d = {{0}, {{0}}, {0}};
        double *of[] = {d.jump, d.slope[0], d.slope[1], d.stress};
        of[unit / D][unit % D] = 1;
        const Rates r = rates(p, &d);
        force_rate(p, &r, force[unit]);
        for (int e = 0; e < P; e++) xi[unit][e] = r.xi[e];
    }
    const double(*by_stress)[D] = (const double(*)[D])force[D * (1 + P)];
    for (int32_t c = 0; c < a; c++) {
        const double jump = s->shape[a * i + c];
        for (int j = 0; j < D; j++) {
            for (int l = 0; l < D; l++) all->force[c][l][j] = jump * force[j][l];
            for (int e = 0; e < P; e++) all->xi[c][e][j] = jump * xi[j][e];
        }
    }
    for (int32_t t = 0; t < g; t++) {
        const int j = s->terms[2 * t];
        const double *derivative = s->derivative + s->m * a * i + s->terms[2 * t + 1];
        const double *C = s->moduli + g * D * i + t;
        for (int l = 0; l < D; l++) {
            const double by_strain = by_stress[0][l] * C[0] + by_stress[1][l] * C[g] + by_stress[2][l] * C[2 * g];
            for (int32_t c = 0; c < a; c++) all->force[c][l][j] += by_strain * derivative[s->m * c];
        }
    }
    for (int32_t c = 0; c < o; c++) {
        const double jump = -s->partner_shape[o * i + c];
        const double slope[P] = {s->partner_slope[P * o * i + c], s->partner_slope[P * o * i + o + c]};
        for (int j = 0; j < D; j++) {
            for (int l = 0; l < D; l++)
                all->force[a + c][l][j] = jump * force[j][l] + slope[0] * force[D + j][l] + slope[1] * force[2 * D + j][l];
            for (int e = 0; e < P; e++)
                all->xi[a + c][e][j] = jump * xi[j][e] + slope[0] * xi[D + j][e] + slope[1] * xi[2 * D + j][e];
        }
    }
}

/* Add the residual's derivative at a point to the blocks (k + o, a + o) of its pair of facets. */
static void add_point(const Side *s, int64_t i, double *blocks)
{
    const int32_t a = s->a, k = s->k, o = s->o, columns = a + o;
    const Point p = point(s, i);
    Columns all;
    linearise(s, i, &p, &all);
    const double w = -s->share * s->weight[i], *frame = p.frame, *f = p.traction;
    double traction[D];
    for (int l = 0; l < D; l++) traction[l] = w * (frame[l] * f[N] + frame[D + l] * f[T1] + frame[2 * D + l] * f[T2]);
    for (int32_t r = 0; r < k; r++) {
        const double v = w * s->shape[a * i + s->trace[i / s->q * k + r]];
        double *row = blocks + D * D * columns * r;
        const double *force = &all.force[0][0][0];
        for (int32_t n = 0; n < D * D * columns; n++) row[n] += v * force[n];
    }
    /* the shape function at the partner changes as it moves along the facet */
    double moved[P][COLUMNS][D][D];
    for (int e = 0; e < P; e++)
        for (int32_t c = 0; c < columns; c++)
            for (int l = 0; l < D; l++)
                for (int j = 0; j < D; j++) moved[e][c][l][j] = traction[l] * all.xi[c][e][j];
    for (int32_t r = 0; r < o; r++) {
        const double v = -w * s->partner_shape[o * i + r];
        const double *slope = s->partner_slope + P * o * i + r;
        double *row = blocks + D * D * columns * (k + r);
        const double *force = &all.force[0][0][0], *one = &moved[0][0][0][0], *two = &moved[1][0][0][0];
        for (int32_t n = 0; n < D * D * columns; n++) row[n] += v * force[n] - slope[0] * one[n] - slope[o] * two[n];
    }
}

void contact_tangent(const Side *s, const int32_t *place, const int32_t *slots, const int32_t *number, double *values)
{
    static _Thread_local double blocks[ROWS * COLUMNS * D * D];
    const int32_t size = (s->k + s->o) * (s->a + s->o), m = s->n * s->q;
    for (int32_t i = 0; i < m;) {
        const int32_t pair = place[i], begin = i, *slot = slots + (int64_t)pair * size;
        int32_t n_active = 0;
        for (; i < m && place[i] == pair && i / s->q == begin / s->q; i++) {
            if (!s->active[i]) continue;
            if (!n_active++)
                for (int32_t n = 0; n < D * D * size; n++) blocks[n] = 0;
            add_point(s, i, blocks);
        }
        for (int32_t b = 0; n_active && b < size; b++)
            for (int n = 0; n < D * D; n++) values[D * D * (int64_t)number[slot[b]] + n] += blocks[D * D * b + n];
    }
}

void point_rates(const Side *s, const double *own, const double *opposite, double *trial, double *opening)
{
    const int32_t a = s->a, o = s->o, m = s->n * s->q;
    for (int64_t i = 0; i < m; i++, opposite += D * o) {
        const Point p = point(s, i);
        const double *u = own + D * a * (i / s->q), *derivative = s->derivative + s->m * a * i;
        Direction d = {{0}, {{0}}, {0}};
        for (int j = 0; j < D; j++) {
            for (int32_t c = 0; c < a; c++) d.jump[j] += s->shape[a * i + c] * u[D * c + j];
            for (int32_t c = 0; c < o; c++) {
                d.jump[j] -= s->partner_shape[o * i + c] * opposite[D * c + j];
                for (int e = 0; e < P; e++) d.slope[e][j] += s->partner_slope[(P * i + e) * o + c] * opposite[D * c + j];
            }
        }
        for (int32_t t = 0; t < s->g; t++) {
            double strain = 0;
            for (int32_t c = 0; c < a; c++) strain += derivative[s->m * c + s->terms[2 * t + 1]] * u[D * c + s->terms[2 * t]];
            for (int r = 0; r < D; r++) d.stress[r] += s->moduli[s->g * (D * i + r) + t] * strain;
        }
        const Rates r = rates(&p, &d);
        for (int c = 0; c < D; c++) trial[D * i + c] = r.trial[c], opening[D * i + c] = r.opening[c];
    }
}
