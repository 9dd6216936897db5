#include <stdint.h>

/* Number the different places of a matrix with n_rows and n_columns that are filled in m parts of rows, row by row: part i
 * fills width[i] places of rows[i], whose columns begin at columns + from[i]. The slots of all parts, one after the other,
 * are the numbers of their places; unique_rows and unique_columns, with room for as many, are the places of each number.
 * Returns how many there are; -1 without memory. */
int32_t number_places(int32_t m, const int32_t *rows, const int32_t *from, const int32_t *width, const int32_t *columns,
    int32_t n_rows, int32_t n_columns, int32_t *slot, int32_t *unique_rows, int32_t *unique_columns);
