#include <stdint.h>

/* Rows of blocks of a matrix A, and interpolations from coarse nodes to its rows and columns, all with d components. Blocks
 * are by columns. */
typedef struct {
    int32_t n, d;
    const int32_t *offsets, *columns; /* (rows + 1), (k) */
    const double *values;             /* (k d d) */
    int32_t with_zeros;               /* whether blocks that are zero make entries, too */
    const int32_t *from, *row;        /* (n + 1), (p): the rows that each of n coarse nodes gives values to */
    const double *row_weight;         /* (p, d) */
    const int32_t *to, *node;         /* (columns + 1), (q): the coarse nodes that give values to each column */
    const double *weight;             /* (q, d) */
} Product;

/* Blocks of the Galerkin product P^T A P at rows and columns (most), by rows. place, as many as coarse nodes, is -1 before.
 * Returns their number, which may be larger than the most that are wanted; the others are left out. */
int32_t galerkin(const Product *product, int32_t most, int32_t *place, int32_t *rows, int32_t *columns, double *blocks);
