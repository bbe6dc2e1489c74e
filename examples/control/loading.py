"""The model that controls: read from a file or fitted first, and checked for what the example needs of it."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments import oracles
from experiments.oracles.hexflex import HexFlex
from pipeline import run
from pipeline.console import progress_bars
from surrogates import Surrogate, load, obstacle

CONFIG = Path(__file__).parents[2] / "configs" / "hexflex_nonlinear.toml"
SETTINGS = ("fit.selection=evidence", "fit.degree=auto", "fit.gradients=true")
"""What replaces the config's own: the most accurate polynomial from its 60 runs and the oracle's Jacobian there."""

ORACLE = "hexflex"


def fitted(folder: Path, settings: tuple[str, ...] = SETTINGS) -> Surrogate:
    """Run the study into `folder`, or continue it: about a minute the first time."""
    with progress_bars() as told:
        return run(CONFIG, folder, list(settings), progress=told).model


def given(path: Path) -> Surrogate:
    """The model in a file.

    Raises
    ------
    ValueError
        If there is no such file.
    """
    if not path.is_file():
        raise ValueError(f"there is no model at {path}; leave --model out to run the study first, or name a model.json")
    return load(path)


def plant_of(model: Surrogate) -> HexFlex:
    """The oracle that the model was fitted to, if the example can track with it.

    Raises
    ------
    ValueError
        If the model is of another mechanism or of linear kinematics, cannot be inverted, or has no box of
        responses in which every pose has exactly one setting.
    """
    provenance = model.provenance
    parameters = provenance.get("oracle_parameters", {})
    if provenance.get("oracle") != ORACLE or parameters.get("kinematics") != "nonlinear":
        raise ValueError(
            f"this example tracks with the nonlinear HexFlex; the model is of oracle {provenance.get('oracle')!r} with "
            f"kinematics {parameters.get('kinematics')!r}: use a model from {CONFIG.name}"
        )
    mechanism = oracles.get(ORACLE, **parameters)
    assert isinstance(mechanism, HexFlex)
    here = (mechanism.factors.names, tuple(r.name for r in mechanism.responses))
    if (model.factors.names, tuple(r.name for r in model.responses)) != here:
        raise ValueError(
            f"the model has the factors {', '.join(model.factors.names)} and the responses "
            f"{', '.join(r.name for r in model.responses)}; this example needs all of {', '.join(here[0])} and "
            f"{', '.join(here[1])}"
        )
    if against := obstacle(model):
        raise ValueError(f"the model has no inverse: {against}")
    certified_box(model)
    return mechanism


def certified_box(model: Surrogate) -> NDArray[np.float64]:
    """Low and high of each response, shape (6, 2), SI: every pose in there has exactly one setting.

    Raises
    ------
    ValueError
        If the model has no such box.
    """
    certificate = model.certificate
    if certificate is None or certificate.response_box is None:
        why = certificate.box_reason if certificate else "it was not certified; see surrogates.certify"
        raise ValueError(f"the model has no certified box of responses to track in: {why or 'it is of an old version'}")
    return np.array(certificate.response_box, dtype=np.float64)
