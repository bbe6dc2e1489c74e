"""The fixed text of the C99 export's Jacobian and search for each kind of model, and the inverse that ends both."""

AFFINE_JACOBIAN = """
int ${p}_jacobian(const double settings[${P}_N_FACTORS],
    double jacobian[${P}_N_RESPONSES][${P}_N_FACTORS])
{
    const int status = ${p}_inside(settings);

    if (status == ${P}_NOT_FINITE) {
        return status;
    }
$slope
    return status;
}
"""

AFFINE_SEARCH = """
/* As the inverse, but writes what it tried whatever the status. */
static int ${p}_search(const double responses[${P}_N_RESPONSES], double settings[${P}_N_FACTORS])
{
$moves    for (int i = 0; i < ${P}_N_RESPONSES; ++i) {
        if (!isfinite(responses[i])) {
            return ${P}_NOT_FINITE;
        }
    }
$inverse
    return ${p}_check(responses, settings);
}
"""

POLYNOMIAL_JACOBIAN = """
/* d $value / d coded setting at coded settings. */
static void ${p}_slope(const double coded[${P}_N_FACTORS],
    double slope[${P}_N_RESPONSES][${P}_N_FACTORS])
{
$derivatives
}

int ${p}_jacobian(const double settings[${P}_N_FACTORS],
    double jacobian[${P}_N_RESPONSES][${P}_N_FACTORS])
{
    static const double half[${P}_N_FACTORS] = {$half};
    double coded[${P}_N_FACTORS];$values_here
    const int status = ${p}_code(settings, coded);

    if (status == ${P}_NOT_FINITE) {
        return status;
    }
    ${p}_slope(coded, jacobian);$values_too
    for (int i = 0; i < ${P}_N_RESPONSES; ++i) {
        for (int j = 0; j < ${P}_N_FACTORS; ++j) {
            jacobian[i][j] /= half[j];
        }
    }$chained
    return status;
}
"""

POLYNOMIAL_SEARCH = """
/*
 * The shortest step with slope * step = miss, by Gram-Schmidt on the rows, the longest first.
 * Rows that depend on those before them are left out. Overwrites slope and miss.
 */
static void ${p}_least_norm(double slope[${P}_N_RESPONSES][${P}_N_FACTORS],
    double miss[${P}_N_RESPONSES], double step[${P}_N_FACTORS])
{
    int done[${P}_N_RESPONSES] = {0};
    double longest = 0.0;

    for (int j = 0; j < ${P}_N_FACTORS; ++j) {
        step[j] = 0.0;
    }
    for (int k = 0; k < $rank; ++k) {
        int row = -1;
        double square = 0.0;

        for (int i = 0; i < ${P}_N_RESPONSES; ++i) {
            double sum = 0.0;
            for (int j = 0; j < ${P}_N_FACTORS; ++j) {
                sum += slope[i][j] * slope[i][j];
            }
            if (!done[i] && sum > square) {
                row = i;
                square = sum;
            }
        }
        longest = k == 0 ? square : longest;
        if (row < 0 || square <= 1e-24 * longest) {
            return;
        }
        done[row] = 1;
        for (int j = 0; j < ${P}_N_FACTORS; ++j) {
            step[j] += miss[row] / square * slope[row][j];
        }
        for (int i = 0; i < ${P}_N_RESPONSES; ++i) {
            double along = 0.0;
            for (int j = 0; j < ${P}_N_FACTORS; ++j) {
                along += slope[i][j] * slope[row][j] / square;
            }
            if (!done[i]) {
                miss[i] -= along * miss[row];
                for (int j = 0; j < ${P}_N_FACTORS; ++j) {
                    slope[i][j] -= along * slope[row][j];
                }
            }
        }
    }
}

/* As the inverse, but writes what it tried whatever the status. */
static int ${p}_search(const double responses[${P}_N_RESPONSES], double settings[${P}_N_FACTORS])
{
    static const double scale[${P}_N_RESPONSES] = {$scale};
    double coded[${P}_N_FACTORS] = {0.0};
    double miss[${P}_N_RESPONSES];
    double slope[${P}_N_RESPONSES][${P}_N_FACTORS];
    double step[${P}_N_FACTORS];
    int converged = 0;
    int status;

    for (int i = 0; i < ${P}_N_RESPONSES; ++i) {
        if (!isfinite(responses[i])) {
            return ${P}_NOT_FINITE;
        }
    }
    for (int k = 0; k < $steps && !converged; ++k) {
        /* The first step stays in the domain, the others near it: far outside the polynomials mean nothing. */
        const double limit = k == 0 ? 1.0 : 2.0;

        ${p}_evaluate(coded, miss);
        ${p}_slope(coded, slope);
        for (int i = 0; i < ${P}_N_RESPONSES; ++i) {
            miss[i] = (responses[i] - miss[i]) / scale[i];
            for (int j = 0; j < ${P}_N_FACTORS; ++j) {
                slope[i][j] /= scale[i];
            }
        }
        ${p}_least_norm(slope, miss, step);
        converged = 1;
        for (int j = 0; j < ${P}_N_FACTORS; ++j) {
            const double wanted = coded[j] + step[j];
            coded[j] = wanted > limit ? limit : wanted > -limit ? wanted : -limit;
            if (!(fabs(step[j]) < $still)) {
                converged = 0;
            }
        }
    }
$decoding
    status = ${p}_check(responses, settings);
    return status == ${P}_OK || converged ? status : ${P}_NOT_CONVERGED;
}
"""

INVERSE = """
int ${p}_inverse(const double responses[${P}_N_RESPONSES], double settings[${P}_N_FACTORS])
{
    double found[${P}_N_FACTORS] = {0.0};
    const int status = ${p}_search(responses, found);

    if (status == ${P}_OK) {
        for (int j = 0; j < ${P}_N_FACTORS; ++j) {
            settings[j] = found[j];
        }
    }
    return status;
}
"""

INVERSE_WITH_LOGARITHMS = """
int ${p}_inverse(const double responses[${P}_N_RESPONSES], double settings[${P}_N_FACTORS])
{
    double found[${P}_N_FACTORS] = {0.0};
    double wanted[${P}_N_RESPONSES];
    int status;

    for (int i = 0; i < ${P}_N_RESPONSES; ++i) {
        if (!isfinite(responses[i])) {
            return ${P}_NOT_FINITE;
        }
        wanted[i] = responses[i];
    }
$logarithms
    status = ${p}_search(wanted, found);
    if (status == ${P}_OK) {
        for (int j = 0; j < ${P}_N_FACTORS; ++j) {
            settings[j] = found[j];
        }
    }
    return status;
}
"""
