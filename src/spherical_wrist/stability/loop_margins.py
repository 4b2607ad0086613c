"""Margins of a loop that is cut at one place, from its sensitivity.

The loop is stable as it is. It stays so while a disturbing factor on each axis of the cut lies within

- the *gain margins*: real factors between the gain reduction margin and the gain margin,
- the *phase margin* and the *delay margin*: factors exp(−j φ), and delays exp(−j ω τ),
- the *disk margin* α: complex factors (1 + (1 − σ)/2 δ_i) / (1 − (1 + σ)/2 δ_i), σ = 0, any |δ_i| < α on every axis
  at its own: gain and phase at once (Seiler, Packard and Gahinet, *An Introduction to Disk Margins*, IEEE Control
  Systems Magazine 40(5), 2020, doi:10.1109/MCS.2020.3005277). α = 1 / max_ω μ(S + (σ − 1)/2 I).

Gain, phase and delay margins are the smallest of the loops of single axes with the others closed, 1/S_ii − 1, and of
the same factor on all axes, the eigenvalues of L. python-control finds the crossings; μ is the upper bound of SLICOT's
AB13MD, which is exact for three complex blocks.
"""

from collections.abc import Iterator
from itertools import chain, pairwise, permutations
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.missing_package import missing
from spherical_wrist.stability.frequency_response import frequency_response, largest_gain, loop_gain

try:
    from control import FrequencyResponseData, stability_margins
    from slycot import ab13md
except ImportError:
    raise missing("margins need python-control and Slycot", "margins") from None

Complex = npt.NDArray[np.complex128]

FARTHEST_DB = 60.0
"""Gain margins beyond this are none: the loop is stable at any gain, but for what was cut off from its response."""


class AxisMargins(NamedTuple):
    """Margins of the loop of one axis, with the others closed. None where nothing makes it unstable.

    Attributes:
        max_sensitivity: largest |S_ii| over all frequencies.
        gain_margin_db: increase of the gain that makes the loop unstable [dB].
        gain_reduction_margin_db: reduction of the gain that makes it unstable [dB].
        phase_margin_deg: phase that makes it unstable, of either sign [°].
        delay_margin_s: delay that makes it unstable [s].
        disk_margin: α of this axis alone.
    """

    max_sensitivity: float
    gain_margin_db: float | None
    gain_reduction_margin_db: float | None
    phase_margin_deg: float | None
    delay_margin_s: float | None
    disk_margin: float


class LoopMargins(NamedTuple):
    """Margins of a loop that is cut at one place. None where nothing makes it unstable.

    Attributes:
        max_sensitivity: largest singular value of the sensitivity, over all frequencies (Ms).
        max_complementary: the same of the complementary sensitivity.
        gain_margin_db: increase of the gain, of an axis or of all alike, that makes the loop unstable [dB].
        gain_reduction_margin_db: reduction of the gain that makes it unstable [dB].
        phase_margin_deg: phase that makes it unstable, of either sign [°].
        delay_margin_s: delay that makes it unstable [s].
        disk_margin: α of all axes together.
        axes: margins of each axis alone.
    """

    max_sensitivity: float
    max_complementary: float
    gain_margin_db: float | None
    gain_reduction_margin_db: float | None
    phase_margin_deg: float | None
    delay_margin_s: float | None
    disk_margin: float
    axes: tuple[AxisMargins, ...]


def loop_margins(pulse: Array, period: float, frequency: Array) -> LoopMargins:
    """Compute the margins of a loop.

    Args:
        pulse: response of the sum at the cut, to a unit pulse that is added there, (n, 3, 3).
        period: control period [s].
        frequency: frequencies [Hz], the last one half the rate of the samples.
    """
    coarse = frequency_response(pulse, period, frequency)
    frequency = _refined(frequency, [largest_gain(coarse), largest_gain(np.eye(3) - coarse)])
    sensitivity = frequency_response(pulse, period, frequency)
    ends = frequency_response(pulse, period, np.array([0.0, 0.5 / period]))
    axes, every = [], []
    for i in range(3):
        own = sensitivity[:, i, i]
        found = crossings(1.0 / own - 1.0, 1.0 / ends[:, i, i] - 1.0, frequency)
        every.append(found)
        axes.append(AxisMargins(float(np.abs(own).max()), *found.nearest(), disk_margin(own[:, None, None])))
    alike = np.linalg.eigvals(loop_gain(ends))
    every += [
        crossings(each, end, frequency) for each, end in zip(_eigenvalues(loop_gain(sensitivity)), alike.T, strict=True)
    ]
    together = Crossings(*(list(chain.from_iterable(lists)) for lists in zip(*every, strict=True)))
    return LoopMargins(
        float(largest_gain(sensitivity).max()),
        float(largest_gain(np.eye(3) - sensitivity).max()),
        *together.nearest(),
        disk_margin(sensitivity),
        tuple(axes),
    )


def _refined(frequency: Array, curves: list[Array]) -> Array:
    """Add frequencies around the peaks of curves: at a step of 2.3 % a peak of damping 0.03 would lose 5 %."""
    fine = [frequency]
    for curve in curves:
        peak = int(curve.argmax())
        low, high = frequency[max(peak - 1, 0)], frequency[min(peak + 1, len(frequency) - 1)]
        fine.append(np.geomspace(low, high, 22)[1:-1])
    return np.unique(np.concatenate(fine))


class Crossings(NamedTuple):
    """Changes of one loop that make its gain touch −1.

    Attributes:
        gains: factors on the gain.
        phases: phases [°], −180 to 180.
        delays: delays [s].
    """

    gains: list[float]
    phases: list[float]
    delays: list[float]

    def nearest(self) -> tuple[float | None, float | None, float | None, float | None]:
        """Return gain margin and gain reduction margin [dB], phase margin [°] and delay margin [s]."""
        decibels = [20.0 * float(np.log10(gain)) for gain in self.gains if gain > 0.0]
        decibels = [each for each in decibels if abs(each) < FARTHEST_DB]
        return (
            min((each for each in decibels if each > 0.0), default=None),
            min((-each for each in decibels if each < 0.0), default=None),
            min(map(abs, self.phases), default=None),
            min(self.delays, default=None),
        )


def crossings(loop: Complex, ends: Complex, frequency: Array) -> Crossings:
    """Find the changes of one loop that make it unstable.

    Args:
        loop: gain of the loop at the frequencies, (m,).
        ends: gain at no frequency and at half the rate of the samples, where it is real: it may touch −1 there without
            crossing the axis.
        frequency: frequencies [Hz], (m,).
    """
    response = FrequencyResponseData(loop, 2.0 * np.pi * frequency, smooth=True)
    gains, phases, _, _, at, _ = stability_margins(response, returnall=True)
    delays = np.deg2rad(np.mod(phases, 360.0)) / at
    touching = [-1.0 / end for end in ends.real if end < 0.0]
    return Crossings(gains.tolist() + touching, phases.tolist(), delays.tolist())


def disk_margin(sensitivity: Complex, skew: float = 0.0) -> float:
    """Return the disk margin α with skew σ of a loop with a sensitivity (m, n, n)."""
    size = sensitivity.shape[-1]
    centred = sensitivity + 0.5 * (skew - 1.0) * np.eye(size)
    # μ lies between spectral radius and largest singular value: elsewhere it cannot be largest
    least = np.abs(np.linalg.eigvals(centred)).max()
    near = centred[largest_gain(centred) >= (1.0 - 1e-9) * least]
    blocks, complex_ones = np.ones(size, int), np.full(size, 2)
    return 1.0 / max(float(ab13md(each, blocks, complex_ones)[0]) for each in near)


def _eigenvalues(matrices: Complex) -> Iterator[Complex]:
    """Yield the eigenvalues of matrices (m, 3, 3), each as a continuous function of its row, (m,)."""
    found = np.linalg.eigvals(matrices)
    orders = np.array(list(permutations(range(found.shape[1]))))
    for before, after in pairwise(found):
        jumps = np.abs(after[orders] - before).sum(axis=1)
        after[:] = after[orders[jumps.argmin()]]
    yield from found.T
