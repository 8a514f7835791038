/* MUMPS on a matrix that `export_matrix` wrote: an external reference, never linked into the project.
 *
 *     apt install libmumps-seq-dev
 *     cc -O2 -I/usr/include/mumps_seq crates/linalg/benches/compare_mumps.c -ldmumps_seq -o compare_mumps
 *     ./compare_mumps contact33.bin
 *
 * Unsymmetric LU in double precision with MUMPS' default settings, on one thread (OMP_NUM_THREADS counts for its BLAS);
 * the ordering is the best that the library was built with. Prints seconds of analysis, factorization and solve, the
 * memory of the factors as MUMPS reports it, and the relative residual.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "dmumps_c.h"

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void *take(FILE *file, size_t size, size_t count) {
    void *block = malloc(size * count);
    if (!block || fread(block, size, count, file) != count) {
        fprintf(stderr, "the file is too short, or memory is\n");
        exit(1);
    }
    return block;
}

static double phase(DMUMPS_STRUC_C *id, int job) {
    double begin = now();
    id->job = job;
    dmumps_c(id);
    if (id->infog[0] < 0) {
        fprintf(stderr, "MUMPS: INFOG(1) = %d, INFOG(2) = %d in phase %d\n", id->infog[0], id->infog[1], job);
        exit(1);
    }
    return now() - begin;
}

int main(int count, char **arguments) {
    FILE *file = count == 2 ? fopen(arguments[1], "rb") : NULL;
    if (!file) {
        fprintf(stderr, "argument: a matrix from export_matrix\n");
        return 1;
    }
    uint64_t *sizes = take(file, 8, 2);
    uint64_t n = sizes[0], entries = sizes[1];
    uint64_t *offsets = take(file, 8, n + 1);
    uint32_t *columns = take(file, 4, entries);
    take(file, 4, n); /* elimination groups */
    double *values = take(file, 8, entries);
    int *row = malloc(sizeof(int) * entries), *column = malloc(sizeof(int) * entries);
    double *x = malloc(sizeof(double) * n);
    for (uint64_t i = 0; i < n; i++) {
        x[i] = 1.0 + 1e-3 * (double)(i % 7);
        for (uint64_t k = offsets[i]; k < offsets[i + 1]; k++) {
            row[k] = (int)i + 1;
            column[k] = (int)columns[k] + 1;
        }
    }
    DMUMPS_STRUC_C id = {0};
    id.par = 1;
    id.sym = 0;
    id.comm_fortran = -987654; /* MPI_COMM_WORLD */
    phase(&id, -1);
    for (int k = 0; k < 4; k++) id.icntl[k] = k == 3 ? 1 : 0; /* quiet */
    id.icntl[13] = 60;                                        /* room for delayed pivots, per cent */
    id.n = (int)n;
    id.nnz = (int64_t)entries;
    id.irn = row;
    id.jcn = column;
    id.a = values;
    id.rhs = x;
    double analysis = phase(&id, 1), factor = phase(&id, 2), solve = phase(&id, 3);
    double residual = 0.0, size = 0.0;
    for (uint64_t i = 0; i < n; i++) {
        double b = 1.0 + 1e-3 * (double)(i % 7), r = b;
        for (uint64_t k = offsets[i]; k < offsets[i + 1]; k++) r -= values[k] * x[columns[k]];
        residual += r * r;
        size += b * b;
    }
    printf("MUMPS %s: %llu unknowns, ordering %d: analysis %.2f s, factor %.2f s, solve %.3f s, %d MB, residual %.1e\n",
           id.version_number, (unsigned long long)n, id.infog[6], analysis, factor, solve, id.infog[21],
           sqrt(residual / size));
    phase(&id, -2);
    return 0;
}
