/* Restores states of a line with one byte changed each, and one of another line: writes how many
 * were refused, and the time after each kind. */
#include <stdio.h>
#include <stdlib.h>

#include "catenary.h"

int main(int argc, char** argv) {
    char error[512];
    if (argc != 3) return 2;
    catenary_simulation* line = catenary_open(argv[1], error, sizeof error);
    catenary_simulation* other = catenary_open(argv[2], error, sizeof error);
    if (!line || !other) return 2;
    const size_t n = catenary_state_size(line);
    if (catenary_state_size(other) != n) return 3; /* states of both must be as long */
    unsigned char* state = malloc(n);
    catenary_step(line, 10);
    catenary_save(line, state);
    catenary_step(line, 10);
    long refused = 0, tried = 0;
    for (size_t at = 0; at < n; at += 1 + n / 101, ++tried) {
        state[at] ^= 0x40;
        refused += catenary_restore(line, state) != 0;
        state[at] ^= 0x40;
    }
    state[n - 1] ^= 1;
    refused += catenary_restore(line, state) != 0;
    state[n - 1] ^= 1;
    const int of_other = catenary_restore(other, state);
    const double stays = catenary_time(line);
    const int whole = catenary_restore(line, state);
    printf("%ld %d %d %.3f %.3f\n", tried + 1 - refused, of_other != 0, whole, stays,
           catenary_time(line));
    free(state);
    catenary_close(line);
    catenary_close(other);
    return 0;
}
