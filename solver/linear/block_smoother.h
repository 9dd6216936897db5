#include <stdint.h>

/* Block rows of the owned nodes of a rank in single precision, of d by d blocks by columns. Columns from n on are ghosts.
 * A row has its lower blocks from start, the diagonal block at middle, then upper ones, and ghosts from border. */
typedef struct {
    int32_t n, d;
    int32_t *start;  /* (n + 1) */
    int32_t *middle; /* (n) */
    int32_t *border; /* (n) */
    int32_t *column; /* (k) */
    float *block;    /* (k d d + 1) */
    float *added;    /* (n, d) part of the sizes of the ghosts' entries, which the diagonal blocks have more */
    float *inverse;  /* (n d d) of the diagonal blocks, by columns */
} BlockRows;

/* Fill A from blocks in double precision, but those that are zero: in the rank's own columns, and in others (ghosts). */
void pack_blocks(BlockRows *A, const int32_t *offsets, const int32_t *columns, const double *values,
                 const int32_t *other_offsets, const int32_t *other_columns, const double *other_values);

/* Smooth A x = b from x = 0 by a forward and a backward sweep; residual is what is left without the ghosts' part. work (n d). */
void smooth_from_zero(const BlockRows *A, const double *b, float *x, float *work, double *residual);

/* Subtract the ghosts' part, of x (n d and the ghosts), from a residual. */
void subtract_ghosts(const BlockRows *A, const float *x, double *residual);

/* Add the correction to x and smooth A x = b by a forward and a backward sweep; the ghosts of x stay. work (n d). */
void smooth(const BlockRows *A, const double *b, const double *correction, float *x, float *work);
