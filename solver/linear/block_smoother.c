#include "block_smoother.h"
#include <math.h>
#include <string.h>

typedef float Four __attribute__((vector_size(16)));

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

static inline void row_times(const BlockRows *A, int d, int32_t from, int32_t to, const float *x, float *y)
{
    for (int32_t k = from; k < to; k++) add_product(d, A->block + k * (int64_t)(d * d), x + d * A->column[k], y);
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

static void put(BlockRows *A, int32_t at, int32_t column, const double *block)
{
    const int size = A->d * A->d;
    A->column[at] = column;
    for (int k = 0; k < size; k++) A->block[(int64_t)size * at + k] = (float)block[k];
}

/* Add a part of the sizes of the entries of ghosts to the diagonal. */
static void stiffen(BlockRows *A, int32_t i, int32_t end)
{
    const int d = A->d;
    float *added = A->added + d * i, *middle = A->block + (int64_t)d * d * A->middle[i];
    for (int r = 0; r < d; r++) {
        added[r] = 0;
        for (int64_t k = (int64_t)d * A->border[i]; k < (int64_t)d * end; k++) added[r] += PART * fabsf(A->block[d * k + r]);
        middle[(d + 1) * r] += added[r];
    }
}

void pack_blocks(BlockRows *A, const int32_t *offsets, const int32_t *columns, const double *values,
                 const int32_t *other_offsets, const int32_t *other_columns, const double *other_values)
{
    const int64_t size = A->d * A->d;
    int32_t at = 0;
    for (int32_t i = 0; i < A->n; i++) {
        A->start[i] = at;
        for (int32_t k = offsets[i]; k < offsets[i + 1]; k++) {
            const int is_middle = columns[k] == i;
            if (is_middle) A->middle[i] = at;
            if (is_middle || !is_zero(size, values + size * k)) put(A, at++, columns[k], values + size * k);
        }
        A->border[i] = at;
        for (int32_t k = other_offsets[i]; k < other_offsets[i + 1]; k++)
            if (!is_zero(size, other_values + size * k)) put(A, at++, A->n + other_columns[k], other_values + size * k);
        stiffen(A, i, at);
        invert(A->d, A->block + size * A->middle[i], A->inverse + size * i);
    }
    A->start[A->n] = at;
}

static inline void from_zero(const BlockRows *A, const int d, const double *b, float *x, float *change, double *residual)
{
    const int32_t n = A->n;
    for (int32_t i = 0; i < n; i++) {
        float sum[4] = {0}, found[4] = {0};
        row_times(A, d, A->start[i], A->middle[i], x, sum);
        for (int r = 0; r < d; r++) sum[r] = (float)b[d * i + r] - sum[r];
        add_product(d, A->inverse + (int64_t)i * d * d, sum, found);
        memcpy(x + d * i, found, d * sizeof(float));
    }
    for (int32_t i = n - 1; i >= 0; i--) { /* the diagonal block times x is b without the lower part */
        float sum[4] = {0}, found[4] = {0};
        row_times(A, d, A->middle[i] + 1, A->border[i], x, sum);
        add_product(d, A->inverse + (int64_t)i * d * d, sum, found);
        for (int r = 0; r < d; r++) x[d * i + r] -= found[r];
        memcpy(change + d * i, found, d * sizeof(float));
    }
    for (int32_t i = 0; i < n; i++) {
        float sum[4] = {0};
        row_times(A, d, A->start[i], A->middle[i], change, sum);
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
        row_times(A, d, A->border[i], A->start[i + 1], x, sum);
        for (int r = 0; r < d; r++) residual[d * i + r] -= sum[r];
    }
}

static inline void both_ways(const BlockRows *A, const int d, const double *b, float *x, float *change)
{
    const int32_t n = A->n;
    memcpy(change, x, (size_t)n * d * sizeof(float));
    for (int32_t i = 0; i < n; i++) {
        float sum[4] = {0}, found[4] = {0};
        row_times(A, d, A->start[i], A->middle[i], x, sum);
        row_times(A, d, A->middle[i] + 1, A->start[i + 1], x, sum);
        for (int r = 0; r < d; r++) sum[r] = (float)b[d * i + r] + A->added[d * i + r] * x[d * i + r] - sum[r];
        add_product(d, A->inverse + (int64_t)i * d * d, sum, found);
        memcpy(x + d * i, found, d * sizeof(float));
    }
    for (int32_t i = n - 1; i >= 0; i--) { /* only the upper part has changed */
        float sum[4] = {0}, found[4] = {0};
        row_times(A, d, A->middle[i] + 1, A->border[i], change, sum);
        add_product(d, A->inverse + (int64_t)i * d * d, sum, found);
        for (int r = 0; r < d; r++) {
            x[d * i + r] += found[r];
            change[d * i + r] -= x[d * i + r];
        }
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
