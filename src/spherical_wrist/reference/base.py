"""What a reference is: an attitude as an exactly differentiable function of time."""

from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from spherical_wrist.dynamics import MOTION
from spherical_wrist.parameters import Member

Array = npt.NDArray[np.float64]


class Reference(Member):
    """A desired motion. Subclass it, annotate the parameters, write ``motion``."""

    kind: ClassVar[str] = "reference"

    def motion(self, time: Array) -> npt.NDArray[Any]:
        """Attitude, body rate [rad/s] and body acceleration [rad/s²] at ``time`` [s], (n,), as an array of MOTION."""
        raise NotImplementedError

    def drawn(self, random: np.random.Generator) -> "Reference":
        """This reference with everything random in it drawn: itself, where nothing is."""
        return self


def motion_of(attitude: Array, rate: Array, acceleration: Array) -> npt.NDArray[Any]:
    """Packs quaternions (n, 4) and their derivatives, each (n, 3), into an array of MOTION (n,)."""
    packed = np.empty(len(rate), MOTION)
    packed["attitude"] = attitude
    packed["rate"] = rate
    packed["acceleration"] = acceleration
    return packed
