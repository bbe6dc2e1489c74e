/* How long one call of the exported inverse takes, by the monotonic clock.
 * Compiled together with the export; STAGE_INVERSE is the name of its inverse. */
#define _POSIX_C_SOURCE 199309L
#include <time.h>

int STAGE_INVERSE(const double responses[6], double settings[6]);

static double between(const struct timespec *begin, const struct timespec *end) {
    return 1e9 * (double)(end->tv_sec - begin->tv_sec) + (double)(end->tv_nsec - begin->tv_nsec);
}

/* Nanoseconds of each call, repeats x n, and of as many readings of the clock with nothing between them.
 * All poses go by before the first comes again. Returns how many calls were refused. */
int time_inverse(const double *poses, int n, int repeats, double *nanoseconds, double *empty) {
    struct timespec begin, end;
    double settings[6];
    int refused = 0;
    for (int i = 0; i < repeats * n; ++i) {
        clock_gettime(CLOCK_MONOTONIC, &begin);
        int status = STAGE_INVERSE(poses + 6 * (i % n), settings);
        clock_gettime(CLOCK_MONOTONIC, &end);
        nanoseconds[i] = between(&begin, &end);
        refused += status != 0;
        clock_gettime(CLOCK_MONOTONIC, &begin);
        clock_gettime(CLOCK_MONOTONIC, &end);
        empty[i] = between(&begin, &end);
    }
    return refused;
}
