#include <stdint.h>

/* One side of a contact: n facets of q points; a nodes a cell, k of them on the facet (trace), o nodes of the opposite. */
typedef struct {
    int32_t kinematics, n, q, a, k, o;
    const double *own_shape, *gradient;
    const int32_t *trace;
    const double *outward, *weight;
    double share;
    const double *gamma;
    const uint8_t *active;
    const double *pressure, *traction, *separation, *gap, *moduli, *shape, *slope, *normal, *tangent, *bend;
    const uint8_t *slides;
    const int32_t *facet;
} Side;

/* Add the derivative of the residual to values. Nodes are counted: own cell's (columns) or own facet's (rows) first, then the
 * opposite's. slots (pairs, k + o, a + o) are the places of the blocks of a facet and an opposite facet, the first pair
 * of facet f being base[f], for the opposite low[f]. */
void contact_tangent(const Side *s, const int32_t *base, const int32_t *low, const int32_t *slots, double *values);

/* What displacements of the own cells' nodes (n, a, 2) and of the opposite's nodes at each point (n q, o, 2) add to the
 * pressures (n q), were it not for their sign. */
void contact_pressure_rate(const Side *s, const double *own, const double *opposite, double *rate);
