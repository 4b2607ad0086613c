"""Timing of a run: control and physics periods that are exact multiples of each other."""

from math import ceil, inf
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from spherical_wrist.errors import ParameterError

MAX_SUBSTEPS, MAX_SAMPLES = 10**5, 10**12
"""Largest number of physics steps in a control period, and of control periods in a run.

Longer runs would not end, and their times would not be distinct numbers.
"""

ROUNDING = 1e-9
"""Relative difference up to which two periods are the same."""


class Timing(NamedTuple):
    """Timing of a run.

    Attributes:
        control_period: time between two torques [s].
        substeps: number of physics steps per control period.
        samples: number of control periods in the run.
    """

    control_period: float
    substeps: int
    samples: int

    @property
    def physics_period(self) -> float:
        """Physics step [s]."""
        return self.control_period / self.substeps

    def instants(self, first: int, last: int) -> npt.NDArray[np.float64]:
        """Return the times [s] of control instants ``first`` to ``last`` − 1."""
        return np.arange(first, last, dtype=np.float64) * self.control_period

    def steps(self, first: int, last: int) -> npt.NDArray[np.float64]:
        """Return the start times [s] of the physics steps of control periods ``first`` to ``last`` − 1."""
        within = np.arange(self.substeps, dtype=np.float64) * self.physics_period
        return np.add.outer(self.instants(first, last), within).ravel()

    @classmethod
    def of(cls, duration: float, control_period: float, physics_period: float) -> Self:
        """Create the timing of a run.

        Args:
            duration: simulated time [s].
            control_period: time between two torques [s].
            physics_period: physics step [s].

        Raises:
            ParameterError: the control period is no multiple of the physics period, the duration is no multiple of the
                control period, or there are too many of either.
        """
        return cls(
            control_period,
            _times("control_period", control_period, "physics_period", physics_period, MAX_SUBSTEPS),
            _times("duration", duration, "control_period", control_period, MAX_SAMPLES),
        )

    @classmethod
    def fitted(cls, duration: float, control_period: float, timestep: float) -> Self:
        """Create the timing of a run with the largest physics step up to ``timestep`` that divides the control period.

        Args:
            duration: simulated time [s].
            control_period: time between two torques [s].
            timestep: largest physics step [s].

        Raises:
            ParameterError: the duration is no multiple of the control period, or there are too many steps.
        """
        positive = 0.0 < timestep < inf and 0.0 < control_period < inf
        if positive and (ratio := control_period / timestep) <= MAX_SUBSTEPS:
            timestep = control_period / max(1, ceil(ratio * (1.0 - ROUNDING)))
        return cls.of(duration, control_period, timestep)

    def differs_from(self, timestep: float) -> bool:
        """Return True if the physics step is not ``timestep`` [s], but for rounding."""
        return abs(self.physics_period - timestep) > ROUNDING * timestep


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
    if count < 1 or abs(ratio - count) > ROUNDING * ratio:
        near = sorted({max(1, int(ratio)) * part, (int(ratio) + 1) * part})
        raise ParameterError(
            f"{name} = {whole:g} s is no multiple of {part_name} = {part:g} s: "
            f"use {' or '.join(f'{value:.12g}' for value in near)}"
        )
    return count
