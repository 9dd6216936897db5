#include <stdint.h>

/* Number the different ones of m places in a matrix of n_rows and n_columns, row by row: slot (m) is the number of each
 * place, and unique_rows and unique_columns, with room for m, are the places of each number. Returns how many there are;
 * -1 without memory. */
int32_t number_places(int32_t m, const int32_t *rows, const int32_t *columns, int32_t n_rows, int32_t n_columns,
    int32_t *slot, int32_t *unique_rows, int32_t *unique_columns);
