"""How far from the nominal wrist a law holds a bound on its tip error, along one axis at a time."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from spherical_wrist.comparison.contestants import Laws
from spherical_wrist.comparison.crossing import Crossing, first_crossing
from spherical_wrist.comparison.threads import Progress, Simulate, in_threads
from spherical_wrist.errors import ParameterError, UnknownNameError
from spherical_wrist.experiment.description import Experiment, with_changes
from spherical_wrist.files import make_folder
from spherical_wrist.simulation.outcome import Status

BOUND = 0.1
"""Tip error [mm] that is typically needed on coronary arteries of 2–3 mm (Bachta et al., IEEE T-RO 27(4), 2011)."""

PERFECT: Mapping[str, Any] = {"disturbance": {"level": 0.0}, "mass_scale": 1.0}
"""What the experiment is where nothing else is said: a plant as the controller believes it to be."""


class Axis(NamedTuple):
    """A way in which the wrist may differ from the nominal one.

    Attributes:
        name: short.
        meaning: in a sentence.
        parameter: of the experiment that is varied.
        unit: of that parameter.
        nominal: its value for a wrist that does not differ.
        first: the first deviation from it that is tried.
        limit: the largest.
        shown: what values are multiplied by for people, and the unit that they are in then.
        changes: parameters of the experiment by dotted name, of a value.
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
        """The parameter at a deviation from the nominal, to as many digits as a search is worth."""
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
    """Where a law first misses the bound along an axis.

    Attributes:
        law: the law's label.
        axis: the axis.
        crossing: in deviations of the parameter from its nominal.
        experiment: at the first miss; at the limit where there is none.
    """

    law: str
    axis: Axis
    crossing: Crossing
    experiment: Experiment

    @property
    def holds(self) -> float | None:
        """The largest value tested below the first miss; None where the nominal misses."""
        return None if self.crossing.holds is None else self.axis.value(self.crossing.holds)

    @property
    def misses(self) -> float | None:
        """The smallest value that was seen to miss; None where none was."""
        return None if self.crossing.misses is None else self.axis.value(self.crossing.misses)


def chosen_axes(names: Iterable[str]) -> tuple[Axis, ...]:
    """The axes with these names; all of them where no name is given.

    Raises:
        UnknownNameError: there is no such axis.
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
    progress: Progress = lambda done, total: None,
) -> list[Edge]:
    """For every law and axis, where the largest tip error of the steady window first exceeds a bound.

    Along an axis everything else is as the experiment says. The search is that of :func:`.first_crossing`, with what it
    guarantees; a run that diverges is a miss. All runs of a search draw the same random numbers, so that noise grows
    and does not change.

    Args:
        laws: the laws, by label.
        axes: the axes.
        tables: the experiment as plain tables, on top of ``PERFECT``.
        changes: values by dotted name that take the place of those; those of laws are ``laws``' own business.
        bound: largest tip error [mm].
        tolerance: relative tolerance of the crossings.
        folder: made, where there is none, before anything is simulated.
        jobs: threads; None for as many as there are cores.
        progress: told what is done.

    Returns:
        Law by law, axis by axis.

    Raises:
        WristError: the experiment is not valid, or a law raises.
    """
    if not bound > 0.0:
        raise ParameterError(f"bound = {bound:g} mm: must be greater than 0")
    shared = {name: value for name, value in changes.items() if not name.startswith("law.")}
    base = with_changes({**PERFECT, **tables}, shared)

    def at(law: str, axis: Axis, deviation: float) -> Experiment:
        return Experiment(**with_changes(base, {**axis.changes(axis.value(deviation)), "law": laws[law]}))

    def search(item: tuple[str, Axis], simulate: Simulate) -> Edge:
        law, axis = item

        def holds(deviation: float) -> bool:
            run = simulate(at(law, axis, deviation), False)
            error = run.metrics.max_tip_error_mm
            return run.outcome.status is Status.COMPLETED and error is not None and error <= bound

        crossing = first_crossing(holds, axis.first, axis.limit, tolerance)
        end = axis.limit if crossing.misses is None else crossing.misses
        return Edge(law, axis, crossing, at(law, axis, end))

    work = [(law, axis) for law in laws for axis in axes]
    for law, axis in work:
        at(law, axis, 0.0)  # what is not valid is told before anything runs
    if folder is not None:
        make_folder(folder)
    # threads begin with different laws, each to be compiled once
    order = sorted(range(len(work)), key=lambda index: (index % len(axes), index))
    found = in_threads(search, [work[index] for index in order], jobs, progress)
    return [edge for _, edge in sorted(zip(order, found, strict=True), key=lambda pair: pair[0])]
