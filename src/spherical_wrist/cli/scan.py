"""Names and defaults read off the package's source, without importing what they belong to.

Importing an experiment takes a second; a shell that completes a name cannot wait that long. A test compares what is
found here with what importing gives.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

_PACKAGE = Path(__file__).parents[1]
_FAMILIES = {
    "law": ("Law", "control"),
    "reference": ("Reference", "reference"),
    "disturbance": ("Disturbance", "disturbance.py"),
    "sensing": ("Sensing", "sensing"),
    "actuation": ("Actuation", "actuation"),
}
"""Of every part of an experiment that has a name and parameters, its family, and where that is defined."""


class Found(NamedTuple):
    """A class.

    Attributes:
        bases: names of its bases.
        defaults: of its own parameters, the defaults as they are written.
        abstract: it says of itself that it is no member of its family.
        about: the first line of what it says of itself.
    """

    bases: list[str]
    defaults: dict[str, ast.expr | None]
    abstract: bool
    about: str


class Family:
    """The members of a family and their parameters.

    Args:
        part: of an experiment, such as ``"law"``.
    """

    def __init__(self, part: str) -> None:
        self._root, place = _FAMILIES[part]
        self._classes = dict(_classes(_PACKAGE / place))
        self.members = {
            _snake(name): name
            for name, found in self._classes.items()
            if name != self._root and not found.abstract and self._root in self._lineage(name)
        }

    def about(self, member: str) -> str:
        """What a member is, in a line."""
        return self._classes[self.members[member]].about

    def defaults(self, member: str) -> dict[str, str]:
        """The parameters of a member and their defaults as TOML; empty where there is none."""
        found: dict[str, ast.expr | None] = {}
        for name in reversed(self._lineage(self.members[member])):
            found |= self._classes[name].defaults
        return {name: _toml(default) for name, default in found.items()}

    def _lineage(self, name: str) -> list[str]:
        """A class and its ancestors, as far as they are defined here, nearest first."""
        if name not in self._classes:
            return []
        return [name, *(each for base in self._classes[name].bases for each in self._lineage(base))]


def experiment_defaults() -> dict[str, str]:
    """The parameters of an experiment and their defaults as TOML; empty where there is none."""
    found = dict(_classes(_PACKAGE / "experiment" / "description.py"))["Experiment"]
    return {name: _toml(default) for name, default in found.defaults.items()}


def parts() -> list[str]:
    """The parts of an experiment that have a name and parameters."""
    return list(_FAMILIES)


def _classes(place: Path) -> Iterator[tuple[str, Found]]:
    for path in sorted(place.glob("*.py")) if place.is_dir() else [place]:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef):
                bases = [base.id for base in node.bases if isinstance(base, ast.Name)]
                lines = (line for line in node.body if isinstance(line, ast.AnnAssign))
                own = {line.target.id: line for line in lines if isinstance(line.target, ast.Name)}
                doc = (ast.get_docstring(node) or "").partition("\n")[0]
                fields = {name: line for name, line in own.items() if "ClassVar" not in ast.unparse(line.annotation)}
                defaults = {name: _default(line.value) for name, line in fields.items()}
                yield node.name, Found(bases, defaults, "abstract" in own, doc)


def _default(value: ast.expr | None) -> ast.expr | None:
    """The first argument of ``quantity``, or what is assigned."""
    return value.args[0] if isinstance(value, ast.Call) and value.args else value


def _toml(default: ast.expr | None) -> str:
    """A literal as TOML without blanks; empty for None and for what only running the code would tell."""
    try:
        value = ast.literal_eval(default) if default is not None else None
    except ValueError:
        return ""
    if value is None:
        return ""
    return str(value) if isinstance(value, str) else _plain(value)


def _plain(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        each = [_plain(part) for part in value]
        return each[0] if len(each) == 3 and len(set(each)) == 1 else f"[{','.join(each)}]"
    return repr(value)


def _snake(name: str) -> str:
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()
