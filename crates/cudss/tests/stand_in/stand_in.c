/* A stand-in for the CUDA driver and cuDSS on machines without a GPU. "Device" memory is that of the
   process, and factors are dense. It checks the order of calls and their arguments, counts live
   objects, and can be told to fail. The names and numbers are those of NVIDIA's documentation. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SUCCESS, NOT_INITIALIZED, ALLOC_FAILED, INVALID_VALUE };

/* What the tests set and read. */
static int devices = 1, major = 1, live = 0, factorizations = 0;
static size_t room = (size_t)1 << 30;
void stand_in_devices(int count) { devices = count; }
void stand_in_major(int version) { major = version; }
void stand_in_room(size_t bytes) { room = bytes; }
int stand_in_live(void) { return live; }

/* The driver. */
static int context;
static void *current;
int cuInit(unsigned flags) { return flags ? 1 : devices ? 0 : 100; }
int cuDeviceGetCount(int *count) { return *count = devices, 0; }
int cuDeviceGet(int *device, int number) { return *device = number, number < devices ? 0 : 101; }
int cuDeviceGetName(char *name, int length, int device) {
    (void)device;
    strncpy(name, "stand-in", (size_t)length);
    return 0;
}
int cuDevicePrimaryCtxRetain(void **made, int device) { return (void)device, *made = &context, live++, 0; }
int cuDevicePrimaryCtxRelease_v2(int device) { return (void)device, live--, 0; }
int cuCtxPushCurrent_v2(void *chosen) { return current = chosen, chosen == &context ? 0 : 201; }
int cuCtxPopCurrent_v2(void **left) { return *left = current, current = NULL, *left ? 0 : 201; }
int cuMemGetInfo_v2(size_t *left, size_t *total) { return *left = room, *total = (size_t)1 << 30, current ? 0 : 201; }
int cuMemAlloc_v2(uint64_t *address, size_t bytes) {
    if (!current || !bytes) return 1;
    if (bytes > room) return 2;
    size_t *block = malloc(sizeof(size_t) + bytes);
    *block = bytes;
    room -= bytes;
    live++;
    memset(block + 1, 0xff, bytes); /* NaN until it is written */
    *address = (uint64_t)(uintptr_t)(block + 1);
    return 0;
}
int cuMemFree_v2(uint64_t address) {
    size_t *block = (size_t *)(uintptr_t)address - 1;
    room += *block;
    live--;
    free(block);
    return current ? 0 : 201;
}
int cuMemcpyHtoD_v2(uint64_t to, const void *from, size_t bytes) {
    return memcpy((void *)(uintptr_t)to, from, bytes), current ? 0 : 201;
}
int cuMemcpyDtoH_v2(void *to, uint64_t from, size_t bytes) {
    return memcpy(to, (void *)(uintptr_t)from, bytes), current ? 0 : 201;
}
int cuGetErrorName(int code, const char **name) {
    return *name = code == 2 ? "CUDA_ERROR_OUT_OF_MEMORY" : code == 100 ? "CUDA_ERROR_NO_DEVICE" : "CUDA_ERROR_OTHER", 0;
}

/* cuDSS. */
struct handle { int unused; };
struct config { int mode, matching, levels; }; /* matching is on unless it is turned off */
struct data { int *order, *parts; double *lu; int *pivots; int64_t n; int count, stage, info; };
struct matrix { int64_t rows, columns, entries; const int *offsets, *places; const void *values; int type, dense; };

static void *made(size_t bytes) { return live++, calloc(1, bytes); }
int cudssGetProperty(int part, int *value) { return *value = part == 0 ? major : 0, SUCCESS; }
int cudssCreate(struct handle **handle) { return *handle = made(sizeof **handle), current ? SUCCESS : NOT_INITIALIZED; }
/* Writes the number of factorizations so far to the file that STAND_IN_COUNT names. */
int cudssDestroy(struct handle *handle) {
    FILE *told = getenv("STAND_IN_COUNT") ? fopen(getenv("STAND_IN_COUNT"), "w") : NULL;
    if (told) fprintf(told, "%d\n", factorizations), fclose(told);
    return free(handle), live--, SUCCESS;
}
int cudssConfigCreate(struct config **config) { return *config = made(sizeof **config), (*config)->matching = 6, SUCCESS; }
int cudssConfigDestroy(struct config *config) { return free(config), live--, SUCCESS; }
int cudssConfigSet(struct config *config, int setting, const void *value, size_t bytes) {
    if (bytes != sizeof(int)) return INVALID_VALUE;
    if (setting == 4) config->mode = *(const int *)value;
    else if (setting == 3) config->matching = *(const int *)value;
    else if (setting == 17) config->levels = *(const int *)value;
    else return INVALID_VALUE;
    return SUCCESS;
}
int cudssDataCreate(struct handle *handle, struct data **data) { return *data = made(sizeof **data), handle ? SUCCESS : NOT_INITIALIZED; }
int cudssDataDestroy(struct handle *handle, struct data *data) {
    free(data->order), free(data->parts), free(data->lu), free(data->pivots), free(data), live--;
    return handle ? SUCCESS : NOT_INITIALIZED;
}
int cudssDataSet(struct handle *handle, struct data *data, int datum, const void *value, size_t bytes) {
    if (!handle || (datum != 9 && datum != 21)) return INVALID_VALUE;
    int **kept = datum == 9 ? &data->order : &data->parts;
    memcpy(*kept = malloc(bytes + 1), value, bytes);
    if (datum == 9) data->n = (int64_t)(bytes / sizeof(int));
    else data->count = (int)(bytes / sizeof(int));
    return SUCCESS;
}
int cudssDataGet(struct handle *handle, struct data *data, int datum, void *value, size_t bytes, size_t *written) {
    if (!handle || data->stage < 1) return NOT_INITIALIZED;
    *written = bytes;
    if (datum == 0 && bytes == 4) *(int *)value = data->info;
    else if (datum == 13 && bytes == 128) ((int64_t *)value)[0] = ((int64_t *)value)[1] = 8 * data->n * data->n;
    else return INVALID_VALUE;
    return SUCCESS;
}
int cudssMatrixCreateDn(struct matrix **matrix, int64_t rows, int64_t columns, int64_t stride, const void *values, int type, int layout) {
    *matrix = made(sizeof **matrix);
    **matrix = (struct matrix){ rows, columns, 0, 0, 0, values, type, 1 };
    return stride == rows && layout == 0 ? SUCCESS : INVALID_VALUE;
}
int cudssMatrixCreateCsr(struct matrix **matrix, int64_t rows, int64_t columns, int64_t entries, const void *begin,
                         const void *end, const void *places, const void *values, int offset_type, int index_type,
                         int type, int kind, int view, int base) {
    *matrix = made(sizeof **matrix);
    **matrix = (struct matrix){ rows, columns, entries, begin, places, values, type, 0 };
    return !end && offset_type == 10 && index_type == 10 && !kind && !view && !base ? SUCCESS : INVALID_VALUE;
}
int cudssMatrixDestroy(struct matrix *matrix) { return free(matrix), live--, SUCCESS; }

static double at(const void *values, int type, int64_t i) {
    return type ? ((const double *)values)[i] : ((const float *)values)[i];
}

/* Whether the elimination order and the parts have every unknown once. */
static int analyse(const struct config *config, struct data *data, const struct matrix *a) {
    if (data->n != a->rows || config->matching || data->count != (1 << config->levels) - 1) return INVALID_VALUE;
    for (int64_t left = data->n, part = 0; part <= data->count; part++) {
        if (part == data->count && left) return INVALID_VALUE;
        if (part < data->count) left -= data->parts[part];
    }
    char *seen = calloc((size_t)data->n + 1, 1);
    int64_t count = 0;
    for (int64_t i = 0; i < data->n; i++) {
        int unknown = data->order[i];
        if (unknown >= 0 && unknown < data->n && !seen[unknown]) seen[unknown] = 1, count++;
    }
    free(seen);
    data->stage = 1;
    return count == data->n ? SUCCESS : INVALID_VALUE;
}

/* Gaussian elimination with partial pivoting; a zero pivot is replaced, as cuDSS does. */
static int factorize(struct data *data, const struct matrix *a) {
    int64_t n = data->n;
    if (data->stage < 1) return NOT_INITIALIZED;
    free(data->lu), free(data->pivots);
    double *lu = data->lu = calloc((size_t)(n * n) + 1, sizeof(double));
    data->pivots = malloc((size_t)n * sizeof(int) + 1);
    if (a->offsets[n] != a->entries) return INVALID_VALUE;
    for (int64_t i = 0; i < n; i++)
        for (int k = a->offsets[i]; k < a->offsets[i + 1]; k++) lu[i * n + a->places[k]] = at(a->values, a->type, k);
    for (int64_t k = 0; k < n; k++) {
        int64_t pivot = k;
        for (int64_t i = k + 1; i < n; i++)
            if (fabs(lu[i * n + k]) > fabs(lu[pivot * n + k])) pivot = i;
        data->pivots[k] = (int)pivot;
        for (int64_t j = 0; j < n && pivot != k; j++) {
            double kept = lu[k * n + j];
            lu[k * n + j] = lu[pivot * n + j], lu[pivot * n + j] = kept;
        }
        if (lu[k * n + k] == 0) lu[k * n + k] = 1e-13;
        for (int64_t i = k + 1; i < n; i++) {
            double factor = lu[i * n + k] /= lu[k * n + k];
            for (int64_t j = k + 1; j < n; j++) lu[i * n + j] -= factor * lu[k * n + j];
        }
    }
    data->stage = 2;
    factorizations++;
    return SUCCESS;
}

static void solve(const struct data *data, int transpose, double *x) {
    int64_t n = data->n;
    const double *lu = data->lu;
    if (!transpose) {
        for (int64_t k = 0; k < n; k++) {
            double kept = x[k];
            x[k] = x[data->pivots[k]], x[data->pivots[k]] = kept;
        }
        for (int64_t i = 0; i < n; i++)
            for (int64_t j = 0; j < i; j++) x[i] -= lu[i * n + j] * x[j];
        for (int64_t i = n; i-- > 0; x[i] /= lu[i * n + i])
            for (int64_t j = i + 1; j < n; j++) x[i] -= lu[i * n + j] * x[j];
        return;
    }
    for (int64_t i = 0; i < n; i++) {
        for (int64_t j = 0; j < i; j++) x[i] -= lu[j * n + i] * x[j];
        x[i] /= lu[i * n + i];
    }
    for (int64_t i = n; i-- > 0;)
        for (int64_t j = i + 1; j < n; j++) x[i] -= lu[j * n + i] * x[j];
    for (int64_t k = n; k-- > 0;) {
        double kept = x[k];
        x[k] = x[data->pivots[k]], x[data->pivots[k]] = kept;
    }
}

static int solve_all(const struct config *config, const struct data *data, const struct matrix *x, const struct matrix *b) {
    int64_t n = data->n;
    if (data->stage < 2) return NOT_INITIALIZED;
    if (x->rows != n || b->rows != n || x->columns != b->columns || !x->values || !b->values) return INVALID_VALUE;
    double *column = malloc((size_t)n * sizeof(double) + 1);
    for (int64_t c = 0; c < b->columns; c++) {
        for (int64_t i = 0; i < n; i++) column[i] = at(b->values, b->type, c * n + i);
        solve(data, config->mode, column);
        for (int64_t i = 0; i < n; i++) {
            if (x->type) ((double *)x->values)[c * n + i] = column[i];
            else ((float *)x->values)[c * n + i] = (float)column[i];
        }
    }
    free(column);
    return SUCCESS;
}

int cudssExecute(struct handle *handle, int phase, struct config *config, struct data *data, struct matrix *a,
                 struct matrix *x, struct matrix *b) {
    if (!handle || !current || !config || !data || !a || a->dense || !x || !b) return NOT_INITIALIZED;
    switch (phase) {
        case 3: return analyse(config, data, a);
        case 4: return factorize(data, a);
        case 496: return solve_all(config, data, x, b);
        default: return INVALID_VALUE;
    }
}
