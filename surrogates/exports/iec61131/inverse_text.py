"""The fixed text of the IEC 61131-3 export's inverse: one search for each kind of plan, see :class:`.InversePlan`."""

BEGIN = """
(* Settings that give the responses. *)
FUNCTION_BLOCK ${p}_inverse
VAR_INPUT
    responses : ARRAY [0..$m1] OF LREAL;
END_VAR
VAR_OUTPUT
    settings : ARRAY [0..$n1] OF LREAL;
    status : INT;
END_VAR
VAR
    domain : ${p}_inside;
    polynomials : ${p}_value;$blocks
END_VAR
VAR CONSTANT
$constants
END_VAR
VAR_TEMP
    i, j$counters : INT;
    wanted : ARRAY [0..$m1] OF LREAL;
    coded, found : ARRAY [0..$n1] OF LREAL;$temporaries
END_VAR

FOR i := 0 TO $m1 DO
    IF NOT ((responses[i] >= -$largest) AND (responses[i] <= $largest)) THEN
        status := 4;
        RETURN;
    END_IF;
    wanted[i] := responses[i];
END_FOR;$logarithms
(* The step of constant slope from the centre of the domain. *)
FOR j := 0 TO $n1 DO
    coded[j] := 0.0;
    FOR i := 0 TO $m1 DO
        coded[j] := coded[j] + gain[j, i] * (wanted[i] - constant_part[i]);
    END_FOR;$first
END_FOR;
"""

CLIPPED_FIRST = """
    coded[j] := ${p}_within(coded[j], 1.0);"""

KEPT_FIRST = """
    first[j] := coded[j];"""

WITHIN = """
(* For the other blocks: the number, moved into [-bound, bound]. *)
FUNCTION ${p}_within : LREAL
VAR_INPUT
    number : LREAL;
    bound : LREAL;
END_VAR

IF number > bound THEN
    ${p}_within := bound;
ELSIF number > -bound THEN
    ${p}_within := number;
ELSE
    ${p}_within := -bound;
END_IF;
END_FUNCTION
"""

STEPS = """
moving := TRUE;
FOR k := 1 TO $steps DO
    slopes(coded := coded);
$one_step
    moving := FALSE;
    FOR j := 0 TO $n1 DO
        coded[j] := ${p}_within(coded[j] + newton.change[j], $limit);
        IF NOT ((newton.change[j] < $still) AND (newton.change[j] > -$still)) THEN
            moving := TRUE;
        END_IF;
    END_FOR;
    IF NOT moving THEN
        EXIT;
    END_IF;
END_FOR;
"""

CONTRACTING_STEP = """\
    (* What the gain makes of slope and mismatch: the certificate says that this slope is near the identity. *)
    FOR j := 0 TO $n1 DO
        rest[j] := 0.0;
        FOR i := 0 TO $m1 DO
            rest[j] := rest[j] + gain[j, i] * (wanted[i] - slopes.value[i]);
            rows[j, i] := 0.0;
            FOR via := 0 TO $m1 DO
                rows[j, i] := rows[j, i] + gain[j, via] * slopes.slope[via, i];
            END_FOR;
        END_FOR;
    END_FOR;
    newton(slope := rows, miss := rest);"""

FREE_STEP = """\
    FOR i := 0 TO $m1 DO
        rest[i] := (wanted[i] - slopes.value[i]) * per_scale[i];
        FOR j := 0 TO $n1 DO
            rows[i, j] := slopes.slope[i, j] * per_scale[i];
        END_FOR;
    END_FOR;
    newton(slope := rows, miss := rest);"""

CHORDS = """\
IF moving THEN
    (* Rare: the certificate promises no convergence of Newton steps, but of these. *)
    coded := first;
    FOR k := 1 TO $chords DO
        polynomials(coded := coded);
        FOR j := 0 TO $n1 DO
            rest[j] := coded[j];
            FOR i := 0 TO $m1 DO
                rest[j] := rest[j] + gain[j, i] * (wanted[i] - polynomials.value[i]);
            END_FOR;
        END_FOR;
        FOR j := 0 TO $n1 DO
            coded[j] := ${p}_within(rest[j], $limit);
        END_FOR;
    END_FOR;
END_IF;
"""

CHECK = """\
(* Whether they lie in the domain, and, rounding beyond the ranges taken off, give the responses. *)
FOR j := 0 TO $n1 DO
    found[j] := centre[j] + half[j] * coded[j];
END_FOR;
domain(settings := found);
IF domain.status <> 0 THEN
    status := 1;$not_moving
    RETURN;
END_IF;
FOR j := 0 TO $n1 DO
    IF found[j] < low[j] THEN
        found[j] := low[j];
    ELSIF found[j] > high[j] THEN
        found[j] := high[j];
    END_IF;
END_FOR;
domain(settings := found);
polynomials(coded := domain.coded);
FOR i := 0 TO $m1 DO
    IF NOT (ABS(polynomials.value[i] - wanted[i]) <= tolerance[i]) THEN
        status := 2;$not_moving_either
        RETURN;
    END_IF;
END_FOR;
settings := found;
status := 0;
END_FUNCTION_BLOCK
"""

NOT_MOVING = """
    IF moving THEN
        status := 3;
    END_IF;"""

SOLVE = """
(* For the inverse: the change for which slope * change = miss. A slope near the identity needs no pivoting. *)
FUNCTION_BLOCK ${p}_newton
VAR_INPUT
    slope : ARRAY [0..$n1, 0..$n1] OF LREAL;
    miss : ARRAY [0..$n1] OF LREAL;
END_VAR
VAR_OUTPUT
    change : ARRAY [0..$n1] OF LREAL;
END_VAR
VAR_TEMP
    i, j, k : INT;
    times : LREAL;
    rows : ARRAY [0..$n1, 0..$n1] OF LREAL;
END_VAR

rows := slope;
change := miss;
FOR k := 0 TO $n1 DO
    FOR i := k + 1 TO $n1 DO
        times := rows[i, k] / rows[k, k];
        FOR j := k + 1 TO $n1 DO
            rows[i, j] := rows[i, j] - times * rows[k, j];
        END_FOR;
        change[i] := change[i] - times * change[k];
    END_FOR;
END_FOR;
FOR k := $n1 TO 0 BY -1 DO
    FOR j := k + 1 TO $n1 DO
        change[k] := change[k] - rows[k, j] * change[j];
    END_FOR;
    change[k] := change[k] / rows[k, k];
END_FOR;
END_FUNCTION_BLOCK
"""

LEAST_NORM = """
(* For the inverse: the shortest change with slope * change = miss, by Gram-Schmidt on the rows, the longest first.
   Rows that depend on those before them are left out. *)
FUNCTION_BLOCK ${p}_newton
VAR_INPUT
    slope : ARRAY [0..$m1, 0..$n1] OF LREAL;
    miss : ARRAY [0..$m1] OF LREAL;
END_VAR
VAR_OUTPUT
    change : ARRAY [0..$n1] OF LREAL;
END_VAR
VAR_TEMP
    i, j, k, chosen : INT;
    along, square, longest, squared : LREAL;
    rows : ARRAY [0..$m1, 0..$n1] OF LREAL;
    rest : ARRAY [0..$m1] OF LREAL;
    done : ARRAY [0..$m1] OF BOOL;
END_VAR

rows := slope;
rest := miss;
longest := 0.0;
FOR i := 0 TO $m1 DO
    done[i] := FALSE;
END_FOR;
FOR j := 0 TO $n1 DO
    change[j] := 0.0;
END_FOR;
FOR k := 1 TO $rank DO
    chosen := -1;
    square := 0.0;
    FOR i := 0 TO $m1 DO
        squared := 0.0;
        FOR j := 0 TO $n1 DO
            squared := squared + rows[i, j] * rows[i, j];
        END_FOR;
        IF NOT done[i] AND (squared > square) THEN
            chosen := i;
            square := squared;
        END_IF;
    END_FOR;
    IF k = 1 THEN
        longest := square;
    END_IF;
    IF (chosen < 0) OR (square <= $dependent * longest) THEN
        RETURN;
    END_IF;
    done[chosen] := TRUE;
    FOR j := 0 TO $n1 DO
        change[j] := change[j] + rest[chosen] / square * rows[chosen, j];
    END_FOR;
    FOR i := 0 TO $m1 DO
        IF NOT done[i] THEN
            along := 0.0;
            FOR j := 0 TO $n1 DO
                along := along + rows[i, j] * rows[chosen, j] / square;
            END_FOR;
            rest[i] := rest[i] - along * rest[chosen];
            FOR j := 0 TO $n1 DO
                rows[i, j] := rows[i, j] - along * rows[chosen, j];
            END_FOR;
        END_IF;
    END_FOR;
END_FOR;
END_FUNCTION_BLOCK
"""

BLOCKS = """
    slopes : ${p}_gradient;
    newton : ${p}_newton;"""

COUNTERS = {True: ", via", False: ""}
"""What else is counted, by whether the plan is contracting."""

TEMPORARIES = """
    k : DINT;$kept
    rest : ARRAY [0..$r1] OF LREAL;
    rows : ARRAY [0..$r1, 0..$n1] OF LREAL;
    moving : BOOL;"""

KEPT = """
    first : ARRAY [0..$n1] OF LREAL;"""
