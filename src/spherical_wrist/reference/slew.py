"""References that rest: held in place, or slewed once about a fixed axis."""

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from spherical_wrist.parameters import NonNegative, Positive, Vector, quantity
from spherical_wrist.reference.base import Array, Reference, motion_of


class Hold(Reference):
    """A fixed attitude exp(v)."""

    rotation: Vector = quantity((0.3, 0.2, 0.0), "rad", "rotation vector v of the attitude")

    def motion(self, time: Array) -> npt.NDArray[Any]:
        """See :meth:`Reference.motion`."""
        still = np.zeros((len(time), 3))
        return motion_of(_exp(np.tile(self.rotation, (len(time), 1))), still, still)


class Step(Reference):
    """A slew from the identity to exp(v) about the fixed axis of v, in minimum jerk.

    The fraction of the way at s = (t − start) / length, clipped to [0, 1], is 10 s³ − 15 s⁴ + 6 s⁵ (Flash and Hogan,
    1985): rate and acceleration are continuous and vanish at both ends.
    """

    rotation: Vector = quantity((0.4, 0.3, 0.2), "rad", "rotation vector v of the attitude that is reached")
    start: NonNegative = quantity(0.5, "s", "time at which the slew begins")
    length: Positive = quantity(0.5, "s", "time that the slew takes")

    def motion(self, time: Array) -> npt.NDArray[Any]:
        """See :meth:`Reference.motion`."""
        s = np.clip((time - self.start) / self.length, 0.0, 1.0)[:, None]
        v = np.array(self.rotation)
        way = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        speed = 30.0 * s**2 * (1.0 - s) ** 2 / self.length
        change = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / self.length**2
        return motion_of(_exp(way * v), speed * v, change * v)


def _exp(vectors: Array) -> Array:
    """Quaternions (n, 4) of rotation vectors (n, 3)."""
    return np.asarray(Rotation.from_rotvec(vectors).as_quat(scalar_first=True))
