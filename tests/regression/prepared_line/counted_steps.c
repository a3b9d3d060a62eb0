/* Steps a line to its end: writes the force of each pantograph after each step as a hexadecimal
 * number, then how often memory was allocated in steps. */
#define _GNU_SOURCE
#include <stdio.h>

#include "catenary.h"

static long n_allocations = 0;

extern void* __libc_malloc(size_t size);
extern void* __libc_calloc(size_t n, size_t size);
extern void* __libc_realloc(void* old, size_t size);
void* malloc(size_t size) {
    ++n_allocations;
    return __libc_malloc(size);
}
void* calloc(size_t n, size_t size) {
    ++n_allocations;
    return __libc_calloc(n, size);
}
void* realloc(void* old, size_t size) {
    ++n_allocations;
    return __libc_realloc(old, size);
}

int main(int argc, char** argv) {
    char error[512];
    catenary_simulation* line = argc == 2 ? catenary_open(argv[1], error, sizeof error) : NULL;
    if (!line) {
        fprintf(stderr, "%s\n", error);
        return 2;
    }
    if (n_allocations == 0) return 3; /* they are not counted */
    const int64_t n = catenary_n_pantographs(line);
    long in_steps = 0;
    while (1) {
        const long before = n_allocations;
        const int outcome = catenary_step(line, 1);
        in_steps += n_allocations - before;
        if (outcome == CATENARY_AT_END) break;
        if (outcome != CATENARY_DONE) return 1;
        for (int64_t k = 0; k < n; ++k)
            printf("%a%c", catenary_contact_force(line)[k], k + 1 < n ? ' ' : '\n');
    }
    fprintf(stderr, "%ld\n", in_steps);
    catenary_close(line);
    return 0;
}
