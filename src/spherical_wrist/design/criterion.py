"""The criterion for gains: a table of constraints, and one objective. Both are all that a search looks at.

A candidate that meets every constraint beats one that does not; of two that do, the one with the smaller objective is
better; of two that do not, the one that misses by less (Deb, 2000, Comput. Methods Appl. Mech. Eng. 186:311).
"""

import hashlib
from collections.abc import Callable, Iterable
from functools import partial
from math import inf, isfinite
from typing import NamedTuple

from spherical_wrist.comparison.ranking import SMALLEST, geometric_mean
from spherical_wrist.control import Law
from spherical_wrist.design.trial import (
    IDEAL,
    LATE,
    MASSES,
    REALISTIC,
    VERY_LATE,
    Changes,
    DesignTrial,
    unknown_delay,
)
from spherical_wrist.measure.metrics import Metrics
from spherical_wrist.simulation.runner import Worker


class Constraint(NamedTuple):
    """One constraint.

    Attributes:
        name: its name, in JSON and in the ``exempt`` of a law.
        heading: heading in tables.
        unit: unit of limit and value.
        limit: limit.
        at_least: True if the value must not be below the limit; False if it must not be above.
        meaning: what is measured, and why so much is asked for.
        measure: value of a trial; None if there is none, which breaks the constraint, infinite for no end.
        stage: constraints of a stage are measured in a search only if those of earlier ones are met.
        factor: factor from the unit to that of tables.
        shown_unit: unit of tables.
    """

    name: str
    heading: str
    unit: str
    limit: float
    at_least: bool
    meaning: str
    measure: Callable[[DesignTrial], float | None]
    stage: int
    factor: float = 1.0
    shown_unit: str = ""

    @property
    def column(self) -> str:
        """Heading of a column, with the unit of its entries."""
        return f"{self.heading}\n[{self.shown_unit}]" if self.shown_unit else self.heading

    def shown(self, value: float | None) -> float | None:
        """Return a value in the unit that tables have."""
        return None if value is None else self.factor * value

    def violation(self, value: float | None) -> float:
        """Return by how much a value misses the limit: 0 for not at all, up to 1."""
        if value is None:
            return 1.0
        if self.at_least:
            return max(0.0, 1.0 - max(value, 0.0) / self.limit)
        return 0.0 if value <= self.limit else 1.0 - self.limit / value


def _of_margins(
    name: str, hardware: tuple[Changes, ...], masses: tuple[float, ...], trial: DesignTrial
) -> float | None:
    """Return the worst of a margin over hardware and masses; for sensitivities, the largest."""
    found = [trial.margins(mass, changes) for changes in hardware for mass in masses]
    values = [None if each is None else getattr(each, name) for each in found]
    if None in found:
        return None
    known = [inf if value is None else float(value) for value in values]
    return max(known) if name.startswith("max_") else min(known)


def _worst(values: Iterable[float | None]) -> float | None:
    """Return the largest value; None if one is missing."""
    found = list(values)
    known = [value for value in found if value is not None]
    return max(known) if len(known) == len(found) else None


CALM: tuple[Changes, ...] = (
    *({"mass_scale": mass, **unknown_delay(1e-3 * mass)} for mass in MASSES),
    *({"mass_scale": mass, **VERY_LATE} for mass in MASSES),
    {"payload": 0.05, **LATE},
)
"""Runs in which a loop must not oscillate: unknown delays in proportion to the mass (half of it makes the loop twice as
fast), 1.5 ms of known delay with 1 ms of lag, and 50 g at the tip of a plant of 1.25 times the mass."""

SHORT = {"duration": 4.0}

CONSTRAINTS = (
    Constraint(
        "swing_back", "swing\nback", "", 0.1, False,
        "return from 0.07 rad at 0.5, 1 and 1.5 of the mass: largest error on the side of the start after the first "
        "crossing, over that of the start; 0.1 is a damping ratio of about 0.35",
        lambda trial: _worst(trial.swing_back(mass) for mass in MASSES), 0,
    ),
    Constraint(
        "restlessness", "rest-\nless", "", 1.1, False,
        "variation of the torque over that which the plant itself needs for the motion, on ideal sensors: the largest "
        "of delays unknown (1 ms times the mass scale), of 1.5 ms known with 1 ms of lag, and of 50 g at the tip; a "
        "loop that oscillates has many times of it",
        lambda trial: _worst(trial.restlessness({**changes, **SHORT}) for changes in CALM), 0,
    ),
    Constraint(
        "torque_step", "torque\nstep", "", 0.01, False,
        "chattering: mean change of the torque in a control period on realistic hardware, over the motors' limit",
        DesignTrial.torque_step, 0, 100.0, "%",
    ),
    Constraint(
        "max_sensitivity", "Ms", "", 2.0, False,
        "largest sensitivity at the plant's input, nominal mass, ideal hardware; 6 dB is the usual limit",
        partial(_of_margins, "max_sensitivity", (IDEAL,), (1.0,)), 1,
    ),
    Constraint(
        "max_sensitivity_late", "Ms\nlate", "", 2.35, False,
        "the same with 0.5 ms of delay and 0.5 ms of lag, which a controller knows and cannot undo",
        partial(_of_margins, "max_sensitivity", (LATE,), (1.0,)), 1,
    ),
    Constraint(
        "disk_margin", "disk", "", 0.5, True,
        "disk margin at the nominal mass, ideal and late: gain and phase of every axis at once",
        partial(_of_margins, "disk_margin", (IDEAL, LATE), (1.0,)), 1,
    ),
    Constraint(
        "gain_margin_db", "gain\nup", "dB", 3.0, True,
        "smallest gain margin at 0.5, 1 and 1.5 of the mass, late hardware",
        partial(_of_margins, "gain_margin_db", (LATE,), MASSES), 2, 1.0, "dB",
    ),
    Constraint(
        "gain_reduction_margin_db", "gain\ndown", "dB", 3.0, True,
        "smallest gain reduction margin there, of loops with an integral",
        partial(_of_margins, "gain_reduction_margin_db", (LATE,), MASSES), 2, 1.0, "dB",
    ),
    Constraint(
        "delay_margin_s", "delay", "s", 0.33e-3, True,
        "smallest delay margin there, on top of what is known: a third of a control period",
        partial(_of_margins, "delay_margin_s", (LATE,), MASSES), 2, 1e3, "ms",
    ),
)  # fmt: skip
"""Constraints, those of runs first. A law claims all of them, but for those that it declares as ``exempt``."""


class Figure(NamedTuple):
    """Figure of the objective; less is better.

    Attributes:
        name: its name in JSON.
        heading: heading in tables, with the unit.
        meaning: what is measured.
        measure: value of a trial; None if a run is lost.
    """

    name: str
    heading: str
    meaning: str
    measure: Callable[[DesignTrial], float | None]


def _figure(metric: str, factor: float, changes: Changes, trial: DesignTrial) -> float | None:
    found: Metrics | None = trial.metrics(changes)
    value = None if found is None else found[metric]
    return None if value is None else factor * float(value)


FIGURES = (
    Figure("constant_urad", "constant\n[µrad]", "RMS attitude error under a constant 25 %, ideal hardware",
           partial(_figure, "rms_error_rad", 1e6, SHORT)),
    Figure("square_urad", "square\n[µrad]", "the same under a square wave of 5 Hz",
           partial(_figure, "rms_error_rad", 1e6, {**SHORT, "disturbance.name": "square"})),
    Figure("realistic_urad", "realistic\n[µrad]", "RMS attitude error on realistic hardware, under a constant 25 %",
           partial(_figure, "rms_error_rad", 1e6, REALISTIC)),
    Figure("worst_um", "worst\n[µm]", "largest tip error by any torque within 25 %, by linear theory, at 0.5 to 1.5 of "
           "the mass, late hardware", lambda trial: _scaled(1e3, _worst(trial.worst_tip(m, LATE) for m in MASSES))),
    Figure("chattering_mNm_per_s", "chattering\n[mN·m/s]", "chattering on realistic hardware",
           partial(_figure, "chattering_Nm_per_s", 1e3, REALISTIC)),
)  # fmt: skip
"""Figures of which the objective is the geometric mean: precision, and the motion of the motors that it costs."""


def _scaled(factor: float, value: float | None) -> float | None:
    return None if value is None else factor * value


class Assessment(NamedTuple):
    """A law under the criterion.

    Attributes:
        constraints: value of each constraint by name, infinite for a margin without end, None if there is none.
        figures: figures of the objective by name.
        objective: geometric mean of the figures; None if one is missing.
    """

    constraints: dict[str, float | None]
    figures: dict[str, float | None]

    @property
    def objective(self) -> float | None:
        """Geometric mean of the figures; None if one is missing."""
        known = [max(value, SMALLEST) for value in self.figures.values() if value is not None and isfinite(value)]
        return geometric_mean(known) if len(known) == len(self.figures) else None

    def broken(self, law: Law) -> list[str]:
        """Return the names of the constraints that are not met, by the limits of the law."""
        return [each.name for each in constraints_of(law) if each.violation(self.constraints[each.name]) > 0.0]


def constraints_of(law: Law) -> tuple[Constraint, ...]:
    """Return the constraints with the tighter limits that a law promises."""
    return tuple(each._replace(limit=law.promises.get(each.name, each.limit)) for each in CONSTRAINTS)


def judge(law: Law, worker: Worker) -> Assessment:
    """Measure all constraints and the whole objective of a law."""
    trial = DesignTrial(law, worker)
    return Assessment(
        {each.name: each.measure(trial) for each in CONSTRAINTS}, {each.name: each.measure(trial) for each in FIGURES}
    )


INFEASIBLE = 1e6
"""Least cost of gains that break a constraint: above any objective."""


def cost(law: Law, worker: Worker) -> float:
    """Return the cost of a law for a search: its objective, or far more where it breaks a constraint that it claims.

    Of two stages, one that is broken earlier costs more, so that later ones need not be measured.
    """
    trial = DesignTrial(law, worker)
    claimed = [each for each in constraints_of(law) if each.name not in law.exempt]
    last = max(each.stage for each in CONSTRAINTS)
    for stage in range(last + 1):
        missed = sum(each.violation(each.measure(trial)) for each in claimed if each.stage == stage)
        if missed > 0.0:
            return INFEASIBLE * (1.0 + last - stage + missed / (1.0 + len(claimed)))
    objective = Assessment({}, {each.name: each.measure(trial) for each in FIGURES}).objective
    return INFEASIBLE if objective is None else min(objective, INFEASIBLE)


def fingerprint() -> str:
    """Return a digest of the criterion: limits, meanings and runs. Gains found by another one are to be found anew."""
    table = [(each.name, each.unit, each.limit, each.at_least, each.meaning) for each in CONSTRAINTS]
    figures = [(each.name, each.meaning) for each in FIGURES]
    text = repr((table, figures, CALM, SHORT, MASSES, IDEAL, LATE, VERY_LATE, REALISTIC))
    return hashlib.sha256(text.encode()).hexdigest()[:12]
