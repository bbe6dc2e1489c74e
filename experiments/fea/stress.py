"""Stresses from the internal forces of members.

Navier's linear stress, which an arc has too where it is thick by little beside its radius; shear is
left out. Written once for NumPy and for JAX, whichever module is handed in, as :mod:`.shapes` is.

Source: Young & Budynas, Roark's Formulas for Stress and Strain, 7th ed. (2002), eq. 8.1-1, in both principal planes.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from .arrays import FrameArrays
from .assembly import member_shapes
from .elements import along
from .model import Member
from .precision import in_float64

N_ALONG = 129
"""Sections at which the stress of an arc is sampled; a peak between two is missed by at most (bend/128)²/8 of it."""


class Fibres(NamedTuple):
    """What a stress asks of a section; numbers, or arrays that broadcast with those of the members; SI."""

    area: Any
    second_moment_y: Any
    second_moment_z: Any
    extreme_y: Any
    extreme_z: Any
    is_round: Any


class PeakStress(NamedTuple):
    """The largest bending stress of each member.

    Parameters
    ----------
    bending : ndarray, shape (n_cases, n_members)
        Pa; NaN where the outermost fibres are unknown.
    place : ndarray, shape (n_cases, n_members)
        Where along the member, from 0 at its start to 1 at its end; of a straight member one of these.
    """

    bending: NDArray[np.float64]
    place: NDArray[np.float64]


def fibres(members: Iterable[Member]) -> Fibres:
    """The sections of members as arrays of shape (n_members, 1)."""
    columns = zip(*([getattr(m.section, name) for name in Fibres._fields] for m in members), strict=True)
    return Fibres(*(np.array(column)[:, None] for column in columns))


def bending_stress(xp: Any, internal: Any, section: Fibres) -> Any:
    """Largest bending stress of each section, Pa, never negative.

    At the corner of a rectangle the stresses of both planes add; on a circle the moments do, as vectors.

    Parameters
    ----------
    xp : module
        ``numpy`` or ``jax.numpy``.
    internal : array, shape (6, ...)
        N, V_y, V_z, T, M_y, M_z in the axes of the section, N and N m.
    section : Fibres
        Broadcasts with the shape (...); an extreme that is NaN gives NaN.
    """
    by_y = abs(internal[4]) * section.extreme_z / section.second_moment_y
    by_z = abs(internal[5]) * section.extreme_y / section.second_moment_z
    # Where it is not taken the root is kept off zero, at which it has no derivative.
    root = xp.hypot(xp.where(section.is_round, by_y, 1.0), xp.where(section.is_round, by_z, 1.0))
    return xp.where(section.is_round, root, by_y + by_z)


def normal_stress(xp: Any, internal: Any, section: Fibres) -> Any:
    """Largest size of the normal stress, |N|/A and the bending stress, Pa; arguments as :func:`bending_stress`."""
    return abs(internal[0]) / section.area + bending_stress(xp, internal, section)


def internal_forces(
    arrays: FrameArrays, end_forces: NDArray[np.float64], s: NDArray[np.float64]
) -> NDArray[np.float64]:
    """What the part beyond a section exerts on it, in the axes of the section.

    Parameters
    ----------
    arrays : FrameArrays
    end_forces : ndarray, shape (n_cases, n_members, 2, 6)
    s : ndarray, shape (n_members, n_points)
        Fractions of each member's length.

    Returns
    -------
    ndarray, shape (6, n_cases, n_members, n_points)
        N, V_y, V_z in N; T, M_y, M_z in N m.
    """
    place, turn = map(np.asarray, _sections(member_shapes(arrays), s))
    force, moment = -end_forces[:, :, 0, :3], -end_forces[:, :, 0, 3:]
    moved = moment[:, :, None] - np.cross(place, force[:, :, None])
    both = np.stack([np.broadcast_to(force[:, :, None], moved.shape), moved])
    return np.einsum("mpji,fcmpj->ficmp", turn, both).reshape(6, *moved.shape[:-1])


@in_float64
def peak_stress(members: Iterable[Member], arrays: FrameArrays, end_forces: NDArray[np.float64]) -> PeakStress:
    """Largest bending stress along each member; the moment of a straight one is linear, so an end has it."""
    curved = arrays.is_curved
    s = np.tile(np.linspace(0.0, 1.0, N_ALONG if curved.any() else 2), (len(curved), 1))
    s[~curved] = s[~curved] > 0.5
    stress = bending_stress(np, internal_forces(arrays, end_forces, s), fibres(members))
    peak = stress.max(axis=-1)
    where = s[np.arange(len(curved)), stress.argmax(axis=-1)]
    return PeakStress(peak, np.where(np.isnan(peak), np.nan, where))


_sections = jax.jit(jax.vmap(jax.vmap(along, in_axes=(None, 0)), in_axes=(-1, 0)))
