#include <stdint.h>

/* Facets that are overlaid by polygons; see geometry/overlay.py. */
typedef struct {
    int32_t n, sides, n_corners; /* facets, sides of a facet, corners of a polygon */
    const double *window;        /* (sides, 2) corners of the reference facet, anticlockwise */
    const int32_t *first;        /* (n + 1) the polygons over a facet, from the first one on */
    const double *polygons;      /* (polygons, n_corners, 2) in the coordinates of the facet */
} Overlay;

/* Pieces of the facets, with as many sides: their facets (most), the numbers (most) of the convex polygons that they make
 * up, and their corners (most, sides, 2), where a triangle among quadrilaterals has its last corner twice. Returns their
 * number, which may be larger than the most that are wanted; the others are left out. */
int32_t broken_facets(const Overlay *overlay, int32_t most, int32_t *facet, int32_t *polygon, double *corners);
