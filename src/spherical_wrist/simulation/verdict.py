"""Verdict on a run: the sentence with which every summary of it begins."""

from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import NamedTuple

from spherical_wrist.loop.outcome import Outcome, Status
from spherical_wrist.measure.bound import ATTITUDE_BOUND
from spherical_wrist.measure.metrics import METRICS, MetricSettings

DIGITS, MOST_DIGITS = 2, 17
"""Significant digits of figures, and the most where fewer would put a figure on the other side of the bound."""


class Judgement(StrEnum):
    """Result of comparing a run with the bound on the tip error."""

    WITHIN = "within"
    EXCEEDS = "exceeds"
    LOST = "lost"
    NONE = "none"


class Verdict(NamedTuple):
    """Verdict on a run.

    Attributes:
        judgement: result of comparing the run with the bound; ``none`` where no instant is in the steady window.
        text: the verdict in one sentence.
        bound: on the tip error [mm].
        warnings: number of warnings of the run.
    """

    judgement: Judgement
    text: str
    bound: float
    warnings: int = 0

    @property
    def within(self) -> bool | None:
        """True if the run keeps to the bound, False if it does not or was lost; None where there is no figure."""
        return None if self.judgement is Judgement.NONE else self.judgement is Judgement.WITHIN

    def __str__(self) -> str:
        """Return the sentence."""
        return self.text

    def to_dict(self) -> dict[str, str | float | bool | None]:
        """Return the verdict as entries of a JSON object."""
        return {"verdict": self.text, "bound_mm": self.bound, "within_bound": self.within}


def verdict(
    outcome: Outcome, metrics: Mapping[str, float | None], measurement: MetricSettings, warnings: Sequence[str] = ()
) -> Verdict:
    """Judge a run by the bound on its tip error over the steady window.

    Args:
        outcome: outcome of the run.
        metrics: its metrics by name. Of recordings of older versions some are missing, and are not said then.
        measurement: settings of the metrics, the bound among them.
        warnings: of the run; that there are some is said.
    """
    bound, count = measurement.bound, len(warnings)
    warned = f"{count} warning{'s' * (count > 1)}"
    doubt = f" ({warned})" if count else ""
    if outcome.status.lost:
        return Verdict(Judgement.LOST, f"{outcome}{doubt}", bound, count)
    stopped = f"{outcome}; until then " if outcome.status is Status.INTERRUPTED else ""
    rms, largest = metrics["rms_tip_error_mm"], metrics["max_tip_error_mm"]
    if rms is None or largest is None:
        window = f"no sample is in the steady window, t ≥ {measurement.steady_from:g} s"
        return Verdict(Judgement.NONE, f"{stopped}not judged: {window}{doubt}", bound, count)
    within = largest <= bound
    figures = [f"{_length(rms, bound)} RMS", f"{_length(largest, bound)} largest"]
    if within:
        settled = metrics.get("settling_time_s")
        head = f"within {bound:g} mm" + (f" from {settled:.3g} s on" if settled else "")
        turned = metrics.get("max_error_rad")
        if turned is not None and not turned <= ATTITUDE_BOUND:
            head += f" but turned by up to {_figure(turned)} rad"
        head, doubt = f"{head}, with {warned}" if count else head, ""
    else:
        head, at = f"exceeds {bound:g} mm", metrics.get("max_tip_error_at_s")
        figures[1] += "" if at is None else f" at {at:.4g} s"
    text = f"{stopped}{head}: {', '.join([*figures, *_motors(metrics)])}{doubt}"
    return Verdict(Judgement.WITHIN if within else Judgement.EXCEEDS, text, bound, count)


def _motors(metrics: Mapping[str, float | None]) -> list[str]:
    """Return how much of the motors is used, in words; nothing where that is not known."""
    saturated, used = (
        METRICS[name].shown_value(metrics.get(name)) for name in ("saturated_fraction", "motor_use_fraction")
    )
    if saturated:
        return [f"motors at their limits {_figure(saturated)} % of the time"]
    return [] if used is None else [f"motors at {_figure(used)} %"]


def _length(value: float, bound: float) -> str:
    """Write a length [mm] with so many digits that it is on the same side of the bound as written."""
    digits = DIGITS
    while digits < MOST_DIGITS and (float(_figure(value, digits)) <= bound) != (value <= bound):
        digits += 1
    return f"{_figure(value, digits)} mm"


def _figure(value: float, digits: int = DIGITS) -> str:
    """Write a figure with so many significant digits, zeros at the end among them."""
    text = f"{value:#.{digits}g}"
    if "e" in text:
        return f"{value:.0f}" if 1.0 <= abs(value) < 1e5 else f"{value:.{digits}g}"
    return text.rstrip(".")
