#include <stdint.h>

/* Number the blocks (3, 3) of n rows that are not zero: start (n + 1) of each row, and filled, room for all. */
void find_filled(int32_t n, const int32_t *offsets, const double *values, int32_t *start, int32_t *filled);

/* Add to y (n, 3) the filled blocks times x. */
void add_products(int32_t n, const int32_t *start, const int32_t *filled, const int32_t *columns, const double *values,
                  const double *x, double *y);
