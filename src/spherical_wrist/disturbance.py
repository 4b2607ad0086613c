"""Torques on the plant's joint that the controller does not know of, in the body frame.

The size of each is ``level`` times the peak torque that the nominal model needs for the reference (over time and
axes), or ``amplitude`` in N·m where that is given; it is the same on every axis.
"""

from collections.abc import Callable
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from spherical_wrist.errors import ParameterError
from spherical_wrist.parameters import Member, NonNegative, Positive, Vector, quantity

Array = npt.NDArray[np.float64]
Torque = Callable[[Array], Array]
"""A torque [N·m] of shape (n, 3) as a function of times [s] of shape (n,)."""


class Disturbance(Member):
    """A disturbance. Subclass it, annotate the parameters, write ``shape``."""

    kind: ClassVar[str] = "disturbance"

    level: NonNegative = quantity(
        0.25, "", "size as a fraction of the reference's peak nominal torque", acts_with={"amplitude": None}
    )
    amplitude: NonNegative | None = quantity(None, "N·m", "size as a torque, instead of the level")

    def shape(self, random: np.random.Generator) -> Torque:
        """Return the disturbance of unit size."""
        raise NotImplementedError("a disturbance needs a method shape(self, random)")

    def torque(self, peak: float, random: np.random.Generator) -> Torque:
        """Return the disturbance in N·m.

        Args:
            peak: largest component of the torque that the nominal model needs for the reference [N·m].
            random: the experiment's generator; only random shapes draw from it.

        Raises:
            ParameterError: a level is given, but the reference needs no torque that it could be a fraction of.
        """
        if self.amplitude is None and self.level > 0.0 and peak < 1e-9:
            raise ParameterError(
                f"disturbance level {self.level:g} is a fraction of the torque that the reference needs, and that is "
                "zero: give the size in N·m instead (disturbance.amplitude = 0.005), or no disturbance (level 0)"
            )
        size = self.level * peak if self.amplitude is None else self.amplitude
        unit = self.shape(random)
        return lambda time: size * unit(time)


class Constant(Disturbance):
    """The same torque all the time."""

    def shape(self, random: np.random.Generator) -> Torque:
        """See :meth:`Disturbance.shape`."""
        return lambda time: np.ones((len(time), 3))


class Sinusoid(Disturbance):
    """sin(2π f t + φ) on every axis."""

    frequency: Positive = quantity(1.0, "Hz", "frequency")
    phase: Vector = quantity((0.0, 0.0, 0.0), "rad", "phase per axis")

    def shape(self, random: np.random.Generator) -> Torque:
        """See :meth:`Disturbance.shape`."""
        return lambda time: np.sin(2.0 * np.pi * self.frequency * time[:, None] + np.array(self.phase))


class Pulse(Disturbance):
    """Rectangular pulses, repeated."""

    start: NonNegative = quantity(3.0, "s", "time of the first pulse")
    width: Positive = quantity(0.5, "s", "length of a pulse")
    period: Positive = quantity(2.0, "s", "time from pulse to pulse")

    def shape(self, random: np.random.Generator) -> Torque:
        """See :meth:`Disturbance.shape`."""
        return lambda time: np.repeat(self._on(time)[:, None], 3, axis=1)

    def _on(self, time: Array) -> Array:
        since = time - self.start
        # half a nanosecond of grace: a pulse edge on a sample belongs to that sample, however the time was rounded
        phase = np.mod(since + 5e-10, self.period)
        return ((since > -5e-10) & (phase < self.width)).astype(float)


class Noise(Disturbance):
    """Gaussian noise of unit RMS per axis, flat up to a bandwidth and zero above; independent on the axes.

    A sum of cosines with one random frequency in each of 64 equal slices of the band and random phases (Shinozuka's
    spectral representation): a function of time, and so the same whatever the sampling.
    """

    TONES: ClassVar[int] = 64

    bandwidth: Positive = quantity(20.0, "Hz", "highest frequency; size is then the RMS value")

    def shape(self, random: np.random.Generator) -> Torque:
        """See :meth:`Disturbance.shape`."""
        slices = np.arange(self.TONES) + random.random((3, self.TONES))
        omega = 2.0 * np.pi * self.bandwidth * slices / self.TONES
        phase = 2.0 * np.pi * random.random((3, self.TONES))

        def torque(time: Array) -> Array:
            total = np.zeros((len(time), 3))
            for tone in range(self.TONES):
                total += np.cos(time[:, None] * omega[:, tone] + phase[:, tone])
            total *= np.sqrt(2.0 / self.TONES)
            return total

        return torque
