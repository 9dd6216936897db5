#include <stdint.h>

/* Add the force (n q, 2) on the own body to own (nodes, 2) and its reaction to opposite; k nodes a facet of the own curve
 * with trace (n, q, k), o nodes of the opposite a point with shape (n q, o). */
void contact_forces(int32_t n, int32_t q, int32_t k, int32_t o, const double *force, const double *trace,
    const int32_t *own_nodes, const double *shape, const int32_t *opposite_nodes, double *own, double *opposite);
