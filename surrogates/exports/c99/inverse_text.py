"""The fixed text of the C99 export's inverse, one search for each kind of plan, and the function that ends all."""

CHECK = """
/* Whether settings, rounding beyond the ranges taken off, answer for the responses$in_link_units. */
static int ${p}_check(const $real responses[${P}_N_RESPONSES], $real settings[${P}_N_FACTORS])
{
    static const $real low[${P}_N_FACTORS] = {$low};
    static const $real high[${P}_N_FACTORS] = {$high};
    static const $real tolerance[${P}_N_RESPONSES] = {$tolerance};
    $real coded[${P}_N_FACTORS];
    $real reached[${P}_N_RESPONSES];

    if (${p}_code(settings, coded) != ${P}_OK) {
        return ${P}_OUTSIDE_DOMAIN;
    }
    for (int j = 0; j < ${P}_N_FACTORS; ++j) {
        settings[j] = settings[j] < low[j] ? low[j] : settings[j] > high[j] ? high[j] : settings[j];
    }
    (void)${p}_code(settings, coded);
    ${p}_value(coded, reached);
    for (int i = 0; i < ${P}_N_RESPONSES; ++i) {
        const $real miss = reached[i] - responses[i];
        if (!(miss <= tolerance[i] && miss >= -tolerance[i])) {
            return ${P}_UNREACHABLE;
        }
    }
    return ${P}_OK;
}
"""

CENTRE_STEP = """
/* The step of constant slope from the centre of the domain to the responses$in_link_units, in coded units. */
static void ${p}_first(const $real responses[${P}_N_RESPONSES], $real moves[${P}_N_FACTORS])
{
$moves
}
"""

CLOSED_SEARCH = """
/* As the inverse, but writes what it tried whatever the status. */
static int ${p}_search(const $real responses[${P}_N_RESPONSES], $real settings[${P}_N_FACTORS])
{
    $real coded[${P}_N_FACTORS];

    ${p}_first(responses, coded);
$decoding
    return ${p}_check(responses, settings);
}
"""

CONTRACTING_SEARCH = """
/*
 * What the constant slope's inverse makes of the responses' change from the centre, and its slope. The
 * certificate says that this slope is near the identity everywhere in the domain.
 */
static void ${p}_moved(const $real coded[${P}_N_FACTORS], $real value[${P}_N_FACTORS],
    $real slope[${P}_N_FACTORS][${P}_N_FACTORS])
{
$moved
}

/* Overwrites slope with its factors. A slope near the identity needs no pivoting. */
static void ${p}_factor($real slope[${P}_N_FACTORS][${P}_N_FACTORS])
{
$factor
}

/* Overwrites miss with the step for which slope * step = miss; slope as ${p}_factor left it. */
static void ${p}_substitute($real slope[${P}_N_FACTORS][${P}_N_FACTORS], $real miss[${P}_N_FACTORS])
{
$substitute
}

/* As the inverse, but writes what it tried whatever the status. */
static int ${p}_search(const $real responses[${P}_N_RESPONSES], $real settings[${P}_N_FACTORS])
{
    $real wanted[${P}_N_FACTORS];
    $real coded[${P}_N_FACTORS];
    $real step[${P}_N_FACTORS];
    $real slope[${P}_N_FACTORS][${P}_N_FACTORS];
    int moving = 1;
    int status;

    ${p}_first(responses, wanted);
    for (int j = 0; j < ${P}_N_FACTORS; ++j) {
        coded[j] = ${p}_within(wanted[j], $limit);
    }
    for (int k = 0; k < $steps && moving; ++k) {
        int near = 1;

        ${p}_moved(coded, step, slope);
        for (int j = 0; j < ${P}_N_FACTORS; ++j) {
            step[j] = wanted[j] - step[j];
        }
        ${p}_factor(slope);
        ${p}_substitute(slope, step);
        for (int j = 0; j < ${P}_N_FACTORS; ++j) {
            coded[j] = ${p}_within(coded[j] + step[j], $limit);
            near &= step[j] < $near && step[j] > -$near;
        }
        if (near) {
            /* One more step with the same slope: its error is the product of this one's and the last one's. */
            ${p}_moved_to(coded, step);
            for (int j = 0; j < ${P}_N_FACTORS; ++j) {
                step[j] = wanted[j] - step[j];
            }
            ${p}_substitute(slope, step);
            moving = 0;
            for (int j = 0; j < ${P}_N_FACTORS; ++j) {
                coded[j] = ${p}_within(coded[j] + step[j], $limit);
                moving |= !(step[j] < $still && step[j] > -$still);
            }
        }
    }$chords
$decoding
    status = ${p}_check(responses, settings);
    return status == ${P}_OK || !moving ? status : ${P}_NOT_CONVERGED;
}
"""

FACTOR = """\
    for (int k = 0; k < ${P}_N_FACTORS; ++k) {
        slope[k][k] = $one / slope[k][k];
        for (int i = k + 1; i < ${P}_N_FACTORS; ++i) {
            slope[i][k] *= slope[k][k];
            for (int j = k + 1; j < ${P}_N_FACTORS; ++j) {
                slope[i][j] -= slope[i][k] * slope[k][j];
            }
        }
    }"""

SUBSTITUTE = """\
    for (int i = 0; i < ${P}_N_FACTORS; ++i) {
        for (int j = 0; j < i; ++j) {
            miss[i] -= slope[i][j] * miss[j];
        }
    }
    for (int i = ${P}_N_FACTORS - 1; i >= 0; --i) {
        for (int j = i + 1; j < ${P}_N_FACTORS; ++j) {
            miss[i] -= slope[i][j] * miss[j];
        }
        miss[i] *= slope[i][i];
    }"""

CHORDS = """
    if (moving) {
        /* Rare: the certificate promises no convergence of Newton's steps, but of these. */
        for (int j = 0; j < ${P}_N_FACTORS; ++j) {
            coded[j] = ${p}_within(wanted[j], $limit);
        }
        for (int k = 0; k < $count; ++k) {
            ${p}_moved_to(coded, step);
            for (int j = 0; j < ${P}_N_FACTORS; ++j) {
                coded[j] = ${p}_within(coded[j] + (wanted[j] - step[j]), $limit);
            }
        }
    }"""

MOVED_TO = """
/* What ${p}_moved gives, without the slope. */
static void ${p}_moved_to(const $real coded[${P}_N_FACTORS], $real value[${P}_N_FACTORS])
{
$moved_to
}
"""

WITHIN = """
/* The value, moved into [-limit, limit]. */
static $real ${p}_within($real value, $real limit)
{
    return value > limit ? limit : value > -limit ? value : -limit;
}
"""

FREE_SEARCH = """
/*
 * The shortest step with slope * step = miss, by Gram-Schmidt on the rows, the longest first.
 * Rows that depend on those before them are left out. Overwrites slope and miss.
 */
static void ${p}_least_norm($real slope[${P}_N_RESPONSES][${P}_N_FACTORS],
    $real miss[${P}_N_RESPONSES], $real step[${P}_N_FACTORS])
{
    int done[${P}_N_RESPONSES] = {0};
    $real least = $zero;

    for (int j = 0; j < ${P}_N_FACTORS; ++j) {
        step[j] = $zero;
    }
    for (int k = 0; k < $rank; ++k) {
        int row = -1;
        $real square = $zero;

        for (int i = 0; i < ${P}_N_RESPONSES; ++i) {
            $real sum = $zero;
            for (int j = 0; j < ${P}_N_FACTORS; ++j) {
                sum += slope[i][j] * slope[i][j];
            }
            if (!done[i] && sum > square) {
                row = i;
                square = sum;
            }
        }
        if (row < 0 || square <= least) {
            return;
        }
        if (k == 0) {
            least = $dependent * square;
        }
        done[row] = 1;
        square = $one / square;
        for (int j = 0; j < ${P}_N_FACTORS; ++j) {
            step[j] += miss[row] * square * slope[row][j];
        }
        for (int i = 0; i < ${P}_N_RESPONSES; ++i) {
            $real along = $zero;
            for (int j = 0; j < ${P}_N_FACTORS; ++j) {
                along += slope[i][j] * slope[row][j];
            }
            along *= square;
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
static int ${p}_search(const $real responses[${P}_N_RESPONSES], $real settings[${P}_N_FACTORS])
{
    static const $real per_scale[${P}_N_RESPONSES] = {$per_scale};
    $real coded[${P}_N_FACTORS];
    $real miss[${P}_N_RESPONSES];
    $real slope[${P}_N_RESPONSES][${P}_N_FACTORS];
    $real step[${P}_N_FACTORS];
    int moving = 1;
    int status;

    /* The first step stays in the domain, the others near it: far outside the polynomials mean nothing. */
    ${p}_first(responses, coded);
    for (int j = 0; j < ${P}_N_FACTORS; ++j) {
        coded[j] = ${p}_within(coded[j], $one);
    }
    for (int k = 0; k < $steps && moving; ++k) {
        ${p}_gradient(coded, miss, slope);
        for (int i = 0; i < ${P}_N_RESPONSES; ++i) {
            miss[i] = (responses[i] - miss[i]) * per_scale[i];
            for (int j = 0; j < ${P}_N_FACTORS; ++j) {
                slope[i][j] *= per_scale[i];
            }
        }
        ${p}_least_norm(slope, miss, step);
        moving = 0;
        for (int j = 0; j < ${P}_N_FACTORS; ++j) {
            coded[j] = ${p}_within(coded[j] + step[j], $limit);
            moving |= !(step[j] < $still && step[j] > -$still);
        }
    }
$decoding
    status = ${p}_check(responses, settings);
    return status == ${P}_OK || !moving ? status : ${P}_NOT_CONVERGED;
}
"""

INVERSE = """
int ${p}_inverse(const $real responses[${P}_N_RESPONSES], $real settings[${P}_N_FACTORS])
{
    $real found[${P}_N_FACTORS] = {$zero};$wanted_here
    int status;

    for (int i = 0; i < ${P}_N_RESPONSES; ++i) {
        if (!${p}_finite(responses[i])) {
            return ${P}_NOT_FINITE;
        }$wanted_too
    }$logarithms
    status = ${p}_search($wanted, found);
    if (status == ${P}_OK) {
        for (int j = 0; j < ${P}_N_FACTORS; ++j) {
            settings[j] = found[j];
        }
    }
    return status;
}
"""
