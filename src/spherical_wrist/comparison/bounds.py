"""Upper bounds on the metrics of a run, and the bound that a run misses."""

from collections.abc import Iterable, Mapping
from math import inf, isfinite
from typing import Any, NamedTuple

from spherical_wrist.errors import ParameterError, UnknownNameError
from spherical_wrist.loop.outcome import Outcome, Status
from spherical_wrist.measure.bound import ATTITUDE_BOUND, BOUND
from spherical_wrist.measure.metrics import METRICS, Metrics

Bounds = Mapping[str, float]
"""Largest values that are permitted, by name of the metric and in its unit."""

BOUNDS: Bounds = {"max_tip_error_mm": BOUND, "max_error_rad": ATTITUDE_BOUND}
"""Default bounds of a frontier; see :mod:`spherical_wrist.measure.bound`."""


class Miss(NamedTuple):
    """Way in which a run misses its bounds.

    Attributes:
        metric: metric that exceeds its bound, by the largest factor if there are several; None for a run that did not
            complete.
        value: its value; None if the run has none.
        reason: statement for people.
    """

    metric: str | None
    value: float | None
    reason: str


def checked(bounds: Mapping[str, Any]) -> dict[str, float]:
    """Return bounds as numbers.

    Raises:
        UnknownNameError: there is no metric of such a name.
        ParameterError: a bound is not a number greater than 0, or there is none.
    """
    found: dict[str, float] = {}
    for name, bound in bounds.items():
        if name not in METRICS:
            raise UnknownNameError("metric", name, METRICS)
        try:
            found[name] = float(bound)
        except (TypeError, ValueError):
            found[name] = 0.0
        if not (found[name] > 0.0 and isfinite(found[name])):
            raise ParameterError(f"{name} = {bound}: a bound must be a number greater than 0")
    if not found:
        raise ParameterError(f"a bound is needed: one or more of {', '.join(METRICS)}")
    return found


def read_bounds(texts: Iterable[str], usual: Bounds) -> dict[str, float]:
    """Read texts ``METRIC=VALUE``, which change the usual bounds; ``METRIC=none`` takes one away.

    Raises:
        ParameterError: a text is not of this form; otherwise as :func:`checked`.
    """
    bounds: dict[str, Any] = dict(usual)
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise ParameterError(f"--max {text!r}: METRIC=VALUE is needed, such as max_tip_error_mm=0.1")
        bounds[name] = value
        if value == "none" and name in METRICS:
            del bounds[name]
    return checked(bounds)


def require(bounds: Bounds, metrics: Metrics) -> None:
    """Refuse bounds on metrics that a run does not have.

    Raises:
        ParameterError: there is one.
    """
    for name in bounds:
        if name not in metrics.available:
            raise ParameterError(f"{name}: the run has no such metric, which is of {METRICS[name].needs.runs}")


def excess(metrics: Metrics, bounds: Bounds) -> dict[str, float]:
    """Return metrics as multiples of their bounds; infinity for a metric without a value."""
    return {name: inf if (value := metrics[name]) is None else value / bound for name, bound in bounds.items()}


def find_miss(outcome: Outcome, metrics: Metrics, bounds: Bounds) -> Miss | None:
    """Return how a run misses its bounds; None if it keeps them."""
    if outcome.status is not Status.COMPLETED:
        return Miss(None, None, str(outcome))
    factors = excess(metrics, bounds)
    worst = max(factors, key=lambda name: factors[name])
    if factors[worst] <= 1.0:
        return None
    metric, value = METRICS[worst], metrics[worst]
    return Miss(worst, value, f"{metric.label} {_shown(worst, value)} > {_shown(worst, bounds[worst])}")


def statement(name: str, bound: float) -> str:
    """Return a bound for people, such as ``tip error, largest 0.1 mm``."""
    return f"{METRICS[name].label} {_shown(name, bound)}"


def _shown(name: str, value: float | None) -> str:
    if value is None:
        return "without a value"
    return f"{METRICS[name].shown_value(value):.4g} {METRICS[name].shown_unit}".strip()
