"""Reference against the range of the wrist's joint."""

from typing import Self

import mujoco
import numpy as np
import numpy.typing as npt

from spherical_wrist.wrist import name_of

OFF = mujoco.mjtDisableBit


class JointRange:
    """Range of a ball joint, and the samples of a reference that leave it.

    Args:
        name: name of the joint.
        limit: largest angle from the initial attitude, about any axis [rad].
    """

    def __init__(self, name: str, limit: float) -> None:
        self._name, self._limit = name, limit
        self._samples, self._beyond, self._largest = 0, 0, 0.0

    @classmethod
    def of(cls, model: mujoco.MjModel) -> Self | None:
        """Return the range of the joint of a wrist; None for a joint without limit."""
        if not model.jnt_limited[0] or model.opt.disableflags & (OFF.mjDSBL_LIMIT | OFF.mjDSBL_CONSTRAINT):
            return None
        return cls(name_of(model, mujoco.mjtObj.mjOBJ_JOINT, 0), float(model.jnt_range[0].max()))

    def add(self, attitude: npt.NDArray[np.float64]) -> None:
        """Add desired attitudes (n, 4), one for each control instant."""
        angle = 2.0 * np.arctan2(np.linalg.norm(attitude[:, 1:], axis=1), np.abs(attitude[:, 0]))
        self._samples += len(angle)
        self._beyond += int(np.count_nonzero(angle > self._limit))
        self._largest = max(self._largest, float(angle.max(initial=0.0)))

    def warnings(self) -> tuple[str, ...]:
        """Return a sentence if a reference left the range."""
        if not self._beyond:
            return ()
        excess, share = self._largest - self._limit, self._beyond / self._samples
        sentence = (
            f"the reference leaves the range of joint {self._name!r}, {self._limit:.4g} rad, by up to {excess:.3g} rad "
            f"for {100.0 * share:.3g} % of the time: give a smaller motion, or the joint a larger range"
        )
        return (sentence,)
