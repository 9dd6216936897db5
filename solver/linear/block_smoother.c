#include "block_smoother.h"
#include <math.h>
#include <string.h>

typedef float Four __attribute__((vector_size(16)));

typedef struct {
    int32_t lower, ghosts; /* where the parts end so far */
} Ends;

/* Ranks smooth at once: with the sizes of all ghosts' entries on the diagonal that converges whatever the matrix (Baker,
 * Falgout, Kolev and Yang 2011). An eighth of them is enough at nu = 0.49, and costs few iterations elsewhere. */
static const float PART = 0.125f;

/* y += B x. Columns of three are read as four, of which the last is not used. */
static inline void add_product(int d, const float *B, const float *x, float *y)
{
    if (d == 3) {
        Four a, b, c, sum;
        memcpy(&a, B, 16);
        memcpy(&b, B + 3, 16);
        memcpy(&c, B + 6, 16);
        memcpy(&sum, y, 16);
        sum += a * x[0] + b * x[1] + c * x[2];
        memcpy(y, &sum, 16);
        return;
    }
    for (int j = 0; j < d; j++)
        for (int i = 0; i < d; i++) y[i] += B[d * j + i] * x[j];
}

/* y += the blocks of a part's row times x */
static inline void row_times(const BlockPart *part, int d, int32_t row, const float *x, float *y)
{
    const int32_t end = part->start[row + 1];
    int32_t k = part->start[row];
    if (d == 3) {
        Four by_first = {0}, by_second = {0}, by_third = {0}, column, sum;
        for (; k < end; k++) {
            const float *B = part->block + 9 * (int64_t)k, *of = x + 3 * (int64_t)part->column[k];
            memcpy(&column, B, 16);
            by_first += column * of[0];
            memcpy(&column, B + 3, 16);
            by_second += column * of[1];
            memcpy(&column, B + 6, 16);
            by_third += column * of[2];
        }
        memcpy(&sum, y, 16);
        sum += by_first + by_second + by_third;
        memcpy(y, &sum, 16);
        return;
    }
    for (; k < end; k++) add_product(d, part->block + k * (int64_t)(d * d), x + d * part->column[k], y);
}

static void invert(int d, const float *B, float *inverse)
{
    double a[9], work[9] = {0};
    for (int k = 0; k < d * d; k++) a[k] = B[k];
    for (int i = 0; i < d; i++) work[i * d + i] = 1.0;
    for (int p = 0; p < d; p++) { /* Gauss and Jordan, without a choice of pivots */
        double pivot = a[p * d + p] != 0.0 ? 1.0 / a[p * d + p] : 0.0;
        for (int j = 0; j < d; j++) {
            a[p * d + j] *= pivot;
            work[p * d + j] *= pivot;
        }
        for (int i = 0; i < d; i++) {
            double factor = a[i * d + p];
            if (i == p) continue;
            for (int j = 0; j < d; j++) {
                a[i * d + j] -= factor * a[p * d + j];
                work[i * d + j] -= factor * work[p * d + j];
            }
        }
    }
    for (int k = 0; k < d * d; k++) inverse[k] = (float)work[k];
}

static int is_zero(int size, const double *block)
{
    for (int k = 0; k < size; k++)
        if (block[k] != 0.0) return 0;
    return 1;
}

/* Append a block to the last row. */
static void put(BlockPart *part, int32_t *at, int size, int32_t column, const double *block)
{
    if (is_zero(size, block)) return;
    for (int k = 0; k < size; k++) part->block[(int64_t)size * *at + k] = (float)block[k];
    part->column[(*at)++] = column;
}

/* Add a part of the sizes of the entries of ghosts to the diagonal block. */
static void stiffen(BlockRows *A, int32_t i, int32_t end, float *diagonal)
{
    const int d = A->d;
    float *added = A->added + d * i;
    for (int r = 0; r < d; r++) {
        added[r] = 0;
        for (int64_t k = (int64_t)d * A->ghosts->start[i]; k < (int64_t)d * end; k++)
            added[r] += PART * fabsf(A->ghosts->block[d * k + r]);
        diagonal[(d + 1) * r] += added[r];
    }
}

/* Append the blocks of a row of a term that are not right of the diagonal, and add its diagonal block. */
static void put_row(BlockRows *A, const BlockTerm *term, int32_t i, Ends *at, float *diagonal)
{
    const int size = A->d * A->d;
    for (int64_t k = term->offsets[i]; k < term->offsets[i + 1]; k++) {
        const int32_t column = term->columns[k];
        const double *block = term->values + size * k;
        if (column < i) put(A->lower, &at->lower, size, column, block);
        if (column == i)
            for (int n = 0; n < size; n++) diagonal[n] += (float)block[n];
    }
    for (int64_t k = term->ghost_offsets[i]; k < term->ghost_offsets[i + 1]; k++) {
        const int32_t column = term->first_ghost + term->ghost_columns[k];
        put(A->ghosts, &at->ghosts, size, column, term->ghost_values + size * k);
    }
}

/* Append the blocks right of the diagonal, of the last row first. */
static void put_upper(BlockRows *A, const BlockTerm *last)
{
    const int size = A->d * A->d;
    int32_t at = 0;
    for (int32_t i = A->n - 1; i >= 0; i--) {
        A->upper->start[A->n - 1 - i] = at;
        for (const BlockTerm *term = last; term; term = term->before)
            for (int64_t k = term->offsets[i]; k < term->offsets[i + 1]; k++)
                if (term->columns[k] > i) put(A->upper, &at, size, term->columns[k], term->values + size * k);
    }
    A->upper->start[A->n] = at;
}

void pack_blocks(BlockRows *A, const BlockTerm *last)
{
    Ends at = {0, 0};
    for (int32_t i = 0; i < A->n; i++) {
        float diagonal[9] = {0};
        A->lower->start[i] = at.lower;
        A->ghosts->start[i] = at.ghosts;
        for (const BlockTerm *term = last; term; term = term->before) put_row(A, term, i, &at, diagonal);
        stiffen(A, i, at.ghosts, diagonal);
        invert(A->d, diagonal, A->inverse + (int64_t)A->d * A->d * i);
    }
    A->lower->start[A->n] = at.lower;
    A->ghosts->start[A->n] = at.ghosts;
    put_upper(A, last);
}

/* y += the blocks of row i right of the diagonal times x */
static inline void upper_times(const BlockRows *A, int d, int32_t i, const float *x, float *y)
{
    row_times(A->upper, d, A->n - 1 - i, x, y);
}

static inline void from_zero(const BlockRows *A, const int d, const double *b, float *x, float *change, double *residual)
{
    const int32_t n = A->n;
    for (int32_t i = 0; i < n; i++) {
        float sum[4] = {0}, found[4] = {0};
        row_times(A->lower, d, i, x, sum);
        for (int r = 0; r < d; r++) sum[r] = (float)b[d * i + r] - sum[r];
        add_product(d, A->inverse + (int64_t)i * d * d, sum, found);
        memcpy(x + d * i, found, d * sizeof(float));
    }
    for (int32_t i = n - 1; i >= 0; i--) { /* the diagonal block times x is b without the lower part */
        float sum[4] = {0}, found[4] = {0};
        upper_times(A, d, i, x, sum);
        add_product(d, A->inverse + (int64_t)i * d * d, sum, found);
        for (int r = 0; r < d; r++) x[d * i + r] -= found[r];
        memcpy(change + d * i, found, d * sizeof(float));
    }
    for (int32_t i = 0; i < n; i++) {
        float sum[4] = {0};
        row_times(A->lower, d, i, change, sum);
        for (int r = 0; r < d; r++) residual[d * i + r] = sum[r] + A->added[d * i + r] * x[d * i + r];
    }
}

void smooth_from_zero(const BlockRows *A, const double *b, float *x, float *work, double *residual)
{
    if (A->d == 3)
        from_zero(A, 3, b, x, work, residual);
    else
        from_zero(A, A->d, b, x, work, residual);
}

void subtract_ghosts(const BlockRows *A, const float *x, double *residual)
{
    const int d = A->d;
    for (int32_t i = 0; i < A->n; i++) {
        float sum[4] = {0};
        row_times(A->ghosts, d, i, x, sum);
        for (int r = 0; r < d; r++) residual[d * i + r] -= sum[r];
    }
}

static inline void both_ways(const BlockRows *A, const int d, const double *b, float *x, float *right)
{
    const int32_t n = A->n;
    for (int32_t i = n - 1; i >= 0; i--) {
        float sum[4] = {0};
        upper_times(A, d, i, x, sum);
        memcpy(right + d * i, sum, d * sizeof(float));
    }
    for (int32_t i = 0; i < n; i++) {
        float sum[4] = {0}, found[4] = {0};
        row_times(A->lower, d, i, x, sum);
        row_times(A->ghosts, d, i, x, sum);
        for (int r = 0; r < d; r++)
            sum[r] = (float)b[d * i + r] + A->added[d * i + r] * x[d * i + r] - right[d * i + r] - sum[r];
        add_product(d, A->inverse + (int64_t)i * d * d, sum, found);
        memcpy(x + d * i, found, d * sizeof(float));
    }
    for (int32_t i = n - 1; i >= 0; i--) { /* only the part right of the diagonal has changed */
        float sum[4] = {0}, found[4] = {0};
        upper_times(A, d, i, x, sum);
        for (int r = 0; r < d; r++) sum[r] = right[d * i + r] - sum[r];
        add_product(d, A->inverse + (int64_t)i * d * d, sum, found);
        for (int r = 0; r < d; r++) x[d * i + r] += found[r];
    }
}

void smooth(const BlockRows *A, const double *b, const double *correction, float *x, float *work)
{
    for (int64_t i = 0; i < (int64_t)A->n * A->d; i++) x[i] += (float)correction[i];
    if (A->d == 3)
        both_ways(A, 3, b, x, work);
    else
        both_ways(A, A->d, b, x, work);
}
