"""Command-line options that stand for parameters of an experiment.

The command line, its help, completion in the shell, and the command that makes an experiment
(:func:`~spherical_wrist.experiment.command.command_of`) are derived from this table. Meanings and defaults are those of
the parameters; importing this module is quick, because it does not ask for them.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

WHOLE = "whole"
"""Duration that stands for the time that the whole motion takes."""
_OWN = "or path/to/file.py:Name"


class ParameterOption(NamedTuple):
    """Command-line option of a parameter.

    Attributes:
        parameter: dotted name, such as ``disturbance.level``; ``name`` of a part stands for its member.
        flag: name on the command line.
        type: type of its value on the command line.
        metavar: placeholder of the value in the help; None for that of the type.
        note: addition to the meaning of the parameter in the help.
        parse: function that reads its value, where words are valid besides the type; raises ValueError.
    """

    parameter: str
    flag: str
    type: type
    metavar: str | None = None
    note: str = ""
    parse: Callable[[str], Any] | None = None

    @property
    def name(self) -> str:
        """Name as an argument of a function."""
        return self.flag.removeprefix("--").replace("-", "_")

    @property
    def part(self) -> str:
        """Parameter of the experiment that it belongs to."""
        return self.parameter.partition(".")[0]

    def help(self) -> str:
        """Meaning and default, from the declaration of the parameter."""
        from spherical_wrist.experiment.description import PARTS, Experiment, toml

        field, own = Experiment.model_fields[self.part], self.parameter.partition(".")[2]
        if own not in ("", "name"):
            field = PARTS[self.part].members[field.default].model_fields[own]
        default: Any = field.default
        shown = "" if default is None else f" [{default if isinstance(default, str) else toml(default)}]"
        return ", ".join(filter(None, (field.description, self.note))) + shown


def _duration(text: str) -> float | str:
    try:
        return WHOLE if text == WHOLE else float(text)
    except ValueError:
        raise ValueError(f"{text!r} is neither a number of seconds nor {WHOLE}") from None


OPTIONS = (
    ParameterOption("law", "--law", str, note=_OWN),
    ParameterOption("reference", "--reference", str, note=f"recorded:FILE, {_OWN}"),
    ParameterOption("disturbance.level", "--disturbance", float, "LEVEL"),
    ParameterOption("disturbance.name", "--disturbance-shape", str, "SHAPE", _OWN),
    ParameterOption("mass_scale", "--mass-scale", float),
    ParameterOption("payload", "--payload", float, "KG"),
    ParameterOption("duration", "--duration", float, f"SECONDS|{WHOLE}", "whole: all of a recorded motion", _duration),
    ParameterOption("control_period", "--control-period", float, "SECONDS"),
    ParameterOption("bound", "--bound", float, "MM"),
    ParameterOption("seed", "--seed", int),
    ParameterOption("model", "--model", Path, "FILE.xml"),
    ParameterOption("joint", "--joint", str, "NAME"),
    ParameterOption("hinges", "--hinges", str, "A,B,C"),
    ParameterOption("motors", "--motors", str, "A,B,C"),
    ParameterOption("tip", "--tip", str, "SITE"),
)
"""Parameters that have an option of their own; the rest go through ``--set``."""

FLAGS = {option.parameter.removesuffix(".name"): option.flag for option in OPTIONS}
"""Options keyed by the dotted name of the parameter; of a part, by the part."""
