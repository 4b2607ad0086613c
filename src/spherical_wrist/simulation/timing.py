"""Control and physics periods that fit into each other exactly."""

from math import inf
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from spherical_wrist.errors import ParameterError

MOST_SUBSTEPS, MOST_SAMPLES = 10**5, 10**12
"""Physics steps in a control period, and control periods in a run; more would not end, or not be told apart."""


class Timing(NamedTuple):
    """When things happen.

    Attributes:
        control_period: time from torque to torque [s].
        substeps: physics steps per control period.
        samples: control periods in the run.
    """

    control_period: float
    substeps: int
    samples: int

    @property
    def physics_period(self) -> float:
        """Physics step [s]."""
        return self.control_period / self.substeps

    def instants(self, first: int, last: int) -> npt.NDArray[np.float64]:
        """Times [s] of the control instants ``first`` up to but not including ``last``."""
        return np.arange(first, last, dtype=np.float64) * self.control_period

    def steps(self, first: int, last: int) -> npt.NDArray[np.float64]:
        """Times [s] at which the physics steps of those control periods begin."""
        within = np.arange(self.substeps, dtype=np.float64) * self.physics_period
        return np.add.outer(self.instants(first, last), within).ravel()

    @classmethod
    def of(cls, duration: float, control_period: float, physics_period: float) -> Self:
        """The timing of a run of ``duration`` [s].

        Raises:
            ParameterError: the control period is no multiple of the physics period, or the duration of the former, or
            there would be too many of them.
        """
        return cls(
            control_period,
            _times("control_period", control_period, "physics_period", physics_period, MOST_SUBSTEPS),
            _times("duration", duration, "control_period", control_period, MOST_SAMPLES),
        )


def _times(name: str, whole: float, part_name: str, part: float, most: int) -> int:
    for given_name, given in ((name, whole), (part_name, part)):
        if not 0.0 < given < inf:
            raise ParameterError(f"{given_name} = {given:g} s: must be a positive number")
    ratio = whole / part
    if ratio > most:
        raise ParameterError(
            f"{name} = {whole:g} s is {ratio:g} times {part_name} = {part:g} s: at most {most:g} times is possible"
        )
    count = round(ratio)
    if count < 1 or abs(ratio - count) > 1e-9 * ratio:
        near = sorted({max(1, int(ratio)) * part, (int(ratio) + 1) * part})
        raise ParameterError(
            f"{name} = {whole:g} s is no multiple of {part_name} = {part:g} s: "
            f"use {' or '.join(f'{value:.12g}' for value in near)}"
        )
    return count
