"""Nominal model in the form that the loop evaluates, and its torque for a reference."""

from collections.abc import Callable

import mujoco
import numpy as np
import numpy.typing as npt

from spherical_wrist.dynamics import Nominal
from spherical_wrist.experiment.timing import Timing
from spherical_wrist.loop.engine import Engine
from spherical_wrist.loop.outcome import StoppedError
from spherical_wrist.prepare.inputs import HasMotion
from spherical_wrist.prepare.physics import physics_model
from spherical_wrist.wrist import Wrist

CHUNK = 8192

OFF = mujoco.mjtDisableBit
UNKNOWN_TO_CONTROLLER = OFF.mjDSBL_CONSTRAINT | OFF.mjDSBL_CONTACT | OFF.mjDSBL_ACTUATION
"""Stages that act on the plant alone: constraints and contacts. The motors' torque is the controller's own."""


def nominal_model(wrist: Wrist, timestep: float) -> mujoco.MjModel:
    """Compile a wrist as the controller knows it: its smooth dynamics, without constraints and contacts.

    MuJoCo adds gravity compensation to the passive torque or, with ``actuatorgravcomp``, to that of the actuators. The
    sum is the same, so here it always counts as passive.

    Raises:
        ModelError: MuJoCo refuses the model, or cannot step it.
    """
    model = physics_model(wrist, timestep)
    model.opt.disableflags |= UNKNOWN_TO_CONTROLLER
    model.jnt_actgravcomp[:] = 0
    return model


class NominalModel:
    """Model and data of a nominal wrist, and handles for the loop.

    Attributes:
        handles: arguments of the loop; valid as long as this object is.
    """

    def __init__(self, wrist: Wrist, timing: Timing, engine: Engine) -> None:
        self._model = nominal_model(wrist, timing.physics_period)
        self._data = mujoco.MjData(self._model)
        # computes the quantities that never change
        mujoco.mj_forward(self._model, self._data)
        self._engine = engine
        self.handles = Nominal(
            engine.handle(self._model),
            engine.handle(self._data),
            self._data.qpos,
            self._data.qvel,
            self._data.qfrc_bias,
            self._data.qfrc_passive,
        )

    def interpreted(self) -> Nominal:
        """Return the handles for the interpreted loop."""
        return self.handles._replace(model=self._model, data=self._data)

    def torque(self, reference: HasMotion, time: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Compute the torque [N·m], (n, 3), that makes the nominal model follow the reference at ``time`` [s], (n,)."""
        torque, engine = np.empty((len(time), 3)), self._engine
        engine.inverse_dynamics(self.handles, engine.records(reference.motion(time)), np.empty((3, 3)), torque)
        return torque

    def peak_torque(self, reference: HasMotion, timing: Timing, stop: Callable[[], bool] = lambda: False) -> float:
        """Compute the largest component [N·m] of the torque for the reference, over axes and control instants.

        Raises:
            StoppedError: ``stop`` returned True.
        """
        peak = 0.0
        for first in range(0, timing.samples, CHUNK):
            if stop():
                raise StoppedError
            time = timing.instants(first, min(first + CHUNK, timing.samples))
            peak = max(peak, float(np.abs(self.torque(reference, time)).max()))
        return peak
