/* The functions that Rust calls. Fixed-width types replace those that depend on how PETSc and MPI were built.
 *
 * Functions return 0 or PETSc's error code; ss_message then gives the reason. */
#ifndef SLIPSTICK_SHIM_H
#define SLIPSTICK_SHIM_H

#include <stdint.h>

typedef struct ss_session ss_session;
typedef struct ss_matrix ss_matrix;
typedef struct ss_factors ss_factors;

/* MPI and PETSc, once in the lifetime of a process. */
int ss_start(ss_session **out);
void ss_end(ss_session *session);
int ss_message(ss_session *session, char *text, int64_t capacity);
int32_t ss_rank(const ss_session *session);
int32_t ss_size(const ss_session *session);
int32_t ss_size_here(const ss_session *session);
int ss_options(ss_session *session, const char *options);
/* The options that nothing has used, one per line, without our prefix. */
int ss_unused(ss_session *session, char *text, int64_t capacity);

/* Messages; an error of MPI ends the program on all ranks. */
void ss_sum(ss_session *session, double *values, int64_t count);
int32_t ss_any(ss_session *session, int32_t here);
void ss_gather_lengths(ss_session *session, int64_t length, int64_t *lengths);
void ss_gather(ss_session *session, const char *here, const int64_t *lengths, char *all);
/* Sends the next `to[r]` numbers of `values` to each rank `r`; `all` gets `from[r]` numbers of each, in rank order. */
void ss_exchange(ss_session *session, const double *values, const int64_t *to, double *all, const int64_t *from);
int32_t ss_meet(ss_session *session, double seconds);
void ss_abort(ss_session *session, int32_t code);

/* States a row of a matrix: number, length, columns and values of the k-th one, valid until the next call. */
typedef void (*ss_row)(void *data, int64_t k, int32_t *row, int32_t *count, const int32_t **columns,
                       const double **values);
/* A square matrix with `n` rows, of which this rank owns the next `own`. The `block` rows of a node follow each other.
 * `give` states the `rows` rows of this rank's part, whose places may repeat on other ranks: their values are added.
 * The matrix has no entries before they are set. */
int ss_matrix_new(ss_session *session, int64_t own, int64_t n, int32_t block, int64_t rows, ss_row give, void *data,
                  ss_matrix **out);
/* Replaces all values, in the same places each time. */
int ss_matrix_set(ss_session *session, ss_matrix *matrix, int64_t rows, ss_row give, void *data);
/* A multigrid method needs the rigid motions; they are given by three coordinates for each node of this rank. */
int ss_matrix_rigid(ss_session *session, ss_matrix *matrix, const double *coordinates);
void ss_matrix_free(ss_matrix *matrix);

/* The properties that a factorization reports. */
typedef struct {
    int32_t direct;        /* the solver applies factors once, without an iteration that needs the matrix */
    int32_t transposes;    /* it reports that it can solve with the transpose */
    int32_t is_mumps;      /* the numbers below are known */
    int32_t mumps_error;   /* INFOG(1): 0, or negative for a failed factorization */
    int64_t mumps_detail;  /* INFOG(2) */
    double megabytes;      /* the largest value of any rank */
    double operations;     /* of all ranks */
    double megabytes_here; /* of this rank */
    double operations_here;
    char name[64];         /* KSP, PC and package */
} ss_facts;

/* `kind` is 0 for the whole matrix, 1 for a contact zone, 2 for the bodies; each has its own options. */
int ss_factors_new(ss_session *session, ss_matrix *matrix, int32_t kind, ss_factors **out);
int ss_factors_renew(ss_session *session, ss_factors *factors, ss_matrix *matrix, int32_t workspace, ss_facts *facts);
int ss_factors_solve(ss_session *session, ss_factors *factors, int32_t transpose, const double *rhs, double *x);
void ss_factors_free(ss_factors *factors);

#endif
