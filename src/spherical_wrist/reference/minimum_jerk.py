"""The minimum-jerk polynomial, from which slews, needle drives and early heart beats are made."""

from typing import NamedTuple

import numpy as np

from spherical_wrist.arrays import Array


class Way(NamedTuple):
    """Progress of a point-to-point motion, with its derivatives by s, the fraction of the time that has passed.

    Attributes:
        way: fraction of the way, from 0 to 1.
        speed: its first derivative.
        change: its second derivative.
    """

    way: Array
    speed: Array
    change: Array


def minimum_jerk(s: Array) -> Way:
    """Return the fraction of the way 10 s³ − 15 s⁴ + 6 s⁵ (Flash and Hogan, 1985) at s, clipped to [0, 1].

    Speed and change vanish at both ends, so that pieces of motion joined there have a continuous acceleration.
    """
    s = np.clip(s, 0.0, 1.0)
    return Way(
        s**3 * (10.0 - 15.0 * s + 6.0 * s**2),
        30.0 * s**2 * (1.0 - s) ** 2,
        60.0 * s * (1.0 - s) * (1.0 - 2.0 * s),
    )
