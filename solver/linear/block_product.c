#include "block_product.h"
#include <string.h>

enum { D = 3, SIZE = D * D };

typedef double Two __attribute__((vector_size(16)));

static int is_zero(const double *block)
{
    for (int k = 0; k < SIZE; k++)
        if (block[k] != 0.0) return 0;
    return 1;
}

void find_filled(int32_t n, const int32_t *offsets, const double *values, int32_t *start, int32_t *filled)
{
    int32_t at = 0;
    for (int32_t i = 0; i < n; i++) {
        start[i] = at;
        for (int32_t k = offsets[i]; k < offsets[i + 1]; k++)
            if (!is_zero(values + (int64_t)SIZE * k)) filled[at++] = k;
    }
    start[n] = at;
}

void add_products(int32_t n, const int32_t *start, const int32_t *filled, const int32_t *columns, const double *values,
                  const double *x, double *y)
{
    for (int32_t i = 0; i < n; i++) {
        Two upper; /* components 0 and 1 of the sum; the block's columns lie one after the other */
        double last = y[D * i + 2];
        memcpy(&upper, y + D * i, sizeof upper);
        for (int32_t m = start[i]; m < start[i + 1]; m++) {
            const double *B = values + (int64_t)SIZE * filled[m], *v = x + (int64_t)D * columns[filled[m]];
            Two a, b, c;
            memcpy(&a, B, sizeof a);
            memcpy(&b, B + D, sizeof b);
            memcpy(&c, B + 2 * D, sizeof c);
            upper += a * v[0] + b * v[1] + c * v[2];
            last += B[2] * v[0] + B[5] * v[1] + B[8] * v[2];
        }
        memcpy(y + D * i, &upper, sizeof upper);
        y[D * i + 2] = last;
    }
}
