"""Options that several commands share, and those of an experiment's parameters."""

from collections.abc import Callable, Mapping
from functools import wraps
from inspect import Parameter, signature
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Context, Option

from spherical_wrist.cli import completion
from spherical_wrist.cli.streams import warned
from spherical_wrist.cli.verbosity import Quiet, StageLog, Verbose, set_verbosity
from spherical_wrist.experiment.options import OPTIONS, ParameterOption
from spherical_wrist.memory import memory_warning

Command = Callable[..., Any]
Changes = Mapping[str, Any]
"""Values of an experiment's parameters that were given as options, keyed by dotted name."""


def _check_place(context: Context, file: Path | None) -> Path | None:
    """Refuse a file that is no experiment file, and name the option that it belongs to."""
    if file is not None and file.suffix != ".toml":
        from spherical_wrist.cli.near_misses import misplaced_experiment

        if error := misplaced_experiment(file, context.command_path):
            raise error
    return file


ExperimentFile = Annotated[
    Path | None,
    Argument(
        metavar="EXPERIMENT.toml",
        help="experiment file, which options change [the default experiment]",
        callback=_check_place,
    ),
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


def read_experiment(
    file: Path | None, hardware: str | None, changes: Changes, settings: list[str] | None
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Read the experiment from the shared options.

    Returns:
        Tables of the experiment file on that hardware; and the values of options and ``--set``, keyed by dotted name,
        which take precedence over them and over everything else.

    Raises:
        ParameterError: the hardware is unknown, or a text or the file is not valid.
    """
    from spherical_wrist.experiment.command import read_settings
    from spherical_wrist.experiment.description import read_toml, with_changes
    from spherical_wrist.experiment.presets import hardware as preset

    tables = read_toml(file) if file is not None else {}
    tables = with_changes(tables, preset(hardware)) if hardware is not None else tables
    given = dict(changes)
    if "disturbance.level" in given:
        given["disturbance.amplitude"] = None  # a level takes the place of a torque
    return tables, {**given, **read_settings(settings or [])}


CONDITIONS = (
    "reference",
    "duration",
    "control_period",
    "seed",
    "model",
    "joint",
    "hinges",
    "motors",
    "tip",
)
"""Parameters with an option on every command that runs something: none that its cases or axes vary themselves."""


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
    """Return a command with --quiet and --verbose.

    Its argument ``changes`` is replaced by the options that :func:`with_parameters` marked.
    """
    chosen: list[ParameterOption] = getattr(command, "parameter_options", [])
    arguments = list(signature(command, eval_str=True).parameters.values())

    @wraps(command)
    def called(**values: Any) -> Any:
        set_verbosity(quiet=values.pop("quiet"), verbose=values.pop("verbose"))
        if warning := memory_warning():  # before the libraries that it is about are loaded
            warned(warning)
        if chosen:
            given = {option.parameter: values.pop(option.name) for option in chosen}
            if given.get("law") is not None:
                from spherical_wrist.comparison.law_selection import law_value

                given["law"] = law_value(given["law"])
            values["changes"] = {name: value for name, value in given.items() if value is not None}
        with StageLog():
            return command(**values)

    if chosen:
        place = next(place for place, argument in enumerate(arguments) if argument.name == "changes")
        arguments[place : place + 1] = map(_argument, chosen)
    arguments += [
        Parameter(name, Parameter.KEYWORD_ONLY, default=False, annotation=kind)
        for name, kind in (("quiet", Quiet), ("verbose", Verbose))
    ]
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
