"""Two models beside each other: numbers that can be worked out by hand."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from experiments.designs import Design
from experiments.runs import Runs, Status
from surrogates.comparison import aligned, common_box, compare_models
from tests.surrogates.cases import box, surrogate

SPACE = box(("a", -1.0, 1.0), ("b", 0.0, 4.0))
OURS = surrogate(SPACE, ["1", "a", "b"], [[1.0, 2.0, 0.01], [0.0, 0.0, 3.0]], ["m", "rad"])
POINTS = np.array([[-1.0, 0.0], [1.0, 0.0], [0.5, 4.0], [0.0, 2.0]])


def runs_of(values, status=None, space=SPACE, points=POINTS):
    status = status or [Status.OK] * len(points)
    reasons = tuple("" if s is Status.OK else "why" for s in status)
    return Runs(Design.from_physical(space, points), OURS.responses, np.asarray(values), tuple(status), reasons)


def test_a_model_beside_itself_is_not_apart():
    found = compare_models(OURS, OURS, runs_of(OURS.predict(POINTS)))
    assert found.is_whole
    assert (found.n_runs, found.n_outside) == (4, 0)
    for part in (found.apart, found.ours, found.theirs):
        assert [(d.largest, d.rms, d.relative, d.relative_rms) for d in part] == [(0.0,) * 4] * 2
    assert not found.map_difference.any()


def test_differences_by_hand():
    """The second model adds 0.1 a to the first response; the runs lie 0.2 above ours, all but the last."""
    theirs = surrogate(SPACE, ["1", "a", "b"], [[1.0, 2.1, 0.01], [0.0, 0.0, 3.0]], ["m", "rad"])
    truth = OURS.predict(POINTS) + np.array([[0.2, 0.0], [0.2, 0.0], [0.2, 0.0], [0.0, 0.0]])
    found = compare_models(OURS, theirs, runs_of(truth))
    spread = np.ptp(truth[:, 0])
    assert_allclose(found.ranges, np.ptp(truth, axis=0))
    apart, ours, them = found.apart[0], found.ours[0], found.theirs[0]
    assert_allclose([apart.largest, apart.rms], [0.1, np.sqrt(np.mean([0.01, 0.01, 0.0025, 0.0]))])
    assert_allclose([apart.relative, apart.relative_rms], [apart.largest / spread, apart.rms / spread])
    assert apart.at in [(-1.0, 0.0), (1.0, 0.0)]
    assert_allclose([ours.largest, ours.rms], [0.2, np.sqrt(0.03)])
    assert_allclose(them.largest, 0.3)  # at a = −1, where 0.1 is taken away from what is 0.2 too low already
    assert them.at == (-1.0, 0.0)
    assert found.apart[1].largest == 0.0


def test_the_maps_entry_by_entry():
    """In coded units our first row is 2 and 0.01: half a per cent of its largest is taken for none."""
    theirs = surrogate(SPACE, ["1", "a", "b"], [[1.0, 2.1, 0.03], [0.0, 0.5, 2.7]], ["m", "rad"])
    found = compare_models(OURS, theirs, runs_of(OURS.predict(POINTS)))
    assert_allclose(found.our_map, [[2.0, 0.005], [0.0, 1.5]])
    assert_allclose(found.their_map, [[2.1, 0.015], [0.5, 1.35]])
    assert found.acts.tolist() == [[True, False], [False, True]]
    assert_allclose(found.map_difference, [[0.05, 0.02 / 2.1], [0.5 / 3.0, -0.1]])


def test_a_row_of_zeros_has_no_difference():
    still = surrogate(SPACE, ["1", "a"], [[1.0, 0.0], [2.0, 1.0]], ["m", "rad"])
    found = compare_models(still, still, runs_of(still.predict(POINTS)))
    assert not found.acts[0].any()
    assert found.map_difference.tolist() == [[0.0, 0.0], [0.0, 0.0]]


def test_runs_without_an_answer_are_left_out():
    truth = OURS.predict(POINTS)
    truth[1] = np.nan
    found = compare_models(OURS, OURS, runs_of(truth, [Status.OK, Status.CRASHED, Status.OK, Status.OK]))
    assert found.n_runs == 3
    nothing = compare_models(OURS, OURS, runs_of(np.full((4, 2), np.nan), [Status.CRASHED] * 4))
    assert nothing.n_runs == nothing.n_outside == 0
    assert nothing.apart == nothing.ours == nothing.theirs == ()
    assert np.isnan(nothing.ranges).all()


def test_the_common_box_and_the_runs_in_it():
    narrow = box(("a", -0.6, 3.0), ("b", 1.0, 9.0))
    theirs = surrogate(narrow, ["1", "a", "b"], [[2.0, 3.0, 1.0], [0.0, 1.0, 1.0]], ["m", "rad"])
    found = compare_models(OURS, theirs, runs_of(OURS.predict(POINTS)))
    assert not found.is_whole
    assert [(f.low, f.high) for f in found.box] == [(-0.6, 1.0), (1.0, 4.0)]
    assert (found.n_runs, found.n_outside) == (2, 2)
    inside = POINTS[[2, 3]]
    assert_allclose(found.apart[0].largest, np.abs(theirs.predict(inside) - OURS.predict(inside))[:, 0].max())
    # Of a curved model the derivative is that of the middle of the box: here a = 0.2.
    bent = surrogate(SPACE, ["1", "a^2", "b"], [[1.0, 2.0, 0.01], [0.0, 0.0, 3.0]], ["m", "rad"])
    assert_allclose(compare_models(bent, theirs, runs_of(OURS.predict(POINTS))).our_map[0, 0], 2.0 * 2.0 * 0.2)


def test_the_order_of_names_does_not_matter():
    swapped = box(("b", 0.0, 4.0), ("a", -1.0, 1.0))
    theirs = surrogate(swapped, ["1", "a", "b", "a:b^2"], [[0, 1, 2, 3], [4, 5, 6, 7]], ["rad", "m"])
    by_name = aligned(theirs, SPACE, tuple(reversed(theirs.responses)))
    assert by_name.factors.names == ("a", "b")
    assert_allclose(by_name.predict(POINTS), theirs.predict(POINTS[:, ::-1])[:, ::-1])
    assert_allclose(by_name.jacobian(POINTS), theirs.jacobian(POINTS[:, ::-1])[:, ::-1, ::-1])


def test_others_are_refused():
    other = surrogate(box(("a", -1.0, 1.0), ("c", 0.0, 4.0)), ["1", "a"], [[1.0, 2.0], [0.0, 1.0]], ["m", "rad"])
    with pytest.raises(ValueError, match=r"it has the factors a \[N\], c \[N\], the study has a \[N\], b \[N\]"):
        compare_models(OURS, other, runs_of(OURS.predict(POINTS)))
    units = surrogate(SPACE, ["1", "a"], [[1.0, 2.0], [0.0, 1.0]], ["m", "m"])
    with pytest.raises(
        ValueError, match=r"it has the responses r0 \[m\], r1 \[m\], the study has r0 \[m\], r1 \[rad\]"
    ):
        compare_models(OURS, units, runs_of(OURS.predict(POINTS)))
    with pytest.raises(ValueError, match=r"its range of b is 4 to 5 N, that of the study 0 to 4: .* nothing in common"):
        common_box(SPACE, box(("a", -1.0, 1.0), ("b", 4.0, 5.0)))


def test_the_example_of_the_page():
    """A deflection goes with 1/E, so that the softer cantilever's map is larger by the ratio of the moduli."""
    page = (Path(__file__).parents[2] / "docs" / "compare.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names = {}
    exec(compile(code, "docs/compare.md", "exec"), names)
    found = names["found"]
    assert found.acts.sum() >= 7
    assert_allclose(found.map_difference[found.acts], 71.7 / 69.0 - 1.0, rtol=1e-3)
    assert found.theirs[0].largest > found.ours[0].largest
