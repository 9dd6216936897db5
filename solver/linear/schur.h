#include <stdint.h>

/* Analyse the matrix (n, n) with entries at rows, columns (nnz), without the unknowns kept (m), which come last in the order of
 * elimination, place (n). comm is Fortran's handle of a communicator of one process. The arrays must live as long as what is
 * returned: NULL where there is no memory. */
void *schur_create(int32_t comm, int32_t n, int64_t nnz, int32_t *rows, int32_t *columns, int32_t m, int32_t *kept,
                   int32_t *place, int32_t *status);

/* Factorise the matrix with values (nnz); complement (m, m) is overwritten. */
int32_t schur_factorise(void *at, double *values, double *complement);

/* What the right-hand side b (n) is on the kept unknowns once the others are eliminated, reduced (m). */
int32_t schur_condense(void *at, double *b, double *reduced);

/* After schur_condense: b becomes the solution, given that on the kept unknowns, x (m). */
int32_t schur_expand(void *at, double *x, double *b);
void schur_destroy(void *at);
