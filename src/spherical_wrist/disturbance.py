"""Torques on the plant's joint that the controller does not know of, in the body frame.

The size of each is ``level`` times the peak torque that the nominal model needs for the reference (over time and
axes), or ``amplitude`` in N·m where that is given; it is the same on every axis.
"""

from collections.abc import Callable
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ParameterError
from spherical_wrist.parameters import Member, NonNegative, Positive, Vector, quantity

Torque = Callable[[Array], Array]
"""A torque [N·m] of shape (n, 3) as a function of times [s] of shape (n,)."""
Frequency = Annotated[float, Field(ge=1e-3, le=1e4)]

GRACE = 5e-10
"""Time [s] by which an edge comes early: an edge on a sample belongs to that sample, however its time was rounded."""

TONES = 64
"""Number of tones of a noise, per axis."""


class Disturbance(Member):
    """A disturbance. Subclass it, annotate the parameters, write ``shape``.

    Attributes:
        built_for_loop: the shape is not known before the closed loop is, which then has it computed.
    """

    kind: ClassVar[str] = "disturbance"
    built_for_loop: ClassVar[bool] = False

    level: NonNegative = quantity(
        0.25,
        "",
        "size as a fraction of the reference's peak nominal torque",
        percent=True,
        acts_with={"amplitude": None},
    )
    amplitude: NonNegative | None = quantity(None, "N·m", "size as a torque, instead of the level")

    def shape(self, random: np.random.Generator) -> Torque:
        """Return the disturbance of unit size."""
        raise NotImplementedError("a disturbance needs a method shape(self, random)")

    def size(self, peak: float) -> float:
        """Return the size of the disturbance [N·m].

        Args:
            peak: see :meth:`torque`.

        Raises:
            ParameterError: a level is given, but the reference needs no torque that it could be a fraction of.
        """
        if self.amplitude is None and self.level > 0.0 and peak < 1e-9:
            raise ParameterError(
                f"disturbance level {self.level:g} is a fraction of the torque that the reference needs, and that is "
                "zero: give the size in N·m instead (disturbance.amplitude = 0.005), or no disturbance (level 0)"
            )
        return self.level * peak if self.amplitude is None else self.amplitude

    def torque(self, peak: float, random: np.random.Generator, worst: Callable[[], Torque] | None = None) -> Torque:
        """Return the disturbance in N·m.

        Args:
            peak: largest component of the torque that the nominal model needs for the reference [N·m].
            random: the experiment's generator; only random shapes draw from it.
            worst: computes the worst disturbance of unit size for the closed loop; only a shape that is
                ``built_for_loop`` asks for it.

        Raises:
            ParameterError: a level is given, but the reference needs no torque that it could be a fraction of; or the
                shape needs a closed loop.
        """
        size = self.size(peak)
        unit = worst() if self.built_for_loop and worst is not None and size > 0.0 else self.shape(random)
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


class Square(Disturbance):
    """The sign of sin(2π f t + φ), +1 in its first half, −1 in its second; on every axis."""

    frequency: Frequency = quantity(5.0, "Hz", "frequency")
    phase: Vector = quantity((0.0, 0.0, 0.0), "rad", "phase per axis")

    def shape(self, random: np.random.Generator) -> Torque:
        """See :meth:`Disturbance.shape`."""

        def torque(time: Array) -> Array:
            turns = self.frequency * (time[:, None] + GRACE) + np.array(self.phase) / (2.0 * np.pi)
            return np.where(np.mod(turns, 1.0) < 0.5, 1.0, -1.0)

        return torque


class Chirp(Disturbance):
    """sin(2π f₀ (exp(k τ) − 1) / k + φ): a frequency f₀ exp(k τ) from ``start`` to ``final``, repeated.

    τ is the time since the sweep began, which takes ``length``, and k = ln(final / start) / length: equal times for
    equal ratios of frequency (Farina, 108th AES Convention, 2000, paper 5093).
    """

    start: Frequency = quantity(0.5, "Hz", "frequency at the start of a sweep")
    final: Frequency = quantity(40.0, "Hz", "frequency at the end of a sweep")
    length: Positive = quantity(8.0, "s", "time that a sweep takes")
    phase: Vector = quantity((0.0, 0.0, 0.0), "rad", "phase at the start of a sweep, per axis")

    def shape(self, random: np.random.Generator) -> Torque:
        """See :meth:`Disturbance.shape`."""
        growth = float(np.log(self.final / self.start)) / self.length

        def torque(time: Array) -> Array:
            since = np.mod(time + GRACE, self.length) - GRACE
            turns = self.start * (np.expm1(growth * since) / growth if growth else since)
            wave: Array = np.sin(2.0 * np.pi * turns[:, None] + np.array(self.phase))
            return wave

        return torque


class Steps(Disturbance):
    """Random levels, uniform in ±1, independent on the axes, each held for a time."""

    BLOCK: ClassVar[int] = 256

    hold: Positive = quantity(0.25, "s", "time for which a level is held")

    def shape(self, random: np.random.Generator) -> Torque:
        """See :meth:`Disturbance.shape`."""
        seed = int(random.integers(2**63))

        def torque(time: Array) -> Array:
            # a generator of its own for each block of levels: the torque does not depend on the pieces of the run
            block, index = np.divmod(np.floor((time + GRACE) / self.hold).astype(np.int64), self.BLOCK)
            levels = np.empty((len(time), 3))
            for each in np.unique(block):
                drawn = np.random.default_rng([seed, int(each)]).uniform(-1.0, 1.0, (self.BLOCK, 3))
                levels[block == each] = drawn[index[block == each]]
            return levels

        return torque


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
        phase = np.mod(since + GRACE, self.period)
        return ((since > -GRACE) & (phase < self.width)).astype(float)


class Worst(Disturbance):
    """The waveform within ±1 on every axis that moves the tool tip furthest, built for the law and hardware of the run.

    It is that of :func:`spherical_wrist.prepare.worst_torque.worst_torque`, for the loop as it is without a disturbance
    at the first attitude of the reference. The law's answer to a pulse of torque says which sign each earlier moment
    must have for its contribution to the tip's displacement to add up now: the waveform jumps between −1 and +1. It is
    repeated, and the last repetition reaches its peak with the last control instant of the run.
    """

    built_for_loop: ClassVar[bool] = True

    def shape(self, random: np.random.Generator) -> Torque:
        """See :meth:`Disturbance.shape`; only of size 0, because without a closed loop there is no worst one.

        Raises:
            ParameterError: the size is not 0.
        """
        if self.level == 0.0 or self.amplitude == 0.0:
            return lambda time: np.zeros((len(time), 3))
        raise ParameterError("disturbance 'worst' has no shape of its own: an experiment's closed loop gives it one")


class Noise(Disturbance):
    """Gaussian noise of unit RMS per axis, flat up to a bandwidth and zero above; independent on the axes."""

    bandwidth: Positive = quantity(20.0, "Hz", "highest frequency; size is then the RMS value")

    def shape(self, random: np.random.Generator) -> Torque:
        """See :meth:`Disturbance.shape`."""
        return _band_of_noise(0.0, self.bandwidth, random)


class Tremor(Disturbance):
    """Tremor of a hand: Gaussian noise of unit RMS per axis between two frequencies; independent on the axes.

    The physiological tremor of a surgeon's hand lies at 8 to 12 Hz (Riviere, Ang and Khosla, IEEE Transactions on
    Robotics and Automation 19(5):793, 2003, doi:10.1109/TRA.2003.817506).
    """

    low: Frequency = quantity(8.0, "Hz", "lowest frequency; size is the RMS value")
    high: Frequency = quantity(12.0, "Hz", "highest frequency")

    @model_validator(mode="after")
    def _is_a_band(self) -> Self:
        if not self.low < self.high:
            raise ValueError(f"low = {self.low:g} Hz must be less than high = {self.high:g} Hz")
        return self

    def shape(self, random: np.random.Generator) -> Torque:
        """See :meth:`Disturbance.shape`."""
        return _band_of_noise(self.low, self.high, random)


def _band_of_noise(low: float, high: float, random: np.random.Generator) -> Torque:
    """Return Gaussian noise of unit RMS per axis, flat from ``low`` to ``high`` [Hz] and zero elsewhere.

    A sum of cosines with one random frequency in each of 64 equal slices of the band and random phases (Shinozuka's
    spectral representation): a function of time, and so the same whatever the sampling.
    """
    slices = np.arange(TONES) + random.random((3, TONES))
    omega = 2.0 * np.pi * low + 2.0 * np.pi * (high - low) * slices / TONES
    phase = 2.0 * np.pi * random.random((3, TONES))

    def torque(time: Array) -> Array:
        total = np.zeros((len(time), 3))
        for tone in range(TONES):
            total += np.cos(time[:, None] * omega[:, tone] + phase[:, tone])
        total *= np.sqrt(2.0 / TONES)
        return total

    return torque
