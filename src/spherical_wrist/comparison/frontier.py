"""Robustness frontier: deviation from the nominal wrist up to which a law holds a bound on its tip error, by axis."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from spherical_wrist.comparison.crossing import Crossing, first_crossing
from spherical_wrist.comparison.law_selection import Laws
from spherical_wrist.errors import ParameterError, UnknownNameError
from spherical_wrist.experiment.description import Experiment, with_changes
from spherical_wrist.files import make_folder
from spherical_wrist.loop.outcome import Status
from spherical_wrist.simulation.runner import Progress, Runner, Worker, ignore_progress

BOUND = 0.1
"""Tip error [mm] that is typically required on coronary arteries of 2–3 mm (Bachta et al., IEEE T-RO 27(4), 2011)."""

NOMINAL_PLANT: Mapping[str, Any] = {"disturbance": {"level": 0.0}, "mass_scale": 1.0}
"""Default experiment of a frontier: a plant that equals the nominal wrist."""


class Axis(NamedTuple):
    """Parameter along which the wrist deviates from the nominal one.

    Attributes:
        name: short name.
        meaning: description in a sentence.
        parameter: parameter of the experiment that is varied.
        unit: unit of that parameter.
        nominal: value of the nominal wrist.
        first: first deviation that is tested.
        limit: largest deviation.
        shown: factor for display, and the display unit.
        changes: function from a value to changes of the experiment by dotted name.
    """

    name: str
    meaning: str
    parameter: str
    unit: str
    nominal: float
    first: float
    limit: float
    shown: tuple[float, str]
    changes: Callable[[float], Mapping[str, Any]]

    def value(self, deviation: float) -> float:
        """Return the value of the parameter at a deviation from the nominal, rounded to six digits."""
        return float(f"{self.nominal + deviation:.6g}")


AXES = (
    Axis("mass", "scale of the plant's mass and inertia", "mass_scale", "", 1.0, 0.02, 9.0, (1.0, "×"),
         lambda value: {"mass_scale": value}),
    Axis("com", "shift of its centres of mass to the side", "com_shift (x)", "m", 0.0, 1e-4, 0.1, (1e3, "mm"),
         lambda value: {"com_shift": (value, 0.0, 0.0)}),
    Axis("disturbance", "size, as a share of the peak nominal torque", "disturbance.level", "", 0.0, 0.02, 20.0,
         (100.0, "%"), lambda value: {"disturbance.level": value, "disturbance.amplitude": None}),
    Axis("delay", "age of the samples", "sensing.delay", "s", 0.0, 2e-4, 0.05, (1e3, "ms"),
         lambda value: {"sensing.delay": value}),
    Axis("noise", "attitude noise, per axis and sample", "sensing.attitude_noise", "rad", 0.0, 1e-5, 0.1,
         (1e3, "mrad"), lambda value: {"sensing.attitude_noise": value}),
)  # fmt: skip


class Edge(NamedTuple):
    """First miss of the bound by a law along an axis.

    Attributes:
        law: label of the law.
        axis: axis of the deviation.
        crossing: crossing, in deviations of the parameter from its nominal value.
        experiment: experiment at the first miss; at the limit if there is none.
    """

    law: str
    axis: Axis
    crossing: Crossing
    experiment: Experiment

    @property
    def holds(self) -> float | None:
        """Largest tested value below the first miss; None if the nominal misses."""
        return None if self.crossing.holds is None else self.axis.value(self.crossing.holds)

    @property
    def misses(self) -> float | None:
        """Smallest value that missed; None if none missed."""
        return None if self.crossing.misses is None else self.axis.value(self.crossing.misses)


def chosen_axes(names: Iterable[str]) -> tuple[Axis, ...]:
    """Return the axes with these names; all axes if no name is given.

    Raises:
        UnknownNameError: a name is unknown.
    """
    known = {axis.name: axis for axis in AXES}
    wanted = tuple(dict.fromkeys(names))
    for name in wanted:
        if name not in known:
            raise UnknownNameError("axis", name, known)
    return tuple(known[name] for name in wanted) or AXES


def frontier(
    laws: Laws,
    axes: Sequence[Axis],
    tables: Mapping[str, Any],
    changes: Mapping[str, Any],
    *,
    bound: float = BOUND,
    tolerance: float = 0.02,
    folder: Path | None = None,
    jobs: int | None = None,
    progress: Progress = ignore_progress,
) -> list[Edge]:
    """Find the first deviation at which the largest tip error of the steady window exceeds a bound, by law and axis.

    Only the parameter of the axis is varied. The search is :func:`.first_crossing`, with its guarantees; a run that
    diverges is a miss. All runs of a search use the same random numbers, so that only the size of the noise changes.

    Args:
        laws: laws by label.
        axes: axes.
        tables: experiment as plain tables, applied to ``NOMINAL_PLANT``.
        changes: values by dotted name that override both. Those of laws are ignored, as ``laws`` has them already.
        bound: largest tip error [mm].
        tolerance: relative tolerance of the crossings.
        folder: folder for results, created before anything is simulated.
        jobs: number of threads; None for the number of cores.
        progress: called with the number of finished searches and their total.

    Returns:
        The first misses, ordered by law, then by axis.

    Raises:
        WristError: the experiment is not valid, or a law raises.
    """
    if not bound > 0.0:
        raise ParameterError(f"bound = {bound:g} mm: must be greater than 0")
    shared = {name: value for name, value in changes.items() if not name.startswith("law.")}
    base = with_changes({**NOMINAL_PLANT, **tables}, shared)

    def at(law: str, axis: Axis, deviation: float) -> Experiment:
        return Experiment(**with_changes(base, {**axis.changes(axis.value(deviation)), "law": laws[law]}))

    def search(item: tuple[str, Axis], worker: Worker) -> Edge:
        law, axis = item

        def holds(deviation: float) -> bool:
            run = worker.measure(at(law, axis, deviation))
            error = run.metrics.max_tip_error_mm
            return run.outcome.status is Status.COMPLETED and error is not None and error <= bound

        crossing = first_crossing(holds, axis.first, axis.limit, tolerance)
        end = axis.limit if crossing.misses is None else crossing.misses
        return Edge(law, axis, crossing, at(law, axis, end))

    work = [(law, axis) for law in laws for axis in axes]
    for law, axis in work:
        at(law, axis, 0.0)  # raises for invalid parameters before anything runs
    if folder is not None:
        make_folder(folder)
    # threads begin with different laws, which are compiled once each
    order = sorted(range(len(work)), key=lambda index: (index % len(axes), index))
    edges = Runner(jobs).map(search, [work[index] for index in order], progress)
    return [edge for _, edge in sorted(zip(order, edges, strict=True), key=lambda pair: pair[0])]
