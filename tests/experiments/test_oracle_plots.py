"""How a mechanism is drawn: what is planar, and how far displacements may be multiplied."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from experiments import oracles
from experiments.oracles import Line, Shape
from experiments.oracles.plots import draw_shape, exaggeration, is_planar

BAR = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])


def turned(angle: float, rigid: bool) -> Shape:
    """A bar of length one, turned about its start in the plane."""
    end = np.array([np.cos(angle), np.sin(angle), 0.0])
    return Shape((Line("bar", BAR, np.array([[0.0, 0.0, 0.0], end - BAR[1]]), rigid),))


@pytest.mark.parametrize("angle", [1e-6, 1e-3, 0.02, 0.06, 0.2, 0.5, 1.5])
def test_what_is_rigid_keeps_its_length_in_a_drawing(angle):
    shape = turned(angle, rigid=True)
    factor = exaggeration(shape)
    assert np.linalg.norm(BAR[1] + factor * shape.lines[0].displacement[1]) < 1.15
    assert factor * angle < 0.6 or factor <= 1.0


@pytest.mark.parametrize(("move", "factor"), [(0.1, 2.0), (0.03, 5.0), (2.4e-6, 1e5), (0.25, 1.0), (0.0, 1.0)])
def test_what_bends_is_shown_at_a_quarter_of_the_size(move, factor):
    shape = Shape((Line("leaf", BAR, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, move]])),))
    assert exaggeration(shape) == pytest.approx(factor, rel=1e-12)


def test_planar_is_seen_from_above():
    flat, bent = turned(0.1, True), Shape((Line("leaf", BAR, BAR[:, [1, 2, 0]]),))
    assert is_planar(flat)
    assert not is_planar(bent)
    for shape, elevation in ((flat, 90.0), (bent, 30.0)):
        axes = draw_shape(Figure().add_subplot(projection="3d"), shape)
        assert axes.elev == elevation


def test_the_hexflex_is_not_planar():
    hexflex = oracles.get("hexflex")
    assert not is_planar(hexflex.shape(np.ones(6)))
    assert exaggeration(hexflex.shape(np.full(6, 1e-3))) > 1e3
