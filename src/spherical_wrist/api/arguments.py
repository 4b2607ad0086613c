"""Arguments that the functions share: laws, experiments and progress in the ways in which people write them."""

import sys
from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple, Self

from spherical_wrist.comparison.law_selection import Laws, law_text, laws_from_texts, named_law
from spherical_wrist.control import Law
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.command import law_address
from spherical_wrist.experiment.description import Experiment, read_toml, with_changes
from spherical_wrist.experiment.presets import with_hardware
from spherical_wrist.experiment.values import LawGiven, Table

LawsGiven = LawGiven | Sequence[LawGiven] | Mapping[str, LawGiven]
"""Laws: one, a list, or a table of laws by label."""

ExperimentGiven = Experiment | Table | str | PathLike[str]
"""An experiment, values of its parameters, or an experiment file."""

ProgressGiven = bool | Callable[[int, int], None]
"""True for a line on the error stream, or a function of what is done and of the total."""


class Arguments(NamedTuple):
    """Arguments that the functions for several laws share, checked.

    Attributes:
        laws: laws by label.
        tables: values of the experiment that are given.
        changes: parameters of the experiment that replace its own.
        progress: function of what is done and of the total.
    """

    laws: Laws
    tables: dict[str, Any]
    changes: dict[str, Any]
    progress: Callable[[int, int], None]

    @classmethod
    def of(
        cls,
        laws: LawsGiven | None,
        experiment: ExperimentGiven | None,
        changes: Mapping[str, Any],
        progress: ProgressGiven | None,
        doing: str,
    ) -> Self:
        """Check arguments as a caller writes them.

        Args:
            laws: laws; None for all of the package.
            experiment: experiment; None for the default one.
            changes: parameters of the experiment that replace its own.
            progress: see :func:`counter`.
            doing: word for the work.

        Raises:
            WristError: a law or a parameter is not valid.
        """
        tables = tables_of(experiment)
        return cls(laws_of(laws, tables), tables, changes_of(changes), counter(progress, doing))


def laws_of(given: LawsGiven | None, tables: Mapping[str, Any]) -> Laws:
    """Return laws by label.

    Args:
        given: laws; None for all of the package, and that of the experiment if it is another one.
        tables: the experiment.

    Raises:
        WristError: a law is not valid, or two have the same label.
    """
    if given is None:
        return laws_from_texts([], tables, {})
    if isinstance(given, Mapping):
        labelled = {str(label): next(iter(_labelled(law).values())) for label, law in given.items()}
        return _not_empty(labelled)
    several = list(given) if isinstance(given, Sequence) and not isinstance(given, str) else [given]
    laws: Laws = {}
    for each in several:
        for label, law in _labelled(each).items():
            if label in laws:
                raise ParameterError(
                    f"law {label!r} is given twice: give a table of laws by label, such as {{'mine': ...}}"
                )
            laws[label] = law
    return _not_empty(laws)


def law_of(given: LawGiven) -> Law:
    """Return one law.

    Raises:
        WristError: it is not valid.
    """
    return next(iter(_labelled(given).values()))


def _labelled(given: Any) -> Laws:
    """Return a law by its label: its text, that before ``=`` in ``mine=my.py:Law``, or name and unusual parameters."""
    if isinstance(given, str):
        return dict([named_law(given)])
    law: Law = Law.resolve(given, default="")
    return {law_text(law, law.name) or law.name: law}


def _not_empty(laws: Laws) -> Laws:
    if not laws:
        raise ParameterError("no law is given: give one or more, or None for all of the package")
    return laws


def law_table(law: Law) -> dict[str, Any]:
    """Return a law as a table that any process reads: its name or file, and its parameters.

    Raises:
        ParameterError: it is defined where no other process finds it, such as in a notebook.
    """
    return {**law.model_dump(mode="json"), "name": law_address(type(law))}


def tables_of(given: ExperimentGiven | None) -> dict[str, Any]:
    """Return the values of an experiment by parameter; those that are not given are not among them.

    Raises:
        ParameterError: it is no experiment.
    """
    if given is None:
        return {}
    if isinstance(given, Experiment):
        return dict(given)
    if isinstance(given, Mapping):
        return with_changes({}, with_hardware(given))
    if isinstance(given, str | PathLike):
        return with_hardware(read_toml(Path(given)))
    raise ParameterError(f"experiment = {given!r}: an Experiment, a table of its values, or a TOML file is needed")


def changes_of(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return keywords that are parameters of an experiment, as changes of one.

    Raises:
        ParameterError: one of them is the law, or the hardware is unknown.
    """
    if "law" in values:
        raise ParameterError(f"law = {values['law']!r}: laws are the first argument, one or a list of them")
    return with_hardware(values)


def counter(given: ProgressGiven | None, doing: str) -> Callable[[int, int], None]:
    """Return a progress function of the numbers of finished and of all runs.

    Args:
        given: such a function, True for a line on the error stream, or nothing.
        doing: word for the work.
    """
    if callable(given):
        return given
    return _line(doing) if given else lambda done, total: None


def _line(doing: str) -> Callable[[int, int], None]:
    def show(done: int, total: int) -> None:
        """Write over the line, in a terminal and in a notebook alike."""
        print(f"\r{doing}: {done} of {total}", end="\n" if done >= total else "", file=sys.stderr, flush=True)

    return show
