"""Analysis of a rule base over its inputs: gaps in its coverage, sign and monotonicity of its output."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ParameterError, UnknownNameError
from spherical_wrist.fuzzy.rules import Inference
from spherical_wrist.fuzzy.variable import Variable


@dataclass(frozen=True)
class Report:
    """Inference evaluated on a grid over its first two inputs; for a single input, the second axis has length one.

    Attributes:
        inference: the evaluated inference.
        first: grid of the first input, (n,).
        second: grid of the second input, (m,); (1,) if there is none.
        held: constant values of further inputs.
        output: crisp output, (n, m); not-a-number where no rule fires.
        strongest: firing strength of the strongest rule, (n, m).
        threshold: a point where no rule fires above this is a gap.
    """

    inference: Inference
    first: Array
    second: Array
    held: dict[str, float]
    output: Array
    strongest: Array
    threshold: float

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The inputs of the grid, one or two."""
        return self.inference.rules.variables[:2]

    @property
    def gaps(self) -> Array:
        """Points at which no rule fires above the threshold, as booleans (n, m)."""
        return np.asarray(self.strongest <= self.threshold)

    @property
    def gap_share(self) -> float:
        """Fraction of the grid that is a gap, in [0, 1]."""
        return float(self.gaps.mean())

    @property
    def lowest(self) -> float:
        """Smallest output; not-a-number if no rule fires anywhere."""
        return float(np.fmin.reduce(self.output, axis=None))

    @property
    def highest(self) -> float:
        """Largest output."""
        return float(np.fmax.reduce(self.output, axis=None))

    @property
    def positive(self) -> bool:
        """True if the output is positive at every point; a point without output is not positive."""
        return bool((self.output > 0.0).all())

    def change(self, side: int) -> tuple[float, float] | None:
        """Compute the largest rise and fall of the output as the first input goes away from zero.

        For any value of the second input: the largest difference to an output nearer to zero, upwards and downwards. A
        fall of zero means that the output never falls: it is monotone.

        Args:
            side: 1 for first input ≥ 0, −1 for ≤ 0.

        Returns:
            Rise and fall, or None if the universe has no such side.
        """
        outwards = np.argsort(side * self.first)
        outwards = outwards[side * self.first[outwards] >= 0.0]
        if len(outwards) < 2:
            return None
        path = self.output[outwards]
        rise = np.fmax.reduce(path - np.fmin.accumulate(path), axis=None)
        fall = np.fmax.reduce(np.fmax.accumulate(path) - path, axis=None)
        return float(rise), float(fall)

    def trend(self, side: int) -> str:
        """Describe :meth:`change` in words: ``falls``, ``rises``, ``is constant`` or ``rises and falls``.

        Changes below 1e-9 of the largest output are rounding.
        """
        change = self.change(side)
        if change is None:
            return ""
        rises, falls = (part > 1e-9 * max(abs(self.lowest), abs(self.highest)) for part in change)
        if rises and falls:
            return f"rises (by up to {change[0]:.3g}) and falls (by up to {change[1]:.3g})"
        return "rises" if rises else "falls" if falls else "is constant"

    def lines(self) -> list[str]:
        """Write the results as sentences."""
        x, z, count = self.variables[0].name, self.inference.name, len(self.inference.rules.rules)
        if self.gaps.any():
            at = np.argwhere(self.gaps)
            i, j = at[len(at) // 2]
            values = (self.first[i], self.second[j])[: len(self.variables)]
            place = ", ".join(f"{v.name} = {value:.3g}" for v, value in zip(self.variables, values, strict=True))
            covered = f"Gaps: no rule fires above {self.threshold:g} on {100 * self.gap_share:.3g} %, as at {place}."
        else:
            weakest = self.strongest.min()
            covered = f"No gap: everywhere some rule fires at {weakest:.3g} or more (threshold {self.threshold:g})."
        sign = "positive everywhere" if self.positive else "NOT positive everywhere"
        if self.lowest > 0.0 and not self.positive:
            sign = "positive where a rule fires, without a value elsewhere"
        found = [f"{count} rules. {covered}", f"{z} lies between {self.lowest:.4g} and {self.highest:.4g}: {sign}."]
        trends = {side: self.trend(side) for side in (1, -1)}
        words = [
            f"{z} {trend} as {x} {'rises' if side > 0 else 'sinks'} from 0" for side, trend in trends.items() if trend
        ]
        found.append("; ".join(words) + "." if words else "")
        if self.held:
            found.append("Held: " + ", ".join(f"{name} = {value:g}" for name, value in self.held.items()) + ".")
        return [line.replace("-", "−") for line in found if line]


def report(
    inference: Inference, points: int = 241, threshold: float = 0.01, held: Mapping[str, float] | None = None
) -> Report:
    """Evaluate an inference on a grid over its first two inputs.

    Args:
        inference: a ``Sugeno`` or a ``Mamdani``.
        points: number of points along each input; odd, so that the middle of the universe is among them.
        threshold: firing strength up to which a rule counts as not firing.
        held: values of further inputs, keyed by name; None for the middles of their universes.

    Raises:
        ParameterError: there are fewer than three points.
        UnknownNameError: a name in ``held`` is not that of a third or later input.
    """
    if points < 3:
        raise ParameterError(f"points = {points}: at least 3 are needed")
    shown, others = inference.rules.variables[:2], inference.rules.variables[2:]
    values = {variable.name: 0.5 * (variable.low + variable.high) for variable in others}
    for name, value in (held or {}).items():
        if name not in values:
            raise UnknownNameError("input to hold", name, values)
        values[name] = float(value)
    first = shown[0].grid(points)
    second = shown[1].grid(points) if len(shown) > 1 else np.zeros(1)
    grid = np.meshgrid(first, second, indexing="ij")[: len(shown)]
    inputs: tuple[npt.ArrayLike, ...] = (*grid, *values.values())
    strongest = inference.rules.strengths(*inputs).max(axis=0)
    return Report(inference, first, second, values, inference(*inputs), strongest, threshold)
