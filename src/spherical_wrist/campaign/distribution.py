"""Distributions of varied parameters, by name: each turns a number u in [0, 1] into a value.

A value is the quantile function at u, computed number by number: NumPy's array functions may round differently with the
length of the array, and a value must not depend on the others drawn with it.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, NamedTuple

from scipy.special import ndtr, ndtri

from spherical_wrist.errors import ParameterError, UnknownNameError

Kind = Literal["number", "integer", "boolean", "text", "table"]

SMALLEST = 2.0**-53
"""Replaces u = 0 if a distribution has no lowest value, and 1 minus it replaces u = 1 if it has no highest."""


class Distribution(NamedTuple):
    """A distribution of one parameter.

    Attributes:
        kind: of the values; ``table`` for tables and lists, which are stored as JSON.
        value: returns the value at u in [0, 1], the u-quantile of a continuous distribution.
        options: all values in order if they can be counted, else None.
    """

    kind: Kind
    value: Callable[[float], Any]
    options: Sequence[Any] | None = None


def _uniform(low: float, high: float) -> Distribution:
    _ascending(low, high)
    return Distribution("number", lambda u: low + u * (high - low))


def _loguniform(low: float, high: float) -> Distribution:
    _ascending(low, high, above=0.0)
    bottom, span = math.log(low), math.log(high) - math.log(low)
    return Distribution("number", lambda u: min(max(math.exp(bottom + u * span), low), high))


def _normal(mean: float, deviation: float) -> Distribution:
    _positive(deviation)
    return Distribution("number", lambda u: mean + deviation * float(ndtri(min(max(u, SMALLEST), 1.0 - SMALLEST))))


def _truncated_normal(mean: float, deviation: float, low: float, high: float) -> Distribution:
    _positive(deviation)
    _ascending(low, high)
    a, b = (low - mean) / deviation, (high - mean) / deviation
    # in the lower tail probabilities keep their digits; the upper one is its mirror image
    side = -1.0 if a > 0.0 else 1.0
    start, end = float(ndtr(side * a)), float(ndtr(side * b))
    if start == end:
        raise ValueError("so far from the mean there is no probability left")

    def value(u: float) -> float:
        quantile = side * float(ndtri(start + u * (end - start)))
        return min(max(mean + deviation * quantile, low), high)

    return Distribution("number", value)


def _integers(low: int, high: int) -> Distribution:
    if _kind(low) != "integer" or _kind(high) != "integer":
        raise ValueError("whole numbers are needed")
    if low > high:
        raise ValueError("the first must not be above the second")
    return _choice_of("integer", range(low, high + 1))


def _linear(low: float, high: float, count: int) -> Distribution:
    steps = _steps(low, high, count)
    inner = tuple(low + (high - low) * i / steps for i in range(1, steps))
    return _choice_of("number", (low, *inner, high))


def _logarithmic(low: float, high: float, count: int) -> Distribution:
    steps = _steps(low, high, count, above=0.0)
    inner = tuple(low * (high / low) ** (i / steps) for i in range(1, steps))
    return _choice_of("number", (low, *inner, high))


def _choice(*values: Any) -> Distribution:
    kinds = {_kind(value) for value in values}
    kind: Kind = kinds.pop() if len(kinds) == 1 else "number" if kinds == {"integer", "number"} else "table"
    return _choice_of(kind, tuple(map(float, values)) if kind == "number" else values)


def _choice_of(kind: Kind, options: Sequence[Any]) -> Distribution:
    count = len(options)
    return Distribution(kind, lambda u: options[min(int(u * count), count - 1)], options)


class _Form(NamedTuple):
    make: Callable[..., Distribution]
    arguments: str


FORMS = {
    "uniform": _Form(_uniform, "[low, high]"),
    "loguniform": _Form(_loguniform, "[low, high]"),
    "normal": _Form(_normal, "[mean, standard deviation]"),
    "truncated_normal": _Form(_truncated_normal, "[mean, standard deviation, low, high]"),
    "integers": _Form(_integers, "[lowest, highest]"),
    "linear": _Form(_linear, "[first, last, how many]"),
    "logarithmic": _Form(_logarithmic, "[first, last, how many]"),
    "choice": _Form(_choice, ""),
    "constant": _Form(_choice, ""),
}
"""Every distribution, with its arguments in a campaign file."""


def distribution(name: str, given: Any) -> Distribution:
    """Read the distribution of a parameter from a campaign file.

    Args:
        name: of the parameter, for messages.
        given: a table of one distribution by name, such as ``{"uniform": [0.5, 1.5]}``; a list, for a choice; anything
            else, for a constant.

    Raises:
        UnknownNameError: there is no distribution of that name.
        ParameterError: its arguments are not valid.
    """
    if isinstance(given, list | tuple):
        given = {"choice": given}
    elif not isinstance(given, Mapping):
        given = {"constant": given}
    if len(given) != 1:
        raise ParameterError(f"vary {name} = {dict(given)}: one distribution is needed, such as {{ uniform = [0, 1] }}")
    ((kind, arguments),) = given.items()
    if kind not in FORMS:
        raise UnknownNameError("distribution", kind, FORMS, f", of vary {name}")
    form = FORMS[kind]
    try:
        return form.make(*_checked(kind, arguments, form))
    except ValueError as error:
        raise ParameterError(f"vary {name} = {{ {kind} = {arguments!r} }}: {error}") from None


def _checked(kind: str, arguments: Any, form: _Form) -> Sequence[Any]:
    if kind == "constant":
        return [arguments]
    if not isinstance(arguments, list | tuple) or not arguments:
        raise ValueError(f"{form.arguments or 'a list of values'} is needed")
    if form.arguments:
        if len(arguments) != len(form.arguments.split(",")):
            raise ValueError(f"{form.arguments} is needed")
        if not all(_kind(entry) in ("number", "integer") and math.isfinite(entry) for entry in arguments):
            raise ValueError("finite numbers are needed")
    return arguments


def _kind(value: Any) -> Kind:
    if isinstance(value, bool):
        return "boolean"
    kinds: dict[type, Kind] = {int: "integer", float: "number", str: "text"}
    return kinds.get(type(value), "table")


def _ascending(low: float, high: float, above: float = -math.inf) -> None:
    if low <= above:
        raise ValueError(f"both must be above {above:g}")
    if low >= high:
        raise ValueError(f"{low:g} is not below {high:g}")


def _positive(deviation: float) -> None:
    if deviation <= 0.0:
        raise ValueError("the standard deviation must be positive")


def _steps(low: float, high: float, count: Any, above: float = -math.inf) -> int:
    """Count the steps between ``count`` points from ``low`` to ``high``."""
    _ascending(low, high, above)
    if not isinstance(count, int) or count < 2:
        raise ValueError("how many: a whole number of 2 or more is needed")
    return count - 1
