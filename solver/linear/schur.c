/* MUMPS within one process, by its own C interface: a sparse matrix is factorised but for some of its unknowns, whose Schur
 * complement it gives, and solved with in two halves around a solve with that. PETSc's interface has no such halves.
 * Numbers count from 1. Functions return MUMPS's INFOG(1): 0, a warning above, an error below. */

#include <stdlib.h>

#include <dmumps_c.h>

#include "schur.h"

#define ICNTL(i) icntl[(i) - 1]
#define SINGULAR -10
#define MORE_SPACE 4 /* times the workspace is made larger where it was too small */
#define SPARE 10     /* per cent of it at first */

static int run(DMUMPS_STRUC_C *id, int job)
{
    id->job = job;
    dmumps_c(id);
    return id->infog[0];
}

void *schur_create(int32_t comm, int32_t n, int64_t nnz, int32_t *rows, int32_t *columns, int32_t m, int32_t *kept,
                   int32_t *place, int32_t *status)
{
    DMUMPS_STRUC_C *id = calloc(1, sizeof *id);
    *status = -13;
    if (!id) return NULL;
    id->comm_fortran = comm;
    id->par = 1;
    *status = run(id, -1);
    if (*status < 0) return id;
    for (int i = 1; i <= 4; i++) id->ICNTL(i) = 0; /* says nothing */
    id->ICNTL(6) = 0; /* the diagonal needs no rows exchanged */
    id->ICNTL(7) = 1; /* the order is given: MUMPS's own for complements have twice the fill-in */
    id->ICNTL(8) = 1; /* scale by the diagonal */
    id->ICNTL(14) = SPARE;
    id->ICNTL(19) = 1; /* the whole complement, by rows */
    id->ICNTL(24) = 1; /* count pivots of zero: a complement hides them otherwise */
    id->n = n, id->nnz = nnz, id->irn = rows, id->jcn = columns, id->perm_in = place;
    id->size_schur = m, id->listvar_schur = kept;
    *status = run(id, 1);
    return id;
}

int32_t schur_factorise(void *at, double *values, double *complement)
{
    DMUMPS_STRUC_C *id = at;
    int status = -13;
    id->a = values, id->schur = complement;
    for (int i = 0; i <= MORE_SPACE; i++, id->ICNTL(14) *= 3) {
        status = run(id, 2);
        if (status != -8 && status != -9) break; /* the workspace was large enough */
    }
    return status >= 0 && id->infog[27] ? SINGULAR : status;
}

int32_t schur_condense(void *at, double *b, double *reduced)
{
    DMUMPS_STRUC_C *id = at;
    id->ICNTL(26) = 1;
    id->rhs = b, id->nrhs = 1, id->lrhs = id->n;
    id->redrhs = reduced, id->lredrhs = id->size_schur;
    return run(id, 3);
}

int32_t schur_expand(void *at, double *x, double *b)
{
    DMUMPS_STRUC_C *id = at;
    id->ICNTL(26) = 2;
    id->rhs = b, id->redrhs = x;
    return run(id, 3);
}

void schur_destroy(void *at)
{
    DMUMPS_STRUC_C *id = at;
    if (!id) return;
    run(id, -2);
    free(id);
}
