/* The product is made row by row (Gustavson 1978). */

#include "galerkin.h"

static inline void add_product(int d, const double *left, const double *A, const double *right, double *block)
{
    for (int i = 0; i < d; i++)
        for (int j = 0; j < d; j++) block[d * i + j] += left[i] * A[d * j + i] * right[j];
}

static inline int is_zero(int size, const double *block)
{
    for (int k = 0; k < size; k++)
        if (block[k] != 0.0) return 0;
    return 1;
}

static inline int32_t product(const Product *p, const int d, int32_t most, int32_t *place, int32_t *rows, int32_t *columns,
                              double *blocks)
{
    int32_t count = 0;
    for (int32_t r = 0; r < p->n; r++) {
        const int32_t begin = count;
        for (int32_t e = p->from[r]; e < p->from[r + 1]; e++) {
            const int32_t i = p->row[e];
            for (int32_t k = p->offsets[i]; k < p->offsets[i + 1]; k++) {
                const int32_t column = p->columns[k];
                if (!p->with_zeros && is_zero(d * d, p->values + (int64_t)d * d * k)) continue;
                for (int32_t f = p->to[column]; f < p->to[column + 1]; f++) {
                    const int32_t c = p->node[f];
                    if (place[c] < begin) {
                        place[c] = count++;
                        if (place[c] < most) {
                            rows[place[c]] = r;
                            columns[place[c]] = c;
                            for (int n = 0; n < d * d; n++) blocks[(int64_t)d * d * place[c] + n] = 0;
                        }
                    }
                    if (place[c] < most)
                        add_product(d, p->row_weight + (int64_t)d * e, p->values + (int64_t)d * d * k,
                                    p->weight + (int64_t)d * f, blocks + (int64_t)d * d * place[c]);
                }
            }
        }
    }
    return count;
}

int32_t galerkin(const Product *p, int32_t most, int32_t *place, int32_t *rows, int32_t *columns, double *blocks)
{
    return p->d == 3 ? product(p, 3, most, place, rows, columns, blocks)
                     : product(p, p->d, most, place, rows, columns, blocks);
}
