"""A sweep through the frequencies, for seeing where a law stops following."""

from typing import Annotated, Any, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field

from spherical_wrist.arrays import Array
from spherical_wrist.parameters import NonNegativeVector, Positive, Vector, quantity
from spherical_wrist.reference.angles import motion_of_angles
from spherical_wrist.reference.base import Reference
from spherical_wrist.reference.jet import Jet

Frequency = Annotated[float, Field(ge=1e-3, le=1e3)]
FADE = 0.1
"""Last fraction of the sweep, in which its slope fades to zero."""


class Chirp(Reference):
    """The paper's angles α, β, γ, each A sin(2π ϕ(t) + phase), with a frequency ϕ̇ that sweeps and then stays.

    The attitude is R = Rx(α) Ry(β) Rz(γ), body → world. Linear, ϕ̇ = start + c t; exponential, ϕ̇ = start·exp(k t),
    equal times for equal ratios of frequency. A slope of ϕ̇ that broke off at the end would be a jump of the
    acceleration. Over the last tenth of ``length`` it falls to zero in proportion to the time left, and c or k is such
    that ϕ̇ then is ``final``, where it stays for good. ϕ, ϕ̇ and ϕ̈ are continuous and in closed form. Before t = 0 the
    formula of the sweep continues.
    """

    amplitude: NonNegativeVector = quantity((0.1, 0.1, 0.1), "rad", "amplitude of α, β, γ")
    start: Frequency = quantity(0.2, "Hz", "frequency at the start")
    final: Frequency = quantity(5.0, "Hz", "frequency at the end of the sweep, and after it")
    length: Positive = quantity(10.0, "s", "time that the sweep takes")
    sweep: Literal["exponential", "linear"] = quantity("exponential", "", "how the frequency changes with time")
    phase: Vector = quantity((0.0, 2.0 * np.pi / 3.0, 4.0 * np.pi / 3.0), "rad", "phase of α, β, γ")

    def motion(self, time: Array) -> npt.NDArray[Any]:
        """See :meth:`.Reference.motion`."""
        turns, size = self.turns(time), np.array(self.amplitude)
        argument = 2.0 * np.pi * turns.value[:, None] + np.array(self.phase)
        omega, slope = 2.0 * np.pi * turns.rate[:, None], 2.0 * np.pi * turns.acceleration[:, None]
        value, change = size * np.sin(argument), size * np.cos(argument)
        return motion_of_angles(value, change * omega, change * slope - value * omega**2)

    def turns(self, time: Array) -> Jet:
        """Return ϕ in turns, its frequency ϕ̇ [Hz] and the slope ϕ̈ [Hz/s] of that, at ``time`` [s], (n,)."""
        fade, steady = FADE * self.length, (1.0 - FADE) * self.length
        swept, frequency, slope = self._sweep(np.minimum(time, steady))
        rest = np.clip(time - steady, 0.0, fade)
        after = np.maximum(time - self.length, 0.0)
        return Jet(
            swept + frequency * rest + slope * (0.5 * rest**2 - rest**3 / (6.0 * fade)) + self.final * after,
            frequency + slope * (rest - 0.5 * rest**2 / fade),
            slope * (1.0 - rest / fade),
        )

    def _sweep(self, time: Array) -> tuple[Array, Array, Array]:
        """Return ϕ, ϕ̇ and ϕ̈ of the sweep without its end."""
        if self.sweep == "linear":
            c = (self.final - self.start) / ((1.0 - 0.5 * FADE) * self.length)
            return self.start * time + 0.5 * c * time**2, self.start + c * time, np.full_like(time, c)
        k = self._growth()
        frequency = self.start * np.exp(k * time)
        turns = self.start * np.expm1(k * time) / k if k else self.start * time
        return turns, frequency, k * frequency

    def _growth(self) -> float:
        """Return the k [1/s] that leads to ``final``: start·exp(0.9 k length) (1 + 0.05 k length) = final.

        With y = 1 + 0.05 k length, and ω(z) = W(e^z) of Lambert's W, the solution is 18 y = ω(18 + ln 18 + ln ratio).
        """
        from scipy.special import wrightomega

        if self.final == self.start:
            return 0.0
        m = 2.0 * (1.0 - FADE) / FADE
        y = float(wrightomega(m + np.log(m * self.final / self.start))) / m
        return 2.0 * (y - 1.0) / (FADE * self.length)
