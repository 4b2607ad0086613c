"""Tabulation of an inference with two inputs for the compiled loop, and the error of the table.

The table holds the output on a grid over both universes and is read by bilinear interpolation,
:func:`spherical_wrist.fuzzy.interpolation.sugeno`: the loop runs a zero-order Sugeno rule base again, with many more
rules. So the output lies between the smallest and the largest entry, whatever the inputs; positive entries suffice for
a positive output.
"""

import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ParameterError
from spherical_wrist.fuzzy.rules import Inference

GRID = (193, 97)
"""Points over the universes of the two inputs. The peaks of 7 and of 3 evenly spaced sets, where the output has its
kinks, are among them, and 146 KiB fit into a processor's second-level cache."""


def tabulate(inference: Inference, grid: tuple[int, int] = GRID) -> Array:
    """Evaluate an inference on a grid over the universes of its two inputs.

    Raises:
        ParameterError: the rule base has not two inputs, or no rule fires at some point of the grid.
    """
    first, second = _lattice(inference, grid)
    table = inference(first[:, None], second[None, :])
    if not np.isfinite(table).all():
        i, j = np.argwhere(~np.isfinite(table))[0]
        names = [variable.name for variable in inference.rules.variables]
        raise ParameterError(
            f"no rule fires at {names[0]} = {first[i]:.3g}, {names[1]} = {second[j]:.3g}: widen the sets or add a rule"
        )
    return table


def table_error(inference: Inference, table: Array, refine: int = 4) -> float:
    """Bound the difference between a table and its inference, on a lattice ``refine`` times finer.

    The bound is the largest difference on the lattice plus, for points between, half of the largest change of
    the difference from one point to the next along either input. That bounds the difference everywhere if it changes
    nowhere faster than between two points of the lattice somewhere: it is no proof, but about twice what is found.
    """
    rows, columns = ((n - 1) * refine + 1 for n in table.shape)
    first, second = _lattice(inference, (rows, columns))
    read = _between(_between(table, refine).T, refine).T
    difference = inference(first[:, None], second[None, :]) - read
    steps = (np.abs(np.diff(difference, axis=axis)).max() for axis in (0, 1))
    return float(np.abs(difference).max() + 0.5 * sum(steps))


def _lattice(inference: Inference, points: tuple[int, int]) -> tuple[Array, Array]:
    variables = inference.rules.variables
    if len(variables) != 2:
        raise ParameterError(f"only inferences with two inputs can be tabulated; this one has {len(variables)}")
    return variables[0].grid(points[0]), variables[1].grid(points[1])


def _between(values: Array, refine: int) -> Array:
    """Interpolate linearly along the first axis at ``refine`` times as many points."""
    lower, part = np.divmod(np.arange((len(values) - 1) * refine + 1), refine)
    upper = np.minimum(lower + 1, len(values) - 1)
    share = (part / refine)[:, None]
    return np.asarray((1.0 - share) * values[lower] + share * values[upper])
