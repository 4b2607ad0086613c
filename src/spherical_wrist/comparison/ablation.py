"""Ablation of a law: its figures with each of its parts switched off in turn.

A law declares its parts as ``ablations``: for each, the parameters that switch it off.
"""

from collections.abc import Callable, Mapping
from itertools import product
from math import inf
from typing import Any, NamedTuple

from spherical_wrist.comparison.law_selection import BASELINE
from spherical_wrist.control import Law
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.description import Experiment, with_changes
from spherical_wrist.experiment.presets import hardware
from spherical_wrist.loop.outcome import Status
from spherical_wrist.measure.metrics import Metrics
from spherical_wrist.prepare.needed_torque import needed_variation
from spherical_wrist.simulation.runner import Progress, Runner, Worker, ignore_progress

WHOLE = "whole law"
CALM = 2.0
"""Chattering, over the variation of the torque that the plant needs, beyond which a loop with an unknown delay is no
longer stable."""
STEP, MOST = 0.25e-3, 4e-3
"""Unknown delays that are tried [s]: multiples of the step, up to the largest."""


class Bench(NamedTuple):
    """Experiment that the figures of an ablation change, and the worker that runs it.

    Attributes:
        base: experiment as plain tables.
        worker: worker of this thread.
    """

    base: Mapping[str, Any]
    worker: Worker

    def experiment(self, law: Law, changes: Mapping[str, Any]) -> Experiment:
        """Return the experiment with changes by dotted name."""
        return Experiment(**with_changes(self.base, {**changes, "law": law}))

    def metrics(self, law: Law, changes: Mapping[str, Any]) -> Metrics | None:
        """Run the experiment with changes by dotted name; return None if the run was lost."""
        result = self.worker.measure(self.experiment(law, changes))
        return result.metrics if result.outcome.status is Status.COMPLETED else None


class FigureOfMerit(NamedTuple):
    """Figure of merit of an ablation; less is better unless ``more`` is set.

    Attributes:
        name: key in JSON.
        label: short heading, for the terminal.
        title: heading of tables and pictures.
        unit: its unit.
        compute: function of a law and the bench that it is run on; None if a run was lost.
        more: more is better.
    """

    name: str
    label: str
    title: str
    unit: str
    compute: Callable[[Law, Bench], float | None]
    more: bool = False


def _figure(metrics: Metrics | None, name: str, factor: float = 1.0) -> float | None:
    value = None if metrics is None else metrics[name]
    return None if value is None else factor * value


def _realistic(law: Law, bench: Bench) -> float | None:
    return _figure(bench.metrics(law, hardware("realistic")), "rms_tip_error_mm", 1e3)


def _chattering(law: Law, bench: Bench) -> float | None:
    own, plain = (
        _figure(bench.metrics(each, hardware("realistic")), "chattering_Nm_per_s") for each in (law, BASELINE)
    )
    return None if own is None or plain is None else own / plain


def _slow(law: Law, bench: Bench) -> float | None:
    cases = product(("constant", "sinusoid"), (0.75, 1.0, 1.25))
    found = [
        _figure(bench.metrics(law, {"disturbance.name": shape, "mass_scale": mass}), "rms_error_rad")
        for shape, mass in cases
    ]
    errors = [error for error in found if error is not None]
    return max(errors) if len(errors) == len(found) else None


def _peak(shape: str) -> Callable[[Law, Bench], float | None]:
    def compute(law: Law, bench: Bench) -> float | None:
        return _figure(bench.metrics(law, {"disturbance.name": shape}), "max_tip_error_mm", 1e3)

    return compute


def _delay(mass: float) -> Callable[[Law, Bench], float | None]:
    def restless(law: Law, bench: Bench, delay: float) -> float:
        late = {"mass_scale": mass, "sensing.delay": delay, "sensing.timestamped": False, "duration": 5.0}
        found = _figure(bench.metrics(law, late), "chattering_Nm_per_s")
        return inf if found is None else found / needed_variation(bench.experiment(law, late), bench.worker.cache)

    def compute(law: Law, bench: Bench) -> float | None:
        most = None
        for step in range(round(MOST / STEP) + 1):
            if restless(law, bench, step * STEP) > CALM:
                break
            most = 1e3 * step * STEP
        return most

    return compute


FIGURES = (
    FigureOfMerit("realistic_tip_um", "tip,\nreal", "tip error, realistic", "µm", _realistic),
    FigureOfMerit("realistic_chattering", "chatter,\nreal", "chattering, realistic", "×", _chattering),
    FigureOfMerit("slow_error_rad", "slow\ntorque", "attitude error, slow torque", "rad", _slow),
    FigureOfMerit("worst_tip_um", "worst\ntorque", "tip error, worst torque", "µm", _peak("worst")),
    FigureOfMerit("square_tip_um", "square\nwave", "tip error, square torque", "µm", _peak("square")),
    FigureOfMerit("light_delay_ms", "delay,\nm × 0.5", "delay, m × 0.5", "ms", _delay(0.5), more=True),
    FigureOfMerit("right_delay_ms", "delay,\nm × 1", "delay, m × 1", "ms", _delay(1.0), more=True),
)
"""Figures of an ablation.

RMS tip error on realistic hardware; chattering there, over that of plain computed torque; the largest RMS attitude
error under constant and 1 Hz torques of 25 % at 0.75 to 1.25 of the mass; the largest tip error under the worst torque
within 25 %, built for each law, and under a square wave; the largest delay of the samples that nobody knows of with
which the loop stays calm.
"""


def variant(part: str) -> str:
    """Return the law without a part in words; the whole law for ``WHOLE``."""
    return part if part == WHOLE else f"without {part}"


def ablation(
    law: Law,
    base: Mapping[str, Any] | None = None,
    *,
    jobs: int | None = None,
    progress: Progress = ignore_progress,
) -> dict[str, dict[str, Any]]:
    """Compute every figure of a law, whole and without each of its parts.

    Args:
        law: a law that declares its parts.
        base: experiment as plain tables, whose hardware, masses and torques the figures change; by default the default
            experiment.
        jobs: number of threads; None for the number of cores.
        progress: called with the number of finished figures and their total.

    Returns:
        The figures by name, for ``WHOLE`` and for each part; None where a run was lost.

    Raises:
        ParameterError: the law declares no parts.
    """
    if not law.ablations:
        known = [name for name, member in Law.members.items() if issubclass(member, Law) and member.ablations]
        raise ParameterError(
            f"law {law.name!r} declares no parts to switch off (valid: {', '.join(known)}); a law of your own declares "
            "them as ablations = {part: {parameter: value}}"
        )
    variants = {WHOLE: law, **{part: law.replaced(**changes) for part, changes in law.ablations.items()}}
    work = [(name, figure) for name in variants for figure in FIGURES]

    def compute(item: tuple[str, FigureOfMerit], worker: Worker) -> float | None:
        name, figure = item
        return figure.compute(variants[name], Bench(base or {}, worker))

    found = Runner(jobs).map(compute, work, progress, lambda item: f"{item[1].title}, {variant(item[0])}")
    table: dict[str, dict[str, Any]] = {name: {} for name in variants}
    for (name, figure), value in zip(work, found, strict=True):
        table[name][figure.name] = value
    return table
