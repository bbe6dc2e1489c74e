"""Many geometries at once, beside one frame after the other."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from numpy.testing import assert_allclose

from experiments import oracles
from experiments.fea import Frame, Load, Material, Member, RigidBody, Support, circle, factorise, load_array, rectangle
from experiments.fea.arrays import frame_arrays
from experiments.fea.scaling import geometry
from experiments.fea.varying import linear_displacements


def stacked(frames):
    return jax.tree.map(lambda *parts: np.concatenate(parts, axis=-1), *(geometry(frame_arrays(f)) for f in frames))


def one_by_one(frames, loads, nodes):
    return np.stack([np.stack([factorise(f).solve(loads).at(n) for n in nodes], 1) for f in frames])


def hexflex(rng):
    sizes = {name: rng.uniform(0.8, 1.2) for name in ("length_1", "length_2", "width", "thickness", "load_radius")}
    oracle = oracles.get("hexflex")
    return replace(oracle, **{name: getattr(oracle, name) * by for name, by in sizes.items()}).frame


def arch(rng):
    """An arc and a shear-flexible strut, off every axis, on a lever that a support lets turn."""
    about = np.array([[0, 0, 0], [0.1, 0.02, 0.03], [0.12, 0.05, 0.0], [0.2, -0.02, 0.04]])
    a, b, c, d = about + rng.uniform(-0.01, 0.01, (4, 3))
    nodes = {name: tuple(place.tolist()) for name, place in zip("abcd", (a, b, c, d), strict=True)}
    round_one, flat = circle(rng.uniform(0.002, 0.004)), rectangle(0.01, rng.uniform(0.001, 0.002))
    material = Material(rng.uniform(60e9, 80e9), 0.33)
    members = [
        Member("arc", "a", "b", flat, material, through=tuple(((a + b) / 2 + [0.0, 0.0, 0.03]).tolist())),
        Member("strut", "d", "c", round_one, material, up=(0.0, 1.0, 0.2)),
    ]
    return Frame(nodes, members, [RigidBody("lever", "b", ("c",))], ["a"], [Support("d", ("x", "y", "z"))])


@pytest.mark.parametrize("build", [hexflex, arch])
def test_agrees_with_one_frame_after_the_other(build):
    """Straight members and arcs, rigid bodies and supports, several loads, more geometries than fit in one chunk."""
    rng = np.random.default_rng(1)
    frames = [build(rng) for _ in range(20)]
    nodes = ("centroid", "T2") if build is hexflex else ("b", "c", "d")
    loads = load_array(
        frames[0], [[Load(n, tuple(rng.uniform(-1, 1, 3)), tuple(rng.uniform(-1, 1, 3)))] for n in nodes]
    )
    expected = one_by_one(frames, loads, nodes)
    rows = np.arange(300) % 20
    many = jax.tree.map(lambda part: part[..., rows], stacked(frames))
    found = linear_displacements(frames[0], loads, many, nodes)
    assert found.shape == (300, len(loads), len(nodes), 6)
    size = np.abs(expected).max(axis=(0, 1, 2))
    assert_allclose(found / size, expected[rows] / size, rtol=0, atol=1e-9)


def test_what_does_not_vary_may_be_given_once():
    frame = hexflex(np.random.default_rng(2))
    loads = load_array(frame, [[Load("T1", (0.0, 0.0, 1.0))]])
    found = linear_displacements(frame, loads, geometry(frame_arrays(frame)), ("centroid",))
    assert_allclose(found[0, 0, 0], factorise(frame).solve(loads).at("centroid")[0], rtol=1e-9, atol=1e-15)


def test_errors():
    frame = hexflex(np.random.default_rng(2))
    loads, own = load_array(frame, [[Load("T1", (0.0, 0.0, 1.0))]]), geometry(frame_arrays(frame))
    with pytest.raises(ValueError, match="unknown node 'T9'"):
        linear_displacements(frame, loads, own, ("T9",))
    with pytest.raises(ValueError, match="loads"):
        linear_displacements(frame, loads[..., :3], own, ("T1",))
