/* Places in a sparse matrix, each once, in time proportional to their number: see places.h. */

#include <stdlib.h>

#include "places.h"

static int compare(const void *a, const void *b)
{
    const int32_t one = *(const int32_t *)a, two = *(const int32_t *)b;
    return (one > two) - (one < two);
}

/* The parts row by row: those of the row r are in_turn[first[r]] to in_turn[first[r + 1] - 1]. */
static void sort_by_rows(int32_t m, const int32_t *rows, int32_t n_rows, int32_t *first, int32_t *in_turn)
{
    for (int32_t i = 0; i < m; i++) first[rows[i] + 1]++;
    for (int32_t r = 0; r < n_rows; r++) first[r + 1] += first[r];
    for (int32_t i = m; i-- > 0;) in_turn[--first[rows[i] + 1]] = i;
    for (int32_t r = 0; r < n_rows; r++) first[r] = first[r + 1];
    first[n_rows] = m;
}

int32_t number_places(int32_t m, const int32_t *rows, const int32_t *from, const int32_t *width, const int32_t *columns,
                      int32_t n_rows, int32_t n_columns, int32_t *slot, int32_t *unique_rows, int32_t *unique_columns)
{
    int32_t *first = calloc(n_rows + 2, sizeof *first), *in_turn = malloc((m + 1) * sizeof *in_turn);
    int32_t *number = malloc((n_columns + 1) * sizeof *number); /* of a column in the present row */
    int64_t *begins = malloc((m + 1) * sizeof *begins);         /* where the slots of a part begin */
    int32_t n = first && in_turn && number && begins ? 0 : -1;
    if (n == 0) {
        sort_by_rows(m, rows, n_rows, first, in_turn);
        for (int32_t c = 0; c < n_columns; c++) number[c] = -1;
        begins[0] = 0;
        for (int32_t i = 0; i < m; i++) begins[i + 1] = begins[i] + width[i];
    }
    for (int32_t r = 0; n >= 0 && r < n_rows; r++) {
        const int32_t begin = n;
        for (int32_t k = first[r]; k < first[r + 1]; k++) {
            const int32_t part = in_turn[k], *own = columns + from[part];
            for (int32_t j = 0; j < width[part]; j++) {
                if (number[own[j]] >= begin) continue;
                number[own[j]] = begin;
                unique_rows[n] = r, unique_columns[n++] = own[j];
            }
        }
        qsort(unique_columns + begin, n - begin, sizeof *unique_columns, compare);
        for (int32_t k = begin; k < n; k++) number[unique_columns[k]] = k;
        for (int32_t k = first[r]; k < first[r + 1]; k++) {
            const int32_t part = in_turn[k], *own = columns + from[part];
            for (int32_t j = 0; j < width[part]; j++) slot[begins[part] + j] = number[own[j]];
        }
    }
    free(first), free(in_turn), free(number), free(begins);
    return n;
}
