/* Closest points on polynomial facets in space: see geometry/patches.py for the meaning of every argument. */

#include <math.h>

#include "patches.h"

enum { MOST = 25, POWERS = 5, EDGES = 4, STEPS = 30 }; /* nodes of a facet (degree 4), and powers of each coordinate */
enum { S, T };                                         /* the coordinates xi on a facet */
enum { SS, ST, TT };                                   /* second derivatives */
enum { EVERY = -1 };                                   /* facet is faced */
static const double ACROSS = 1e-6; /* the product of unit normals of surfaces that stand on each other */
static const double TIE = 1e-10; /* of facets as near, which meet at an angle, the first one, whatever the rounding */

typedef struct {
    double y[3], t[2][3], k[3][3]; /* position, first and second derivatives */
} Frame;

/* Where the closest point of a facet lies: inside, on the edge `edge`, or at the corner `corner`; -1 for none. */
typedef struct {
    int32_t facet, edge, corner;
    double xi[2], distance2;
    int continued; /* whether the facet is continued by its margins */
} Place;

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* The monomials at xi, (6, k): values, derivatives by s and t, and second derivatives by ss, st, tt. */
static void monomials(const Patches *p, const double *xi, double M[6][MOST])
{
    double power[2][POWERS], d[2][POWERS], dd[2][POWERS];
    for (int c = S; c <= T; c++) {
        power[c][0] = 1, d[c][0] = dd[c][0] = 0;
        for (int i = 1; i < POWERS; i++) {
            power[c][i] = power[c][i - 1] * xi[c];
            d[c][i] = i * power[c][i - 1];
            dd[c][i] = i * d[c][i - 1];
        }
    }
    for (int a = 0; a < p->k; a++) {
        const int i = p->exponents[2 * a], j = p->exponents[2 * a + 1];
        M[0][a] = power[S][i] * power[T][j];
        M[1][a] = d[S][i] * power[T][j];
        M[2][a] = power[S][i] * d[T][j];
        M[3][a] = dd[S][i] * power[T][j];
        M[4][a] = d[S][i] * d[T][j];
        M[5][a] = power[S][i] * dd[T][j];
    }
}

static Frame frame(const Patches *p, int32_t facet, double M[6][MOST])
{
    Frame f = {{0}, {{0}}, {{0}}};
    const double *P = p->polynomials + 3 * (int64_t)p->k * facet;
    for (int a = 0; a < p->k; a++, P += 3)
        for (int i = 0; i < 3; i++) {
            f.y[i] += M[0][a] * P[i];
            for (int c = S; c <= T; c++) f.t[c][i] += M[1 + c][a] * P[i];
            for (int c = SS; c <= TT; c++) f.k[c][i] += M[3 + c][a] * P[i];
        }
    return f;
}

/* Half the squared distance's slope g and second derivatives H by xi; first-order where the distance is no longer convex
 * and `convex` is wanted. */
static void distance(const Frame *f, const double *x, int convex, double *g, double *H)
{
    const double d[3] = {x[0] - f->y[0], x[1] - f->y[1], x[2] - f->y[2]};
    double metric[3];
    for (int c = S; c <= T; c++) g[c] = -dot(d, f->t[c]);
    metric[SS] = dot(f->t[S], f->t[S]), metric[ST] = dot(f->t[S], f->t[T]), metric[TT] = dot(f->t[T], f->t[T]);
    for (int c = SS; c <= TT; c++) H[c] = metric[c] - dot(d, f->k[c]);
    if (!convex) return;
    double left[3];
    for (int c = SS; c <= TT; c++) left[c] = H[c] - 0.1 * metric[c];
    if (left[SS] > 0 && left[SS] * left[TT] > left[ST] * left[ST]) return;
    for (int c = SS; c <= TT; c++) H[c] = metric[c];
}

/* Whether two facets are the same one or meet at a corner. */
static int touch(const Patches *p, int32_t facet, int32_t other)
{
    const int32_t *one = p->corners + (int64_t)p->n_edges * facet, *two = p->corners + (int64_t)p->n_edges * other;
    for (int a = 0; a < p->n_edges; a++)
        for (int b = 0; b < p->n_edges; b++)
            if (one[a] == two[b]) return 1;
    return 0;
}

/* Where the edge e of a facet lies, which may be continued. */
static double end(const Patches *p, const Place *at, int e)
{
    const double margin = at->continued ? p->margin[(int64_t)p->n_edges * at->facet + e] : 0;
    return p->lines[3 * e + 2] + margin;
}

/* The corners of a facet, where consecutive edges meet. */
static void corners_of(const Patches *p, const Place *at, double corner[EDGES + 1][2])
{
    const int n = p->n_edges;
    for (int e = 0; e < n; e++) {
        const int before = (e + n - 1) % n;
        const double *a = p->lines + 3 * before, *b = p->lines + 3 * e;
        const double at_a = end(p, at, before), at_b = end(p, at, e), det = a[S] * b[T] - a[T] * b[S];
        corner[e][S] = (at_a * b[T] - a[T] * at_b) / det;
        corner[e][T] = (a[S] * at_b - at_a * b[S]) / det;
    }
    for (int c = S; c <= T; c++) corner[n][c] = corner[0][c];
}

/* One step: the least value on the facet of the quadratic function with slope g and second derivatives H at the place. */
static void least(const Patches *p, double corner[EDGES + 1][2], const double *g, const double *H, Place *at)
{
    const int n = p->n_edges;
    const double det = H[SS] * H[TT] - H[ST] * H[ST], xi[2] = {at->xi[S], at->xi[T]};
    const double free[2] = {xi[S] - (H[TT] * g[S] - H[ST] * g[T]) / det, xi[T] - (H[SS] * g[T] - H[ST] * g[S]) / det};
    int inside = det > 0;
    for (int e = 0; e < n; e++) {
        const double *line = p->lines + 3 * e;
        inside &= line[S] * free[S] + line[T] * free[T] <= end(p, at, e);
    }
    at->edge = at->corner = -1;
    if (inside) {
        at->xi[S] = free[S], at->xi[T] = free[T];
        return;
    }
    double smallest = INFINITY;
    for (int e = 0; e < n; e++) {
        const double from[2] = {corner[e][S] - xi[S], corner[e][T] - xi[T]};
        const double d[2] = {corner[e + 1][S] - corner[e][S], corner[e + 1][T] - corner[e][T]};
        const double slope = (g[S] + H[SS] * from[S] + H[ST] * from[T]) * d[S]
                             + (g[T] + H[ST] * from[S] + H[TT] * from[T]) * d[T];
        double a = -slope / (H[SS] * d[S] * d[S] + 2 * H[ST] * d[S] * d[T] + H[TT] * d[T] * d[T]);
        const int at_corner = a <= 0 ? e : a >= 1 ? (e + 1) % n : -1;
        a = a <= 0 ? 0 : a >= 1 ? 1 : a;
        const double q[2] = {from[S] + a * d[S], from[T] + a * d[T]};
        const double value = g[S] * q[S] + g[T] * q[T]
                             + 0.5 * (H[SS] * q[S] * q[S] + 2 * H[ST] * q[S] * q[T] + H[TT] * q[T] * q[T]);
        if (!(value < smallest)) continue;
        smallest = value;
        at->xi[S] = xi[S] + q[S], at->xi[T] = xi[T] + q[T];
        at->corner = at_corner, at->edge = at_corner < 0 ? e : -1;
    }
}

/* Newton's method on one facet. */
static Place closest_on_facet(const Patches *p, int32_t facet, int32_t faced, const double *x)
{
    const double middle = p->n_edges == 3 ? 1.0 / 3 : 0.5;
    const int continued = faced == EVERY || (faced >= 0 && touch(p, facet, faced));
    Place at = {facet, -1, -1, {middle, middle}, 0, continued};
    double M[6][MOST], corner[EDGES + 1][2], g[2], H[3];
    corners_of(p, &at, corner);
    for (int step = 0; step < STEPS; step++) {
        const double before[2] = {at.xi[S], at.xi[T]};
        monomials(p, at.xi, M);
        const Frame f = frame(p, facet, M);
        distance(&f, x, 1, g, H);
        least(p, corner, g, H, &at);
        if (!(fabs(at.xi[S] - before[S]) + fabs(at.xi[T] - before[T]) >= 1e-12)) break;
    }
    monomials(p, at.xi, M);
    const Frame f = frame(p, facet, M);
    const double d[3] = {x[0] - f.y[0], x[1] - f.y[1], x[2] - f.y[2]};
    at.distance2 = dot(d, d);
    return at;
}

static void keep_nearer(const Patches *p, int32_t facet, int32_t faced, const double *x, const Place *from, Place *nearest)
{
    if (facet < 0 || facet == from->facet) return;
    const Place other = closest_on_facet(p, facet, faced, x);
    if (other.distance2 < nearest->distance2 * (1 - TIE)) *nearest = other;
}

/* The corner that a place has passed or lies at; -1 for none. A facet continued beyond a free border has its other edges
 * continued, too. */
static int corner_passed(const Patches *p, const Place *at)
{
    if (at->edge < 0) return at->corner;
    const int n = p->n_edges, before = (at->edge + n - 1) % n, after = (at->edge + 1) % n;
    const double *a = p->lines + 3 * before, *b = p->lines + 3 * after;
    if (a[S] * at->xi[S] + a[T] * at->xi[T] > a[2]) return at->edge;
    return b[S] * at->xi[S] + b[T] * at->xi[T] > b[2] ? after : -1;
}

/* From the facet home on, over edges and corners, to the facets that are nearer. */
static Place walk(const Patches *p, int32_t home, int32_t faced, const double *x, int32_t others)
{
    Place at = closest_on_facet(p, home, faced, x);
    for (int32_t step = 0; step < others; step++) {
        Place nearest = at;
        const int32_t *across = p->beyond + (int64_t)p->n_edges * at.facet;
        if (at.edge >= 0) keep_nearer(p, across[at.edge], faced, x, &at, &nearest);
        const int corner = corner_passed(p, &at);
        if (corner >= 0) {
            const int32_t vertex = p->corners[(int64_t)p->n_edges * at.facet + corner];
            for (int32_t c = p->first[vertex]; c < p->first[vertex + 1]; c++)
                keep_nearer(p, p->around[c], faced, x, &at, &nearest);
        }
        if (nearest.facet == at.facet) break;
        at = nearest;
    }
    return at;
}

/* Whether a point lies beyond an end of the surface at which its place ends: the force -g on the place pushes it over there. */
static int is_beyond(const Patches *p, const Place *at, const double *g)
{
    const int n = p->n_edges;
    const uint8_t *ends = p->ends + (int64_t)n * at->facet;
    if (at->edge >= 0) {
        const double *a = p->lines + 3 * at->edge;
        return ends[at->edge] && g[S] * a[S] + g[T] * a[T] < 0;
    }
    if (at->corner < 0) return 0;
    const int before = (at->corner + n - 1) % n;
    const double *a = p->lines + 3 * before, *b = p->lines + 3 * at->corner, det = a[S] * b[T] - a[T] * b[S];
    const double of_a = -(g[S] * b[T] - g[T] * b[S]) / det, of_b = -(a[S] * g[T] - a[T] * g[S]) / det;
    return (ends[before] && of_a > 0) || (ends[at->corner] && of_b > 0);
}

/* How xi moves by the product of distance and tangents: the inverse of H where the place may move. */
static void mobility(const Patches *p, const Place *at, const double *H, double *along)
{
    along[0] = along[1] = along[2] = along[3] = 0;
    if (at->corner >= 0) return;
    if (at->edge < 0) {
        const double det = H[SS] * H[TT] - H[ST] * H[ST];
        along[0] = H[TT] / det, along[1] = along[2] = -H[ST] / det, along[3] = H[SS] / det;
        return;
    }
    const double *a = p->lines + 3 * at->edge, e[2] = {-a[T], a[S]};
    const double stiffness = H[SS] * e[S] * e[S] + 2 * H[ST] * e[S] * e[T] + H[TT] * e[T] * e[T];
    for (int c = S; c <= T; c++)
        for (int d = S; d <= T; d++) along[2 * c + d] = e[c] * e[d] / stiffness;
}

int32_t closest_on_patches(const Patches *p, int32_t m, const double *x, const double *outward, const int32_t *home,
                           const int32_t *faced, int32_t others, int32_t *facet, double *xi, double *point, double *normal, double *tangent,
                           double *bend, double *shape, double *slope, double *along, uint8_t *found, int32_t *lost)
{
    int32_t n_lost = 0;
    const int k = p->k;
    for (int64_t i = 0; i < m; i++, x += 3, outward += 3) {
        const Place at = walk(p, home[i], faced[i], x, others);
        double M[6][MOST], g[2], H[3];
        monomials(p, at.xi, M);
        const Frame f = frame(p, at.facet, M);
        distance(&f, x, 0, g, H);
        facet[i] = at.facet;
        for (int a = 0; a < k; a++) {
            double N[3] = {0, 0, 0};
            for (int b = 0; b < k; b++)
                for (int c = 0; c < 3; c++) N[c] += p->coefficients[k * a + b] * M[c][b];
            shape[i * k + a] = N[0];
            for (int c = S; c <= T; c++) slope[(2 * i + c) * k + a] = N[1 + c];
        }
        double *n = normal + 3 * i;
        n[0] = f.t[S][1] * f.t[T][2] - f.t[S][2] * f.t[T][1];
        n[1] = f.t[S][2] * f.t[T][0] - f.t[S][0] * f.t[T][2];
        n[2] = f.t[S][0] * f.t[T][1] - f.t[S][1] * f.t[T][0];
        const double area = sqrt(dot(n, n));
        for (int j = 0; j < 3; j++) {
            n[j] /= area;
            point[3 * i + j] = f.y[j];
            for (int c = S; c <= T; c++) tangent[3 * (2 * i + c) + j] = f.t[c][j];
        }
        for (int c = S; c <= T; c++) {
            xi[2 * i + c] = at.xi[c];
            for (int d = S; d <= T; d++) bend[4 * i + 2 * c + d] = dot(n, f.k[c + d]);
        }
        mobility(p, &at, H, along + 4 * i);
        found[i] = !is_beyond(p, &at, g) && dot(n, outward) < -ACROSS;
        if (at.edge >= 0 || at.corner >= 0) continue;
        const double *A = along + 4 * i; /* what is left of the Newton step */
        const double left = fabs(A[0] * g[S] + A[1] * g[T]) + fabs(A[2] * g[S] + A[3] * g[T]);
        if (left <= 1e-9 * (1 + sqrt(at.distance2 / area))) continue;
        if (!n_lost) *lost = i;
        n_lost++;
    }
    return n_lost;
}

void coordinates_on_patches(const Patches *p, int32_t m, const double *x, const int32_t *facet, double *xi)
{
    for (int64_t i = 0; i < m; i++) {
        const Place at = closest_on_facet(p, facet[i], EVERY, x + 3 * i);
        for (int c = S; c <= T; c++) xi[2 * i + c] = at.xi[c];
    }
}
