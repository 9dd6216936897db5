#include <stdint.h>

/* Adds to A (d a, d a) the stiffness of one cell with nodes at x (g, 3): the integral of B^T C B. In c lie
 *
 *     q, a, g, d, k, n_terms, has_hoop, is_given   sizes, and two questions
 *     terms (n_terms, 3)    a component of the displacement, a derivative, and the component of the strain that gets
 *                           their product; derivatives behind the axes are the quotient by the radius, and the value
 *     weight (q)            of the rule
 *     nodes (1 + d, q, g)   basis of the coordinates: values, derivatives
 *     basis (1 + d, q, a)   basis of the displacements
 *     moduli (k, k)         C, unless it is given in w (q, k, k)
 *
 * Of cells around an axis each point counts by its radius. The arguments are dolfinx' of a kernel. */
void stiffness(double *A, const double *w, const double *c, const double *x, const int *entity,
    const uint8_t *permutation, void *data);
