#include <stdint.h>

/* One side of a contact: n facets of q points, with the arrays of the points in contiguous memory.
 * a nodes a cell, k of them on the facet (trace), o nodes of the opposite facet, m derivatives of
 * a basis function (by the axes, and perhaps over the radius), g components of the displacement
 * gradient. */
typedef struct {
    int32_t moves, n, q, a, k, o, m, g;
    const double *shape;      /* (n, q, a) basis functions of the own cell */
    const double *derivative; /* (n, q, a, m) */
    const int32_t *terms;     /* (g, 2) a component of the displacement and its derivative */
    const int32_t *trace;     /* (n, k) nodes of the facet within the cell */
    const double *weight;     /* (n, q) */
    double share;
    const double *gamma;         /* (n q, 2) of gap and slip */
    const uint8_t *active;       /* (n q) the point carries something */
    const double *traction;      /* (n q, 2) pressure and shear */
    const double *by_trial;      /* (n q, 2, 2) derivative of the traction by the trial traction */
    int32_t has_by_opening;
    const double *by_opening;    /* (n q, 2, 2) derivative by gap and slip, if there is one */
    const double *stress_vector; /* (n q, 2) of the own body's stress */
    const double *moduli;        /* (n q, 2, g) its derivative by the displacement gradient */
    const double *separation;    /* (n q, 2) from the partner to the point */
    const double *strayed;       /* (n q, 2) see Pair */
    const double *partner_shape; /* (n q, o) basis functions of the opposite facet at the partner */
    const double *partner_slope; /* (n q, o) their derivatives along the facet */
    const double *normal;        /* (n q, 2) of the opposite facet */
    const double *tangent;       /* (n q, 2) */
    const double *bend;          /* (n q) */
    const uint8_t *slides;       /* (n q) the partner is no vertex */
} Side;

/* Add the derivative of the residual to values. Nodes are counted: own cell's (columns) or own facet's (rows) first, then
 * the opposite's. slots (pairs, k + o, a + o) are the places of the blocks of a facet and an opposite facet, place (n q)
 * the pairs that the points belong to, and number has for each place where in values its block is. */
void contact_tangent(const Side *s, const int32_t *place, const int32_t *slots, const int32_t *number, double *values);

/* What displacements of the own cells' nodes (n, a, 2) and of the opposite's nodes at each point (n q, o, 2) add to the
 * trial tractions and to gap and slip, (n q, 2) each. */
void point_rates(const Side *s, const double *own, const double *opposite, double *trial, double *opening);
