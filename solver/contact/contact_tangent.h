#include <stdint.h>

/* One side of a contact: n facets of q points; a nodes a cell, k of them on the facet (trace), o nodes of the opposite.
 * gamma (of gap and slip), traction (pressure, shear) and its derivative are in the frame of the normal. */
typedef struct {
    int32_t moves, n, q, a, k, o;
    const double *own_shape, *gradient;
    const int32_t *trace;
    const double *weight;
    double share;
    const double *gamma;
    const uint8_t *active;
    const double *traction, *derivative, *stress_vector, *separation, *moduli;
    const double *shape, *slope, *normal, *tangent, *bend, *strayed;
    const uint8_t *slides;
} Side;

/* Add the derivative of the residual to values. Nodes are counted: own cell's (columns) or own facet's (rows) first, then
 * the opposite's. slots (pairs, k + o, a + o) are the places of the blocks of a facet and an opposite facet, place (n q)
 * the pairs that the points belong to. */
void contact_tangent(const Side *s, const int32_t *place, const int32_t *slots, double *values);

/* What displacements of the own cells' nodes (n, a, 2) and of the opposite's nodes at each point (n q, o, 2) add to the
 * trial tractions (n q, 2). */
void trial_rate(const Side *s, const double *own, const double *opposite, double *rate);
