"""Suggestions for commands that are nearly right: synonyms, and files or names in the wrong place."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

from spherical_wrist.errors import ParameterError

if TYPE_CHECKING:
    from typer.exceptions import TyperException

OTHER_WORDS = {
    "wrist run": ("simulate", "sim", "start", "demo", "record", "exec"),
    "wrist view FILE.rrd": ("show", "open", "play", "watch", "viewer", "display", "screenshot"),
    "wrist inspect FILE.rrd": ("info", "summary", "describe", "check", "verify", "metrics", "cat"),
    "wrist plot FILE.rrd -o OUT.pdf": ("draw", "figure", "graph", "picture", "curves"),
    "wrist inspect FILE.rrd --export OUT.csv": ("export", "convert", "csv", "dump"),
    "wrist render FILE.rrd": ("film", "video", "movie", "animate", "gif"),
    "wrist compare": ("benchmark", "bench", "rank", "ranking", "evaluate", "score"),
    "wrist frontier": ("robustness", "limits", "boundary"),
    "wrist margins": ("margin", "stability", "bode", "linearize", "linearise"),
    "wrist tune LAW": ("optimize", "optimise", "gains", "search"),
    "wrist sweep CAMPAIGN.toml": ("campaign", "batch", "montecarlo", "monte-carlo"),
    "wrist list": ("ls", "laws", "params", "parameters"),
    "wrist guide": ("docs", "doc", "man", "tutorial"),
    "wrist --help": ("help", "usage"),
    "wrist --version": ("version",),
}
"""Words that people try, by the command that does it."""

SUFFIXES = {
    ".rrd": ("a recording", "wrist inspect {0}, or wrist view {0}"),
    ".py": ("a Python file", "wrist run --law {0}"),
    ".toml": ("an experiment or a campaign", "wrist run {0}, or wrist sweep {0}"),
    ".xml": ("a model", "wrist run --model {0}"),
    ".mjcf": ("a model", "wrist run --model {0}"),
    ".csv": ("a motion", "wrist run --reference recorded:{0}"),
    ".parquet": ("a motion", "wrist run --reference recorded:{0}"),
    ".md": ("a text", "wrist guide"),
}
"""Kinds of files by suffix, and the commands that take them."""

LAW_FILE = re.compile(r".*\.py(:\w+)?")
OWN_LAW = re.compile(r"\.py(:\w|$)")


def unknown_command(word: str, rest: list[str], commands: Iterable[str]) -> ParameterError:
    """Return the error for a command that does not exist, with the intended one."""
    near = get_close_matches(word.lower(), list(commands), n=1, cutoff=0.7)
    if near:
        return ParameterError(f"no command {word!r}: did you mean wrist {shlex.join([near[0], *rest])}?")
    for command, words in OTHER_WORDS.items():
        if word.lower() in words:
            return ParameterError(f"no command {word!r}: {_with_file(command, rest)}")
    path = Path(word)
    if path.is_dir():
        return ParameterError(f"{word!r} is a folder: wrist report {shlex.quote(word)} reports on a campaign")
    file, colon, _ = word.rpartition(":")
    kind = SUFFIXES.get((Path(file) if colon else path).suffix.lower())
    if kind:
        return ParameterError(f"{word!r} is {kind[0]}: {kind[1].format(shlex.quote(word))}")
    part = _part_named(word)
    if part:
        return ParameterError(f"{word!r} is a {part}: {_usage(part, word)}; what it is: wrist list {part} {word}")
    return ParameterError(f"no command {word!r} (there are {', '.join(commands)}); what each does: wrist --help")


def misplaced_experiment(given: Path, command: str) -> ParameterError | None:
    """Return the error for a place of an experiment file where something else is; None for an experiment file.

    Args:
        given: argument as it was given.
        command: command that got it, such as ``"wrist compare"``.
    """
    text = str(given)
    if given.suffix == ".toml" or (given.is_file() and given.suffix not in SUFFIXES):
        return None
    quoted = shlex.quote(text)
    if LAW_FILE.fullmatch(text):
        return ParameterError(f"{text!r} is a law: {command} --law {quoted}")
    if given.suffix == ".rrd":
        return ParameterError(f"{text!r} is a recording: wrist inspect {quoted} shows it, wrist replay runs it again")
    if given.suffix in SUFFIXES and (usage := SUFFIXES[given.suffix][1]).startswith("wrist run --"):
        option = usage.removeprefix("wrist run ").format(quoted)
        return ParameterError(f"{text!r} is {SUFFIXES[given.suffix][0]}: {command} {option}")
    part = _part_named(text)
    if part:
        return ParameterError(f"{text!r} is a {part}: {_usage(part, text, command)}")
    return None


def explained(error: TyperException) -> str:
    """Return the text of an error about the command line in one line, with advice."""
    text = error.format_message() if hasattr(error, "format_message") else str(error)
    context = getattr(error, "ctx", None)
    path = "wrist" if context is None else context.command_path
    option = getattr(error, "option_name", "")
    if option == "--law" and context is not None and any(each.name == "law" for each in context.command.params):
        return f"no option --law: the law is an argument, {path} LAW"
    if option and (setting := _setting(option.lstrip("-"))):
        return f"no option {option}: {path} --set {setting}=VALUE"
    if option and context is not None and any(each.name == "set_" for each in context.command.params):
        possible = list(getattr(error, "possibilities", None) or [])
        near = f"; did you mean {possible[0]}?" if possible else ""
        if any(OWN_LAW.search(word) for word in sys.argv):  # whose parameters are not known before it is loaded
            near += f" A parameter of your own law is --set law.{option.lstrip('-')}=VALUE"
        return f"no option {option}{near} (see {path} --help)"
    return f"{text.strip()} (see {path} --help)"


def _with_file(command: str, rest: list[str]) -> str:
    """Put the file that was given in the place of the example's."""
    file = next((each for each in rest if not each.startswith("-")), None)
    for stands_for in ("FILE.rrd", "CAMPAIGN.toml", "LAW"):
        if file is not None and stands_for in command:
            return command.replace(stands_for, shlex.quote(file))
    return command


def _part_named(word: str) -> str:
    """Return the part of an experiment that has a member of a name, or of nearly that; empty if there is none."""
    from spherical_wrist.experiment.description import PARTS

    return next((part for part, family in PARTS.items() if word in family.members), "")


def _usage(part: str, name: str, command: str = "wrist run") -> str:
    from spherical_wrist.experiment.options import FLAGS

    return f"{command} {FLAGS[part]} {name}" if part in FLAGS else f"{command} --set {part}={name}"


def _setting(word: str) -> str:
    """Return the setting that a word is the name of, or nearly so; empty if there is none, or several."""
    from spherical_wrist.experiment.description import Experiment

    name = word.replace("-", "_")
    found = [name] if name in Experiment.model_fields else Experiment.elsewhere(name, {})
    return found[0] if len(found) == 1 else ""
