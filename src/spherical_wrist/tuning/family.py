"""Perturbed wrists that gains are tuned for: cases of a comparison."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Self

from spherical_wrist.comparison.cases import DEFAULT, Case
from spherical_wrist.control import Law
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.description import Experiment, with_changes

PLANTS = (
    Case("constant-light", "constant torque of 25 %, plant a quarter lighter", {"mass_scale": 0.75}),
    Case("constant-heavy", "constant torque of 25 %, plant a quarter heavier", {"mass_scale": 1.25}),
    Case("sinusoid-right", "sinusoidal torque of 25 % at 1 Hz", {"disturbance.name": "sinusoid", "mass_scale": 1.0}),
)
"""Default cases with ideal hardware: wrong masses and torques alone."""
USUAL = ("realistic", "realistic-heart", "realistic-suture")
"""Default cases of the suite of comparisons: with every fault of sensors and motors.

With ideal sensors alone, nothing would limit the gains."""


class Family(NamedTuple):
    """Experiments of a tuning: the same law on different wrists.

    Attributes:
        cases: in their order.
        base: the experiment that they change.
        experiments: one for each case; their law does not count.
        bound: largest tip error [mm] that counts as completed; None for any.
    """

    cases: tuple[Case, ...]
    base: Experiment
    experiments: tuple[Experiment, ...]
    bound: float | None = None

    @classmethod
    def of(
        cls,
        cases: Sequence[Case],
        law: Law,
        tables: Mapping[str, Any],
        changes: Mapping[str, Any],
        bound: float | None = None,
    ) -> Self:
        """Create a family from cases.

        Args:
            cases: the cases.
            law: law of all experiments.
            tables: the experiment that the cases change, as plain tables; its law does not count.
            changes: values by dotted name that override both.
            bound: largest tip error [mm] that counts as completed; None for any.

        Raises:
            ParameterError: a case is not valid, two of them are the same, or the bound is not positive.
        """
        if bound is not None and not bound > 0.0:
            raise ParameterError(f"--bound {bound:g} [mm]: must be greater than 0")
        everywhere = {**changes, "law": law}
        bare = {name: value for name, value in tables.items() if name != "law"}
        base = Experiment(**with_changes(bare, everywhere))
        experiments = tuple(case.experiment(bare, everywhere) for case in cases)
        for position, experiment in enumerate(experiments):
            if experiment in experiments[:position]:
                first = cases[experiments.index(experiment)].name
                raise ParameterError(f"cases {first!r} and {cases[position].name!r} are the same with these settings")
        return cls(tuple(cases), base, experiments, bound)

    def summary(self) -> dict[str, Any]:
        """Return every experiment without its law as plain data, by the name of its case."""
        dumps = (experiment.model_dump(mode="json") for experiment in self.experiments)
        return {
            case.name: {name: value for name, value in dump.items() if name != "law"}
            for case, dump in zip(self.cases, dumps, strict=True)
        }


def usual() -> tuple[Case, ...]:
    """Return the default cases: ``PLANTS``, and those of the suite that ``USUAL`` names."""
    return (*PLANTS, *(case for case in DEFAULT if case.name in USUAL))
