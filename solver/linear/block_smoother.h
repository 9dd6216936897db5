#include <stdint.h>

/* Blocks in single precision, row by row. */
typedef struct {
    int32_t *start;  /* (n + 1) */
    int32_t *column; /* (k) */
    float *block;    /* (k d d + 1) each by columns */
} BlockPart;

/* Block rows of the owned nodes of a rank. A sweep reads the parts left and right of the diagonal one after the other, so
 * each part lies together. Sweeps back read the part right of the diagonal: its last row comes first, as the processor
 * foresees rising addresses alone, and takes four times as long for falling ones. Columns of ghosts count from n on. */
typedef struct {
    int32_t n, d;
    BlockPart *lower, *upper, *ghosts;
    float *added;   /* (n, d) part of the sizes of the ghosts' entries, which the diagonal blocks have more */
    float *inverse; /* (n d d) of the diagonal blocks, by columns */
} BlockRows;

/* Blocks of a matrix in double precision, and another matrix that is added to it: in the rank's own columns, and in columns
 * of ghosts, of which its first one is the column first_ghost of the rows. */
typedef struct BlockTerm {
    const struct BlockTerm *before; /* NULL without */
    int32_t first_ghost;
    const int32_t *offsets, *columns; /* (n + 1), (k) */
    const double *values;             /* (k d d) each by columns */
    const int32_t *ghost_offsets, *ghost_columns;
    const double *ghost_values;
} BlockTerm;

/* Fill A with the blocks of the terms, but those that are zero. */
void pack_blocks(BlockRows *A, const BlockTerm *last);

/* Smooth A x = b from x = 0 by a forward and a backward sweep; residual is what is left without the ghosts' part. work (n d). */
void smooth_from_zero(const BlockRows *A, const double *b, float *x, float *work, double *residual);

/* Subtract the ghosts' part, of x (n d and the ghosts), from a residual. */
void subtract_ghosts(const BlockRows *A, const float *x, double *residual);

/* Add the correction to x and smooth A x = b by a forward and a backward sweep; the ghosts of x stay. work (n d). */
void smooth(const BlockRows *A, const double *b, const double *correction, float *x, float *work);
