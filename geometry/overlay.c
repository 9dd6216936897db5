/* Reference facets broken into pieces by the polygons that lie over them: see geometry/overlay.py.
 *
 * Polygons are clipped by the sides of the facet (Sutherland and Hodgman 1974). What none of them covers is what is left
 * of the facet after each is taken away, edge by edge. */

#include <math.h>
#include <string.h>

#include "overlay.h"

enum { CORNERS = 32, PIECES = 512 }; /* of a polygon; of a facet */
enum { S, T };
static const double NOTHING = 1e-11; /* the least area of a piece, of a reference facet of the area 1/2 or 1 */
static const double ON_LINE = 1e-11; /* twice the area of a triangle whose corners are on a line */
static const double TIE = 1e-6;      /* of diagonals as long, the first one, whatever the rounding */
static const double OVERLAP = 1e-3;  /* polygons that cover a facet more than once by this area break it nowhere */

typedef struct {
    int n;
    double at[CORNERS][2];
} Polygon;

typedef struct {
    int n;
    Polygon piece[PIECES];
} Pieces;

typedef struct {
    int32_t n, most, sides, *facet, *polygon, n_polygons;
    double *corners;
} Broken;

static double cross(const double *o, const double *a, const double *b)
{
    return (a[S] - o[S]) * (b[T] - o[T]) - (a[T] - o[T]) * (b[S] - o[S]);
}

static double squared_distance(const double *a, const double *b)
{
    return (a[S] - b[S]) * (a[S] - b[S]) + (a[T] - b[T]) * (a[T] - b[T]);
}

static void middle_of(const Polygon *p, double *middle)
{
    middle[S] = middle[T] = 0;
    for (int i = 0; i < p->n; i++)
        for (int c = S; c <= T; c++) middle[c] += p->at[i][c] / p->n;
}

/* Positive of polygons that run anticlockwise. */
static double area(const Polygon *p)
{
    double twice = 0;
    for (int i = 1; i + 1 < p->n; i++) twice += cross(p->at[0], p->at[i], p->at[i + 1]);
    return twice / 2;
}

static void turn_round(Polygon *p)
{
    for (int i = 0, j = p->n - 1; i < j; i++, j--)
        for (int c = S; c <= T; c++) {
            const double kept = p->at[i][c];
            p->at[i][c] = p->at[j][c], p->at[j][c] = kept;
        }
}

static int is_convex(const Polygon *p)
{
    for (int i = 0; i < p->n; i++)
        if (cross(p->at[i], p->at[(i + 1) % p->n], p->at[(i + 2) % p->n]) < 0) return 0;
    return 1;
}

/* How far x lies on the left of the line from a to b, whatever the rounding where it lies on the line. */
static double beside(const double *a, const double *b, const double *x)
{
    const double d = cross(a, b, x);
    return fabs(d) < ON_LINE ? 0 : d;
}

/* The part of a polygon on the left of the line from a to b, or on its right. */
static Polygon cut(const Polygon *p, const double *a, const double *b, int on_the_left)
{
    Polygon kept = {0};
    const double sign = on_the_left ? 1 : -1;
    for (int i = 0; i < p->n; i++) {
        const double *one = p->at[i], *two = p->at[(i + 1) % p->n];
        const double u = sign * beside(a, b, one), v = sign * beside(a, b, two);
        if (u >= 0 && kept.n < CORNERS) memcpy(kept.at[kept.n++], one, sizeof kept.at[0]);
        if (u * v >= 0 || kept.n >= CORNERS) continue;
        const double t = u / (u - v);
        for (int c = S; c <= T; c++) kept.at[kept.n][c] = one[c] + t * (two[c] - one[c]);
        kept.n++;
    }
    return kept;
}

static void keep(Pieces *pieces, const Polygon *p)
{
    if (pieces->n < PIECES && area(p) > NOTHING) pieces->piece[pieces->n++] = *p;
}

static void keep_clipped(Pieces *pieces, Polygon p, const Overlay *o)
{
    for (int e = 0; e < o->sides && p.n > 2; e++)
        p = cut(&p, o->window + 2 * e, o->window + 2 * ((e + 1) % o->sides), 1);
    keep(pieces, &p);
}

/* The parts of the facet under one polygon: convex ones. */
static void add_part(Pieces *parts, const double *corners, const Overlay *o)
{
    Polygon p = {o->n_corners, {{0}}};
    memcpy(p.at, corners, sizeof p.at[0] * p.n);
    if (area(&p) < 0) turn_round(&p);
    if (is_convex(&p)) {
        keep_clipped(parts, p, o);
        return;
    }
    for (int i = 1; i + 1 < p.n; i++) {
        Polygon half = {3, {{p.at[0][S], p.at[0][T]}, {p.at[i][S], p.at[i][T]}, {p.at[i + 1][S], p.at[i + 1][T]}}};
        if (area(&half) < 0) turn_round(&half);
        keep_clipped(parts, half, o);
    }
}

/* Sort the edges of a polygon by how far they lie from the middle of the facet: an order that does not depend on the
 * corner with which it begins. */
static void sort_edges(const Polygon *p, const double *middle, int *edge)
{
    double far[CORNERS];
    for (int i = 0; i < p->n; i++) {
        const double *a = p->at[i], *b = p->at[(i + 1) % p->n];
        far[i] = cross(a, b, middle) / sqrt(squared_distance(a, b));
        int k = i;
        for (; k > 0 && far[edge[k - 1]] > far[i]; k--) edge[k] = edge[k - 1];
        edge[k] = i;
    }
}

/* Take one convex part away from what is left of a facet. */
static void take_away(const Polygon *part, const double *middle, Pieces *left)
{
    static _Thread_local Pieces before;
    int edge[CORNERS];
    sort_edges(part, middle, edge);
    before = *left;
    left->n = 0;
    for (int k = 0; k < before.n; k++) {
        Polygon under = before.piece[k];
        for (int i = 0; i < part->n && under.n > 2; i++) {
            const double *a = part->at[edge[i]], *b = part->at[(edge[i] + 1) % part->n];
            const Polygon outside = cut(&under, a, b, 0);
            keep(left, &outside);
            under = cut(&under, a, b, 1);
        }
    }
}

/* The corner of a polygon whose diagonals are the shortest; -1 if those of others are as short, but for the one across a
 * quadrilateral. */
static int best_corner(const Polygon *p)
{
    double least = INFINITY, next = INFINITY;
    int best = 0;
    for (int from = 0; from < (p->n == 4 ? 2 : p->n); from++) {
        double sum = 0;
        for (int i = 2; i + 1 < p->n; i++) sum += squared_distance(p->at[from], p->at[(from + i) % p->n]);
        next = fmin(next, fmax(sum, least));
        if (!(sum < least)) continue;
        least = sum, best = from;
    }
    return p->n > 3 && next < least * (1 + TIE) ? -1 : best;
}

/* Keep a piece with these corners, the last one once more if they are fewer than a piece has. */
static void add_piece(Broken *all, int32_t facet, int n, const double *const *corner)
{
    Polygon p = {n, {{0}}};
    for (int c = 0; c < n; c++) memcpy(p.at[c], corner[c], sizeof p.at[0]);
    if (area(&p) < NOTHING) return;
    if (all->n < all->most) {
        all->facet[all->n] = facet;
        all->polygon[all->n] = all->n_polygons;
        double *at = all->corners + 2 * (int64_t)all->sides * all->n;
        for (int c = 0; c < all->sides; c++) memcpy(at + 2 * c, p.at[c < n ? c : n - 1], sizeof p.at[0]);
    }
    all->n++;
}

/* Break convex polygons into pieces: from one corner, or about the middle where corners are alike. */
static void add_pieces(Broken *all, int32_t facet, const Pieces *polygons)
{
    const int step = all->sides - 2;
    for (int k = 0; k < polygons->n; k++, all->n_polygons++) {
        const Polygon *p = &polygons->piece[k];
        const int n = p->n, best = best_corner(p);
        if (best < 0 && n > all->sides) {
            double middle[2];
            middle_of(p, middle);
            for (int i = 0; i < n; i += step) {
                const double *corner[4] = {middle, p->at[i], p->at[(i + 1) % n], p->at[(i + 2) % n]};
                add_piece(all, facet, 2 + (n - i < step ? n - i : step), corner);
            }
            continue;
        }
        const int from = best < 0 ? 0 : best;
        for (int i = 1; i + 1 < n; i += step) {
            const double *corner[4] = {p->at[from], p->at[(from + i) % n], p->at[(from + i + 1) % n], p->at[(from + i + 2) % n]};
            add_piece(all, facet, 2 + (n - 1 - i < step ? n - 1 - i : step), corner);
        }
    }
}

int32_t broken_facets(const Overlay *o, int32_t most, int32_t *facet, int32_t *polygon, double *corners)
{
    static _Thread_local Pieces parts, left;
    Broken all = {0, most, o->sides, facet, polygon, 0, corners};
    Polygon whole = {o->sides, {{0}}};
    memcpy(whole.at, o->window, sizeof whole.at[0] * whole.n);
    double middle[2];
    middle_of(&whole, middle);
    for (int32_t i = 0; i < o->n; i++) {
        parts.n = 0;
        for (int32_t p = o->first[i]; p < o->first[i + 1]; p++)
            add_part(&parts, o->polygons + 2 * (int64_t)o->n_corners * p, o);
        double bare = area(&whole);
        for (int k = 0; k < parts.n; k++) bare -= area(&parts.piece[k]);
        if (bare < -OVERLAP) parts.n = 0;
        left.n = 0;
        if (bare > NOTHING || bare < -OVERLAP) keep(&left, &whole);
        for (int k = 0; k < parts.n && left.n; k++) take_away(&parts.piece[k], middle, &left);
        add_pieces(&all, i, &parts);
        add_pieces(&all, i, &left);
    }
    return all.n;
}
