/* Steps a prepared line from C, and shows how long single steps take.
 *
 *   catenary prepare en50318_2002 -o en300.line
 *   cc -O2 steps_from_c.c -I FOLDER_OF_HEADER LIBRARY -o steps_from_c
 *   ./steps_from_c en300.line 1000000
 *
 * FOLDER_OF_HEADER and LIBRARY are what `catenary prepare` prints. */
#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <time.h>

#include "catenary.h"

static double now_us(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return 1e6 * (double)time.tv_sec + 1e-3 * (double)time.tv_nsec;
}

static long page_faults(void) {
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_minflt + usage.ru_majflt;
}

static int ascending(const void* a, const void* b) {
    const double x = *(const double*)a, y = *(const double*)b;
    return (x > y) - (x < y);
}

int main(int argc, char** argv) {
    const long n = argc > 2 ? atol(argv[2]) : 0;
    if (n < 1) {
        fprintf(stderr, "usage: steps_from_c LINE NUMBER_OF_STEPS\n");
        return 2;
    }
    char error[512];
    catenary_simulation* line = catenary_open(argv[1], error, sizeof error);
    if (!line) {
        fprintf(stderr, "%s\n", error);
        return 2;
    }
    double* took = malloc((size_t)n * sizeof *took);
    void* start = malloc(catenary_state_size(line));
    if (!took || !start) return 1;
    catenary_save(line, start);
    if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) fprintf(stderr, "memory is not locked\n");

    /* One by one, as a host takes them, again from the start where the line ends. */
    for (long k = 0; k < n; ++k) took[k] = 0.0;
    const long faults = page_faults();
    double lowest = 1e300, highest = -1e300;
    for (long k = 0; k < n;) {
        const double begin = now_us();
        const int outcome = catenary_step(line, 1);
        took[k] = now_us() - begin;
        if (outcome != CATENARY_DONE && outcome != CATENARY_AT_END) return 1;
        if (outcome == CATENARY_AT_END) {
            catenary_restore(line, start);
            continue;
        }
        const double force = catenary_contact_force(line)[0];
        if (force < lowest) lowest = force;
        if (force > highest) highest = force;
        ++k;
    }
    const long n_faults = page_faults() - faults;

    /* Many in one call, as a run takes them. */
    double in_loop = 1e300;
    for (int turn = 0; turn < 5; ++turn) {
        catenary_restore(line, start);
        const int64_t all = catenary_steps_left(line);
        const double begin = now_us();
        catenary_step(line, all);
        const double each = (now_us() - begin) / (double)all;
        if (each < in_loop) in_loop = each;
    }

    qsort(took, (size_t)n, sizeof *took, ascending);
    printf("%ld steps, %ld page faults, forces of the first pantograph %.1f to %.1f N\n", n,
           n_faults, lowest, highest);
    printf("median %.2f us, 99.9 %% within %.2f us, longest %.1f us; in one call %.2f us a step\n",
           took[n / 2], took[(long)((double)(n - 1) * 0.999)], took[n - 1], in_loop);
    for (double edge = took[0], k = 0.0; k < (double)n; edge *= 1.5) {
        const double before = k;
        while (k < (double)n && took[(long)k] <= 1.5 * edge) k += 1.0;
        printf("%10.1f to %8.1f us %10.0f\n", edge, 1.5 * edge, k - before);
    }
    free(start);
    free(took);
    catenary_close(line);
    return 0;
}
