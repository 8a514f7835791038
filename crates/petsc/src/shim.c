#include "shim.h"

#include <petscksp.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#if defined(PETSC_USE_COMPLEX)
#error "slipstick needs PETSc for real numbers (on Debian: libpetsc-real-dev)"
#endif
#if !defined(PETSC_USE_REAL_DOUBLE)
#error "slipstick needs PETSc in double precision"
#endif

/* Sums of fewer numbers go through the first rank. */
#define FEW 4096

#define PREFIX "slipstick_"

/* Prefixes of options, by kind. */
static const char *const PREFIXES[] = {PREFIX, PREFIX "zone_", PREFIX "bulk_"};

struct ss_session {
    MPI_Comm all;     /* for results */
    MPI_Comm end;     /* for ss_meet, whose messages must not mix with results */
    int rank, size, here;
    int owns_mpi, owns_petsc;
    int *counts, *begins;
    char message[1024];
};

struct ss_matrix {
    Mat mat;
};

struct ss_factors {
    KSP ksp;
    Vec rhs, x;
};

/* Keeps the first message of an error instead of printing it. */
static PetscErrorCode keep_message(MPI_Comm comm, int line, const char *function, const char *file, PetscErrorCode code,
                                   PetscErrorType type, const char *text, void *context)
{
    ss_session *session = (ss_session *)context;
    (void)comm, (void)line, (void)file;
    if (type == PETSC_ERROR_INITIAL && session->message[0] == 0) {
        const char *general = NULL;
        PetscErrorMessage(code, &general, NULL);
        snprintf(session->message, sizeof session->message, "%s in %s: %s", general ? general : "error",
                 function ? function : "PETSc", text ? text : "no further message");
    }
    return code;
}

/* Undoes what ss_start has done so far. */
static void close_all(ss_session *session)
{
    if (session->owns_petsc) {
        PetscPopErrorHandler();
        PetscFinalize();
    }
    if (session->all != MPI_COMM_NULL) MPI_Comm_free(&session->all);
    if (session->end != MPI_COMM_NULL) MPI_Comm_free(&session->end);
    if (session->owns_mpi) MPI_Finalize();
    free(session->counts);
    free(session->begins);
    free(session);
}

int ss_start(ss_session **out)
{
    int initialized = 0, finalized = 0, level = 0;
    PetscBool started = PETSC_FALSE;
    MPI_Comm near = MPI_COMM_NULL;
    ss_session *session = (ss_session *)calloc(1, sizeof *session);
    *out = NULL;
    if (!session) return PETSC_ERR_MEM;
    session->all = session->end = MPI_COMM_NULL;
    MPI_Initialized(&initialized);
    MPI_Finalized(&finalized);
    PetscInitialized(&started);
    if (finalized || started) {
        free(session);
        return PETSC_ERR_ORDER;
    }
    if (!initialized) {
        if (MPI_Init_thread(NULL, NULL, MPI_THREAD_SERIALIZED, &level)) {
            free(session);
            return PETSC_ERR_LIB;
        }
        session->owns_mpi = 1;
    }
    MPI_Comm_dup(MPI_COMM_WORLD, &session->all);
    MPI_Comm_dup(MPI_COMM_WORLD, &session->end);
    MPI_Comm_rank(session->all, &session->rank);
    MPI_Comm_size(session->all, &session->size);
    MPI_Comm_split_type(session->all, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &near);
    MPI_Comm_size(near, &session->here);
    MPI_Comm_free(&near);
    session->counts = (int *)calloc((size_t)session->size, sizeof(int));
    session->begins = (int *)calloc((size_t)session->size, sizeof(int));
    PetscErrorCode code = session->counts && session->begins ? 0 : PETSC_ERR_MEM;
    if (!code) code = PetscOptionsSetValue(NULL, "-skip_petscrc", "1");
    if (!code) code = PetscOptionsSetValue(NULL, "-no_signal_handler", "1");
    /* entries of several ranks are added in the order of the ranks */
    if (!code) code = PetscOptionsSetValue(NULL, "-matstash_reproduce", "1");
    if (!code) code = PetscInitializeNoArguments();
    if (code) {
        close_all(session);
        return code;
    }
    session->owns_petsc = 1;
    PetscPushErrorHandler(keep_message, session);
    *out = session;
    return 0;
}

void ss_end(ss_session *session) { close_all(session); }

int ss_message(ss_session *session, char *text, int64_t capacity)
{
    snprintf(text, (size_t)capacity, "%s", session->message);
    session->message[0] = 0;
    return 0;
}

int32_t ss_rank(const ss_session *session) { return session->rank; }
int32_t ss_size(const ss_session *session) { return session->size; }
int32_t ss_size_here(const ss_session *session) { return session->here; }

int ss_options(ss_session *session, const char *options)
{
    (void)session;
    PetscErrorCode code = PetscOptionsPrefixPush(NULL, PREFIX);
    if (code) return code;
    code = PetscOptionsInsertString(NULL, options);
    PetscErrorCode popped = PetscOptionsPrefixPop(NULL);
    return code ? code : popped;
}

int ss_unused(ss_session *session, char *text, int64_t capacity)
{
    PetscInt count = 0;
    char **names = NULL, **values = NULL;
    const size_t prefix = strlen(PREFIX);
    size_t length = 0;
    (void)session;
    text[0] = 0;
    PetscErrorCode code = PetscOptionsLeftGet(NULL, &count, &names, &values);
    if (code) return code;
    for (PetscInt i = 0; i < count; i++) {
        if (strncmp(names[i], PREFIX, prefix) != 0 || length + strlen(names[i]) + 2 > (size_t)capacity) continue;
        length += (size_t)snprintf(text + length, (size_t)capacity - length, "%s\n", names[i] + prefix);
    }
    return PetscOptionsLeftRestore(NULL, &count, &names, &values);
}

/* Every sum is formed in one place and copied from there, so that all ranks have the same bits. */
void ss_sum(ss_session *session, double *values, int64_t count)
{
    const int size = session->size;
    if (size == 1 || count == 0) return;
    if (count < FEW) {
        if (session->rank == 0) MPI_Reduce(MPI_IN_PLACE, values, (int)count, MPI_DOUBLE, MPI_SUM, 0, session->all);
        else MPI_Reduce(values, NULL, (int)count, MPI_DOUBLE, MPI_SUM, 0, session->all);
        (void)MPI_Bcast(values, (int)count, MPI_DOUBLE, 0, session->all);
        return;
    }
    /* MPI counts are ints, so long vectors are sent in pieces */
    const int64_t piece = (int64_t)1 << 30;
    for (int64_t begin = 0; begin < count; begin += piece) {
        const int64_t length = count - begin < piece ? count - begin : piece;
        for (int r = 0; r < size; r++) {
            session->begins[r] = (int)(length * r / size);
            session->counts[r] = (int)(length * (r + 1) / size) - session->begins[r];
        }
        const int own = session->begins[session->rank];
        double *sums = (double *)malloc((size_t)(session->counts[session->rank] + 1) * sizeof(double));
        if (!sums) MPI_Abort(session->all, 1);
        MPI_Reduce_scatter(values + begin, sums, session->counts, MPI_DOUBLE, MPI_SUM, session->all);
        memcpy(values + begin + own, sums, (size_t)session->counts[session->rank] * sizeof(double));
        free(sums);
        (void)MPI_Allgatherv(MPI_IN_PLACE, 0, MPI_DATATYPE_NULL, values + begin, session->counts, session->begins, MPI_DOUBLE,
                       session->all);
    }
}

int32_t ss_any(ss_session *session, int32_t here)
{
    int all = here;
    if (session->size > 1) MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPI_INT, MPI_LOR, session->all);
    return all;
}

void ss_gather_lengths(ss_session *session, int64_t length, int64_t *lengths)
{
    (void)MPI_Allgather(&length, 1, MPI_INT64_T, lengths, 1, MPI_INT64_T, session->all);
}

/* One broadcast per rank, so that no sum of lengths has to fit into an int. */
void ss_gather(ss_session *session, const char *here, const int64_t *lengths, char *all)
{
    const int64_t piece = (int64_t)1 << 30;
    for (int r = 0; r < session->size; r++) {
        if (r == session->rank) memcpy(all, here, (size_t)lengths[r]);
        for (int64_t begin = 0; begin < lengths[r]; begin += piece) {
            const int64_t length = lengths[r] - begin < piece ? lengths[r] - begin : piece;
            (void)MPI_Bcast(all + begin, (int)length, MPI_CHAR, r, session->all);
        }
        all += lengths[r];
    }
}

void ss_exchange(ss_session *session, const double *values, const int64_t *to, double *all, const int64_t *from)
{
    const int size = session->size;
    const int64_t most = (int64_t)1 << 30;
    int count = 0;
    MPI_Request *requests = (MPI_Request *)malloc(2 * (size_t)size * sizeof(MPI_Request));
    if (!requests) MPI_Abort(session->all, 1);
    for (int r = 0; r < size; r++) {
        /* MPI counts are ints; ranks exchange far less data than this limit */
        if (from[r] > most || to[r] > most) MPI_Abort(session->all, 1);
        if (from[r] > 0) (void)MPI_Irecv(all, (int)from[r], MPI_DOUBLE, r, 0, session->all, &requests[count++]);
        all += from[r];
    }
    for (int r = 0; r < size; r++) {
        if (to[r] > 0) (void)MPI_Isend(values, (int)to[r], MPI_DOUBLE, r, 0, session->all, &requests[count++]);
        values += to[r];
    }
    (void)MPI_Waitall(count, requests, MPI_STATUSES_IGNORE);
    free(requests);
}

/* Whether all ranks reach this call within this many seconds. */
int32_t ss_meet(ss_session *session, double seconds)
{
    MPI_Request request;
    int done = 0;
    const double end = MPI_Wtime() + seconds;
    const struct timespec pause = {0, 1000000};
    MPI_Ibarrier(session->end, &request);
    for (;;) {
        MPI_Test(&request, &done, MPI_STATUS_IGNORE);
        if (done) return 1;
        if (MPI_Wtime() > end) return 0;
        nanosleep(&pause, NULL);
    }
}

void ss_abort(ss_session *session, int32_t code) { MPI_Abort(session->all, code); }

/* Counts the entries of a row, separately for columns of its owner and other columns. */
static PetscErrorCode count_row(PetscLayout layout, PetscInt row, int32_t count, const int32_t *columns, Vec near, Vec far)
{
    const PetscInt *ranges;
    PetscMPIInt owner;
    PetscErrorCode code = PetscLayoutFindOwner(layout, row, &owner);
    if (!code) code = PetscLayoutGetRanges(layout, &ranges);
    if (code) return code;
    int32_t inside = 0;
    for (int32_t k = 0; k < count; k++) inside += ranges[owner] <= columns[k] && columns[k] < ranges[owner + 1];
    code = VecSetValue(near, row, inside, ADD_VALUES);
    return code ? code : VecSetValue(far, row, count - inside, ADD_VALUES);
}

/* Room for as many entries per row as the ranks count together. Entries that several ranks have are counted several
 * times. */
static PetscErrorCode allocate_rows(Mat mat, PetscInt own, PetscInt n, Vec near, Vec far)
{
    PetscInt *lengths = NULL;
    const PetscScalar *inside = NULL, *outside = NULL;
    PetscErrorCode code = VecAssemblyBegin(near);
    if (!code) code = VecAssemblyEnd(near);
    if (!code) code = VecAssemblyBegin(far);
    if (!code) code = VecAssemblyEnd(far);
    if (!code) code = PetscMalloc1(2 * own, &lengths);
    if (!code) code = VecGetArrayRead(near, &inside);
    if (!code) code = VecGetArrayRead(far, &outside);
    if (code) return code;
    for (PetscInt i = 0; i < own; i++) {
        const PetscInt a = (PetscInt)PetscRealPart(inside[i]), b = (PetscInt)PetscRealPart(outside[i]);
        lengths[i] = a < own ? a : own;
        lengths[own + i] = b < n - own ? b : n - own;
    }
    code = VecRestoreArrayRead(near, &inside);
    if (!code) code = VecRestoreArrayRead(far, &outside);
    /* each of these acts on matrices of its own type only */
    if (!code) code = MatSeqAIJSetPreallocation(mat, 0, lengths);
    if (!code) code = MatMPIAIJSetPreallocation(mat, 0, lengths, 0, lengths + own);
    PetscErrorCode freed = PetscFree(lengths);
    return code ? code : freed;
}

static PetscErrorCode add_row(Mat mat, PetscInt row, int32_t count, const int32_t *columns, const double *values)
{
    PetscInt here[64];
    for (int32_t begin = 0; begin < count; begin += 64) {
        const PetscInt length = count - begin < 64 ? count - begin : 64;
        for (PetscInt k = 0; k < length; k++) here[k] = columns[begin + k];
        PetscErrorCode code = MatSetValues(mat, 1, &row, length, here, values + begin, ADD_VALUES);
        if (code) return code;
    }
    return 0;
}

int ss_matrix_new(ss_session *session, int64_t own, int64_t n, int32_t block, int64_t rows, ss_row give, void *data,
                  ss_matrix **out)
{
    PetscLayout layout = NULL;
    Vec near = NULL, far = NULL;
    int32_t row, count;
    const int32_t *columns;
    const double *values;
    ss_matrix *matrix = (ss_matrix *)calloc(1, sizeof *matrix);
    *out = matrix;
    if (!matrix) return PETSC_ERR_MEM;
    PetscErrorCode code = MatCreate(session->all, &matrix->mat);
    if (!code) code = MatSetSizes(matrix->mat, (PetscInt)own, (PetscInt)own, (PetscInt)n, (PetscInt)n);
    if (!code) code = MatSetBlockSize(matrix->mat, block);
    if (!code) code = MatSetType(matrix->mat, MATAIJ);
    if (!code) code = MatGetLayouts(matrix->mat, &layout, NULL);
    if (!code) code = PetscLayoutSetUp(layout);
    if (!code) code = VecCreateMPI(session->all, (PetscInt)own, (PetscInt)n, &near);
    if (!code) code = VecCreateMPI(session->all, (PetscInt)own, (PetscInt)n, &far);
    for (int64_t k = 0; k < rows && !code; k++) {
        give(data, k, &row, &count, &columns, &values);
        if (count > 0) code = count_row(layout, row, count, columns, near, far);
    }
    if (!code) code = allocate_rows(matrix->mat, (PetscInt)own, (PetscInt)n, near, far);
    if (near) VecDestroy(&near);
    if (far) VecDestroy(&far);
    return code;
}

int ss_matrix_set(ss_session *session, ss_matrix *matrix, int64_t rows, ss_row give, void *data)
{
    PetscBool filled = PETSC_FALSE;
    int32_t row, count;
    const int32_t *columns;
    const double *values;
    (void)session;
    PetscErrorCode code = MatAssembled(matrix->mat, &filled);
    if (!code && filled) code = MatZeroEntries(matrix->mat);
    for (int64_t k = 0; k < rows && !code; k++) {
        give(data, k, &row, &count, &columns, &values);
        if (count > 0) code = add_row(matrix->mat, row, count, columns, values);
    }
    if (!code) code = MatAssemblyBegin(matrix->mat, MAT_FINAL_ASSEMBLY);
    return code ? code : MatAssemblyEnd(matrix->mat, MAT_FINAL_ASSEMBLY);
}

int ss_matrix_rigid(ss_session *session, ss_matrix *matrix, const double *coordinates)
{
    Vec places = NULL;
    MatNullSpace motions = NULL;
    PetscInt own;
    PetscScalar *entries;
    (void)session;
    PetscErrorCode code = MatCreateVecs(matrix->mat, &places, NULL);
    if (!code) code = VecSetBlockSize(places, 3);
    if (!code) code = VecGetLocalSize(places, &own);
    if (!code) code = VecGetArray(places, &entries);
    if (!code) memcpy(entries, coordinates, (size_t)own * sizeof(double));
    if (!code) code = VecRestoreArray(places, &entries);
    if (!code) code = MatNullSpaceCreateRigidBody(places, &motions);
    if (!code) code = MatSetNearNullSpace(matrix->mat, motions);
    if (motions) MatNullSpaceDestroy(&motions);
    if (places) VecDestroy(&places);
    return code;
}

void ss_matrix_free(ss_matrix *matrix)
{
    if (!matrix) return;
    if (matrix->mat) MatDestroy(&matrix->mat);
    free(matrix);
}

/* A V-cycle over smoothed aggregates. The smoother is incomplete factorization on each rank, which tolerates weak
 * elements and has a transpose. */
static PetscErrorCode choose_multigrid(const char *prefix)
{
    static const char *const defaults[][2] = {
        {"mg_levels_ksp_type", "richardson"}, {"mg_levels_pc_type", "bjacobi"}, {"mg_levels_ksp_max_it", "1"},
        {"mg_levels_sub_pc_type", "ilu"},     {"mg_levels_sub_pc_factor_shift_type", "nonzero"},
    };
    for (size_t i = 0; i < sizeof defaults / sizeof defaults[0]; i++) {
        char name[128];
        PetscBool chosen = PETSC_FALSE;
        snprintf(name, sizeof name, "-%s%s", prefix, defaults[i][0]);
        PetscErrorCode code = PetscOptionsHasName(NULL, NULL, name, &chosen);
        if (!code && !chosen) code = PetscOptionsSetValue(NULL, name, defaults[i][1]);
        if (code) return code;
    }
    return 0;
}

int ss_factors_new(ss_session *session, ss_matrix *matrix, int32_t kind, ss_factors **out)
{
    PC pc;
    ss_factors *factors = (ss_factors *)calloc(1, sizeof *factors);
    *out = factors;
    if (!factors) return PETSC_ERR_MEM;
    PetscErrorCode code = KSPCreate(session->all, &factors->ksp);
    if (!code) code = KSPSetOptionsPrefix(factors->ksp, PREFIXES[kind]);
    if (!code) code = KSPSetOperators(factors->ksp, matrix->mat, matrix->mat);
    if (!code) code = KSPSetType(factors->ksp, KSPPREONLY);
    if (!code) code = KSPGetPC(factors->ksp, &pc);
    if (kind == 2) {
        if (!code) code = PCSetType(pc, PCGAMG);
        if (!code) code = choose_multigrid(PREFIXES[kind]);
    } else {
        if (!code) code = PCSetType(pc, PCLU);
        if (!code) code = PCFactorSetMatSolverType(pc, MATSOLVERMUMPS);
    }
    if (!code) code = KSPSetFromOptions(factors->ksp);
    if (!code) code = MatCreateVecs(matrix->mat, &factors->x, &factors->rhs);
    return code;
}

/* The names of KSP, PC and package, and whether they can solve with the transpose. */
static PetscErrorCode describe(KSP ksp, PC pc, ss_facts *facts)
{
    KSPType iteration = NULL;
    PCType method = NULL;
    MatSolverType package = NULL;
    PetscBool factors = PETSC_FALSE, transposes = PETSC_FALSE, preonly = PETSC_FALSE, mumps = PETSC_FALSE;
    PetscErrorCode code = KSPGetType(ksp, &iteration);
    if (!code) code = PCGetType(pc, &method);
    if (!code) code = PetscStrcmp(iteration, KSPPREONLY, &preonly);
    if (!code) code = PetscObjectTypeCompareAny((PetscObject)pc, &factors, PCLU, PCCHOLESKY, PCILU, PCICC, "");
    if (!code && factors) code = PCFactorGetMatSolverType(pc, &package);
    if (!code && package) code = PetscStrcmp(package, MATSOLVERMUMPS, &mumps);
    if (!code) code = PCApplyTransposeExists(pc, &transposes);
    if (code) return code;
    facts->direct = preonly && factors;
    facts->is_mumps = mumps;
    facts->transposes = transposes;
    snprintf(facts->name, sizeof facts->name, "%s, %s%s%s", iteration ? iteration : "?", method ? method : "?",
             package ? ", " : "", package ? package : "");
    return 0;
}

/* The numbers that MUMPS reports; see the manual of MUMPS, section 8. */
static PetscErrorCode ask_mumps(PC pc, ss_facts *facts)
{
    Mat inside;
    PetscInt value = 0;
    PetscErrorCode code = PCFactorGetMatrix(pc, &inside);
    if (!code) code = MatMumpsGetInfog(inside, 1, &value);
    facts->mumps_error = (int32_t)value;
    if (!code) code = MatMumpsGetInfog(inside, 2, &value);
    facts->mumps_detail = value;
    if (!code) code = MatMumpsGetInfog(inside, 18, &value);
    facts->megabytes = value;
    if (!code) code = MatMumpsGetRinfog(inside, 3, &facts->operations);
    if (!code) code = MatMumpsGetInfo(inside, 16, &value);
    facts->megabytes_here = value;
    if (!code) code = MatMumpsGetRinfo(inside, 3, &facts->operations_here);
    return code;
}

/* Frees what the products of a multigrid method keep for other values of its matrix, which it never gets. */
static PetscErrorCode forget_products(PC pc)
{
    PetscBool multigrid = PETSC_FALSE;
    PetscInt levels = 0;
    PetscErrorCode code = PetscObjectTypeCompare((PetscObject)pc, PCGAMG, &multigrid);
    if (!code && multigrid) code = PCMGGetLevels(pc, &levels);
    for (PetscInt level = 0; level < levels && !code; level++) {
        KSP smoother;
        Mat mat, finer = NULL;
        code = PCMGGetSmoother(pc, level, &smoother);
        if (!code) code = KSPGetOperators(smoother, &mat, NULL);
        if (!code) code = MatProductClear(mat);
        if (!code && level > 0) code = PCMGGetInterpolation(pc, level, &finer);
        if (!code && finer) code = MatProductClear(finer);
    }
    return code;
}

/* Factorizes; the analysis is kept if the pattern has not changed. `workspace` is the percentage by which MUMPS may
 * exceed its memory estimate from now on; 0 leaves it unchanged. */
int ss_factors_renew(ss_session *session, ss_factors *factors, ss_matrix *matrix, int32_t workspace, ss_facts *facts)
{
    PC pc;
    (void)session;
    memset(facts, 0, sizeof *facts);
    PetscErrorCode code = 0;
    if (workspace > 0) {
        /* failed factors cannot be reused: new ones are made with more workspace, as are all later ones */
        const char *prefix = NULL;
        char name[96], percentage[16];
        code = KSPGetOptionsPrefix(factors->ksp, &prefix);
        snprintf(name, sizeof name, "-%smat_mumps_icntl_14", prefix ? prefix : "");
        snprintf(percentage, sizeof percentage, "%d", (int)workspace);
        if (!code) code = PetscOptionsSetValue(NULL, name, percentage);
        if (!code) code = KSPReset(factors->ksp);
    }
    if (!code) code = KSPSetReusePreconditioner(factors->ksp, PETSC_FALSE);
    if (!code) code = KSPSetOperators(factors->ksp, matrix->mat, matrix->mat);
    if (!code) code = KSPGetPC(factors->ksp, &pc);
    if (!code) code = KSPSetUp(factors->ksp);
    if (!code) code = forget_products(pc);
    if (!code) code = describe(factors->ksp, pc, facts);
    if (!code && facts->is_mumps) code = ask_mumps(pc, facts);
    if (!code) code = KSPSetReusePreconditioner(factors->ksp, PETSC_TRUE);
    return code;
}

int ss_factors_solve(ss_session *session, ss_factors *factors, int32_t transpose, const double *rhs, double *x)
{
    (void)session;
    PetscErrorCode code = VecPlaceArray(factors->rhs, rhs);
    if (code) return code;
    code = VecPlaceArray(factors->x, x);
    if (!code) {
        code = transpose ? KSPSolveTranspose(factors->ksp, factors->rhs, factors->x)
                         : KSPSolve(factors->ksp, factors->rhs, factors->x);
        PetscErrorCode reset = VecResetArray(factors->x);
        if (!code) code = reset;
    }
    PetscErrorCode reset = VecResetArray(factors->rhs);
    return code ? code : reset;
}

void ss_factors_free(ss_factors *factors)
{
    if (!factors) return;
    if (factors->ksp) KSPDestroy(&factors->ksp);
    if (factors->rhs) VecDestroy(&factors->rhs);
    if (factors->x) VecDestroy(&factors->x);
    free(factors);
}
