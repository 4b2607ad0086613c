"""The nominal model in the form that the loop evaluates, and the torque that it needs for a reference."""

from collections.abc import Callable
from typing import Any, Protocol

import mujoco
import numpy as np
import numpy.typing as npt

from spherical_wrist.dynamics import Nominal
from spherical_wrist.simulation.engine import Engine
from spherical_wrist.simulation.physics import physics_model
from spherical_wrist.simulation.timing import Timing
from spherical_wrist.wrist import Wrist

CHUNK = 8192


class Motion(Protocol):
    """A reference, or what stands for one in the loop."""

    def motion(self, time: npt.NDArray[np.float64]) -> npt.NDArray[Any]:
        """See :meth:`spherical_wrist.reference.base.Reference.motion`."""


class NominalModel:
    """A nominal wrist's model and data, kept alive for the handles that the loop takes.

    Attributes:
        handles: see :class:`spherical_wrist.dynamics.Nominal`.
    """

    def __init__(self, wrist: Wrist, timing: Timing, engine: Engine) -> None:
        self._model = physics_model(wrist, timing.physics_period)
        self._data = mujoco.MjData(self._model)
        # once through the bindings: quantities that never change are computed here
        mujoco.mj_forward(self._model, self._data)
        self.handles = Nominal(
            engine.handle(self._model),
            engine.handle(self._data),
            self._data.qpos,
            self._data.qvel,
            self._data.qfrc_passive,
        )


def nominal_torque(
    nominal: Wrist, reference: Motion, time: npt.NDArray[np.float64], timing: Timing, engine: Engine
) -> npt.NDArray[np.float64]:
    """Torque [N·m], (n, 3), with which the nominal wrist follows the reference exactly at ``time`` [s], (n,)."""
    model, torque = NominalModel(nominal, timing, engine), np.empty((len(time), 3))
    engine.inverse_dynamics(model.handles, engine.records(reference.motion(time)), np.empty((3, 3)), torque)
    return torque


def peak_torque(
    nominal: Wrist, reference: Motion, timing: Timing, engine: Engine, stop: Callable[[], bool] = lambda: False
) -> float:
    """Largest component [N·m], over axes and control instants, of the nominal torque for the reference.

    Asked to ``stop``, it returns the largest so far.
    """
    peak = 0.0
    for first in range(0, timing.samples, CHUNK):
        if stop():
            break
        time = timing.instants(first, min(first + CHUNK, timing.samples))
        peak = max(peak, float(np.abs(nominal_torque(nominal, reference, time, timing, engine)).max()))
    return peak
