"""``sw.compare``: laws on cases."""

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Unpack

from spherical_wrist.api.arguments import Arguments, ExperimentGiven, LawsGiven, ProgressGiven
from spherical_wrist.comparison.cases import DEFAULT, Case, read_cases, select
from spherical_wrist.comparison.compare import SEEDS
from spherical_wrist.comparison.compare import compare as compare_laws
from spherical_wrist.comparison.results import Comparison
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.presets import with_hardware
from spherical_wrist.experiment.values import Conditions

CasesGiven = str | PathLike[str] | Sequence[str | Case] | Mapping[str, Mapping[str, Any]]
"""Cases: ``"default"``, a file, names of the default suite, or tables of changed parameters by name."""


def compare(
    laws: LawsGiven | None = None,
    *,
    cases: CasesGiven = "default",
    experiment: ExperimentGiven | None = None,
    seeds: int = SEEDS,
    record: str | Sequence[str] = (),
    folder: str | PathLike[str] | None = None,
    jobs: int | None = None,
    progress: ProgressGiven | None = None,
    **changes: Unpack[Conditions],
) -> Comparison:
    """Run every law on every case, and plain computed torque as the baseline.

    Args:
        laws: laws; by default all of the package.
        cases: ``"default"`` for the suite of the package, the name of one of its cases or a list of names, a file of
            cases, or a table of changed parameters by name, such as ``{"late": {"sensing.delay": 0.002}}``.
        experiment: experiment that the cases change; by default the default experiment.
        seeds: number of seeds with which a case is run in which something is random; the others are run once.
        record: patterns ``LAW:CASE``, with ``*`` and ``?``, of the runs to record; ``"all"`` for every run.
        folder: folder for recordings.
        jobs: number of threads; by default one for each core.
        progress: True for a line on the error stream, or a function of the finished runs and of all.
        **changes: parameters of the experiment that override those of the cases; ``hardware="realistic"``.

    Raises:
        WristError: a law, a case or a parameter is not valid, a law raises, or a recording cannot be written.
    """
    given = Arguments.of(laws, experiment, changes, progress, "comparing")
    return compare_laws(
        given.laws,
        _cases(cases),
        given.tables,
        given.changes,
        seeds=seeds,
        record=[record] if isinstance(record, str) else record,
        folder=None if folder is None else Path(folder),
        jobs=jobs,
        progress=given.progress,
    )


def _cases(given: CasesGiven) -> tuple[Case, ...]:
    if isinstance(given, str) and given == "default":
        return DEFAULT
    if isinstance(given, PathLike) or (isinstance(given, str) and given.endswith(".toml")):
        return read_cases(Path(given))
    if isinstance(given, Mapping):
        return tuple(Case(str(name), "", with_hardware(values)) for name, values in given.items())
    several = [given] if isinstance(given, str) else list(given)
    if not several:
        raise ParameterError("no case is given: give one or more, or cases = 'default'")
    return tuple(each if isinstance(each, Case) else select(DEFAULT, [each])[0] for each in several)
