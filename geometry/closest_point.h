#include <stdint.h>

/* Facets are continued beyond a free end by end_margin for points whose facet `faced` is not NONE. Returns the number of points that found none, and the first of them in lost. */
int32_t closest_points(int32_t m, const double *x, const double *outward, int32_t p, const double *X,
    const int32_t *before, const int32_t *after, const double *coefficients, const int32_t *home, const int32_t *faced,
    int32_t reach, double margin, double end_margin, int32_t steps, int32_t *facet, double *xi, double *point, double *normal, double *tangent, double *bend,
    double *shape, double *slope, uint8_t *slides, uint8_t *found, int32_t *lost);
