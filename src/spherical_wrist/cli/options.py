"""Options that several commands share, and those of an experiment's parameters."""

from collections.abc import Callable, Mapping
from functools import wraps
from inspect import Parameter, signature
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from spherical_wrist.cli import completion
from spherical_wrist.experiment.options import OPTIONS, ParameterOption

Command = Callable[..., Any]
Changes = Mapping[str, Any]
"""Values of an experiment's parameters that were given as options, keyed by dotted name."""

ExperimentFile = Annotated[
    Path | None, Argument(metavar="EXPERIMENT.toml", help="experiment that the cases change [the default one]")
]
RecordingFile = Annotated[
    Path, Argument(metavar="FILE.rrd", help="recording made by wrist run", autocompletion=completion.recordings)
]
Json = Annotated[bool, Option("--json", help="print one JSON object and nothing else")]
Laws = Annotated[
    list[str] | None,
    Option(
        "--law",
        metavar="LAW",
        help="'NAME', 'NAME PARAMETER=VALUE ...', path/to/file.py:Name, or an experiment file; with a name of its own: "
        "'mine=my.py:Law'; may be repeated [all]",
        autocompletion=completion.laws,
    ),
]
Hardware = Annotated[
    str | None,
    Option(
        metavar="NAME",
        help="sensors, motors and friction: ideal or realistic [ideal]",
        autocompletion=completion.hardware,
    ),
]
Settings = Annotated[
    list[str] | None,
    Option(
        "--set",
        metavar="NAME=VALUE",
        help="any parameter of the experiment, such as law.K=0.02; may be repeated (see wrist list)",
        autocompletion=completion.settings,
    ),
]
CaseNames = Annotated[
    list[str] | None, Option("--case", metavar="NAME", help="case of the suite; may be repeated [all]")
]
CaseFile = Annotated[Path | None, Option("--cases", metavar="FILE.toml", help="a suite of your own: tables [[case]]")]
Plots = Annotated[
    list[Path] | None, Option("--plot", metavar="OUT.png|.svg|.pdf|.pgf", help="draw a picture of it; may be repeated")
]
Tables = Annotated[
    list[Path] | None,
    Option("--table", metavar="OUT.tex|.md|.csv", help="write the table: LaTeX, Markdown or CSV; may be repeated"),
]
Width = Annotated[
    str | None,
    Option("--width", metavar="WIDTH", help="of the picture: one-column, two-column, or 88mm or 3.5in [two-column]"),
]
Bound = Annotated[float, Option("--bound", metavar="MM", help="bound on the tip error")]
Folder = Annotated[Path | None, Option("--output", "-o", metavar="DIR", help="folder to write to [write nothing]")]
Seeds = Annotated[
    int | None, Option("--seeds", metavar="N", help="runs of a case in which something is random, with N seeds [3]")
]
Jobs = Annotated[int | None, Option("--jobs", metavar="N", help="runs at a time [one per core]")]


def with_hardware(hardware: str | None, changes: Changes) -> Changes:
    """Return the values of a kind of hardware, and the given ones, which take precedence.

    Raises:
        UnknownNameError: the hardware is unknown.
    """
    from spherical_wrist.experiment.presets import hardware as preset

    given = {**(preset(hardware) if hardware is not None else {}), **changes}
    if "disturbance.level" in given:
        given["disturbance.amplitude"] = None  # a level takes the place of a torque
    return given


def with_parameters(*names: str) -> Callable[[Command], Command]:
    """Mark a command whose argument ``changes`` stands for options of an experiment's parameters.

    All arguments of the command are keyword-only. It gets the values that are given, keyed by dotted name.

    Args:
        *names: dotted names of the parameters; all that have an option if none is given.
    """

    def mark(command: Command) -> Command:
        chosen = [option for option in OPTIONS if not names or option.parameter in names]
        command.parameter_options = chosen  # type: ignore[attr-defined]
        return command

    return mark


def with_options(command: Command) -> Command:
    """Return a command whose argument ``changes`` is replaced by the options that :func:`with_parameters` marked."""
    chosen: list[ParameterOption] | None = getattr(command, "parameter_options", None)
    if chosen is None:
        return command

    @wraps(command)
    def called(**values: Any) -> Any:
        given = {option.parameter: values.pop(option.name) for option in chosen}
        if given.get("law") is not None:
            from spherical_wrist.comparison.law_selection import law_value

            given["law"] = law_value(given["law"])
        return command(**values, changes={name: value for name, value in given.items() if value is not None})

    arguments = list(signature(command, eval_str=True).parameters.values())
    place = next(place for place, argument in enumerate(arguments) if argument.name == "changes")
    arguments[place : place + 1] = map(_argument, chosen)
    called.__signature__ = signature(command).replace(parameters=arguments)  # type: ignore[attr-defined]
    return called


def _argument(option: ParameterOption) -> Parameter:
    """Create the argument of a function for an option; :class:`~spherical_wrist.cli.app.Command` adds its help."""
    complete = completion.members(option.part) if option.type is str else None
    declared = Option(option.flag, metavar=option.metavar, autocompletion=complete, parser=option.parse)
    return Parameter(
        option.name,
        Parameter.KEYWORD_ONLY,
        default=None,
        annotation=Annotated[option.type | None, declared],
    )
