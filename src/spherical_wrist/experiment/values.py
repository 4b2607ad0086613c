"""Types of the values that an experiment is made from, for type checkers and editors.

A test compares the names with the parameters of :class:`~spherical_wrist.experiment.description.Experiment`: Python's
typing has no way to derive them. Values are checked when an experiment is made, whatever their types say.
"""

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any, Literal, TypedDict

import numpy as np
import numpy.typing as npt

from spherical_wrist.actuation import Actuation
from spherical_wrist.control import Law
from spherical_wrist.disturbance import Disturbance
from spherical_wrist.reference import Reference
from spherical_wrist.sensing import Sensing

Axes = float | Sequence[float] | npt.NDArray[np.floating[Any]]
"""One number for all three axes, or one for each."""

Table = Mapping[str, Any]
"""Name and parameters of a part of an experiment."""

LawGiven = str | Law | type[Law] | Table
"""A law: its name, ``path/to/file.py:Name``, an instance, a class, or a table of name and parameters."""


class Conditions(TypedDict, total=False):
    """Parameters of an experiment but its law, and ``hardware``, which stands for several of them."""

    hardware: Literal["ideal", "realistic"]
    reference: str | Reference | type[Reference] | Table
    disturbance: float | str | Disturbance | type[Disturbance] | Table
    sensing: str | Sensing | type[Sensing] | Table
    actuation: str | Actuation | type[Actuation] | Table
    mass_scale: float
    com_shift: Axes
    payload: float
    friction: float
    damping: float
    initial_error: Axes
    initial_rate_error: Axes
    duration: float | Literal["whole"]
    control_period: float
    physics_period: float | None
    steady_from: float | None
    bound: float
    seed: int
    model: str | PathLike[str] | None
    joint: str | None
    motors: str | Sequence[str] | None
    tip: str | None
    hinges: str | Sequence[str] | None


class ExperimentValues(Conditions, total=False):
    """Parameters of an experiment, and ``hardware``."""

    law: LawGiven
