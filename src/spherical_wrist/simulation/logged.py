"""From what the loop logged to a series."""

from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from spherical_wrist.actuation import SphericalMotor
from spherical_wrist.kinematics import tip_position
from spherical_wrist.simulation.hardware import Hardware
from spherical_wrist.simulation.loop import LOG
from spherical_wrist.simulation.series import EXTRAS, Series
from spherical_wrist.wrist import Wrist

Array = npt.NDArray[np.float64]


class Logged(NamedTuple):
    """Arrays of a call of the loop, one row per control instant; the log may be used again by the next call.

    Attributes:
        time: control instants [s].
        desired: the reference, MOTION.
        disturbance: torque on the joint from each instant on [N·m], (n, 3).
        log: LOG.
        states: the law's state, (n, m).
        currents: of the coils [A], (n, coils).
    """

    time: Array
    desired: npt.NDArray[Any]
    disturbance: Array
    log: npt.NDArray[Any]
    states: Array
    currents: Array

    def first(self, count: int) -> Self:
        """The first ``count`` rows."""
        return type(self)(*(array[:count] for array in self))

    def series(self, wrist: Wrist, hardware: Hardware) -> Series:
        """The series of a plant, without the extras that its hardware makes superfluous."""
        columns = {name: self.log[name].copy() for name in _names(hardware)}
        desired_attitude = self.desired["attitude"].copy()
        return Series(
            **columns,
            time=self.time,
            desired_attitude=desired_attitude,
            desired_rate=self.desired["rate"].copy(),
            disturbance=self.disturbance.copy(),
            tip=tip_position(columns["attitude"], wrist.anchor, wrist.mount, wrist.lever),
            desired_tip=tip_position(desired_attitude, wrist.anchor, wrist.mount, wrist.lever),
            law_state=self.states,
            current=self.currents,
        )


def _names(hardware: Hardware) -> list[str]:
    names = [name for name in LOG.names or () if name not in EXTRAS]
    names += [] if hardware.sensing.perfect else ["measured_attitude", "measured_rate"]
    names += [] if hardware.actuation.perfect else ["commanded_torque"]
    return names + (["condition"] if isinstance(hardware.actuation, SphericalMotor) else [])
