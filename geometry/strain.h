#include <stdint.h>

/* strain (n q, 3) = [eps_xx, eps_yy, gamma_xy] from gradient (n, q, a, 2), dofs (n, a) and displacements u (nodes, 2) */
void strains(int32_t n, int32_t q, int32_t a, const double *gradient, const int32_t *dofs,
    const double *u, double *strain);
