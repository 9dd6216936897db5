#include <stdint.h>

/* strain (n q, k) from derivative (n, q, a, m), dofs (n, a) and displacements u (nodes, d); each of terms (n_terms, 3)
 * is a component of the displacement, a derivative, and the component of the strain that gets their product. */
void strains(int32_t n, int32_t q, int32_t a, int32_t m, int32_t d, int32_t n_terms, int32_t k, const int32_t *terms,
    const double *derivative, const int32_t *dofs, const double *u, double *strain);

/* Adds to force (nodes, d) what stress (n q, k), times the volumes of the points, does on that strain. */
void add_forces(int32_t n, int32_t q, int32_t a, int32_t m, int32_t d, int32_t n_terms, int32_t k, const int32_t *terms,
    const double *derivative, const int32_t *dofs, const double *stress, double *force);
