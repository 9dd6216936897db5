#include <stdint.h>

/* A surface of n polynomial facets of k nodes each; see geometry/patches.py. */
typedef struct {
    int32_t k, n_edges;
    const int32_t *exponents;   /* (k, 2) the monomials */
    const double *coefficients; /* (k, k) of the shape functions */
    const double *polynomials;  /* (n, k, 3) coefficients of the position on each facet */
    const double *lines;        /* (n_edges, 3) an edge is where a . xi = b: a and b */
    const double *margin;       /* (n, n_edges) of b, by which each facet is continued */
    const int32_t *beyond;      /* (n, n_edges) the facet across each edge, -1 at a free border */
    const uint8_t *ends;        /* (n, n_edges) whether the surface ends there: at a free border or a sharp edge */
    const int32_t *corners;     /* (n, n_edges) vertices: edge e leads from the corner e to the next */
    const int32_t *first;       /* (vertices + 1) */
    const int32_t *around;      /* the facets around the vertex v, from first[v] on */
} Patches;

/* Closest points of m points x, from the facets home on, over at most so many others. Facets that touch the facet `faced`
 * of a point are continued: all where it is EVERY. Returns the number of points that found none, and the first of them in
 * lost. */
int32_t closest_on_patches(const Patches *patches, int32_t m, const double *x, const double *outward, const int32_t *home,
    const int32_t *faced, int32_t others, int32_t *facet, double *xi, double *point, double *normal, double *tangent, double *bend,
    double *shape, double *slope, double *along, uint8_t *found, int32_t *lost);

/* Coordinates xi (m, 2) of the closest points of m points x on the given facets. */
void coordinates_on_patches(const Patches *patches, int32_t m, const double *x, const int32_t *facet, double *xi);
