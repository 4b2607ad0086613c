"""``wrist list``: names and parameters of everything that an experiment is made of; metrics, channels and cases."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping
from difflib import get_close_matches
from inspect import cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, get_args

from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text
from typer import Argument

from spherical_wrist.cli import completion
from spherical_wrist.cli.options import Json
from spherical_wrist.cli.tables import print_json, printer
from spherical_wrist.consent import is_code
from spherical_wrist.errors import ParameterError, UnknownNameError, listed
from spherical_wrist.package_files import package_files

if TYPE_CHECKING:
    from pydantic import BaseModel

    from spherical_wrist.parameters import Member

UNCOUNTABLE = ("sensing", "actuation")
ALL = "all"
LONGEST = 30
"""Columns up to which a name stands beside its summary."""
Entry = dict[str, Any]
"""Description of one thing as plain data; ``summary`` is a sentence, ``parameters`` are described by name."""


class PackageFiles(Mapping[str, Entry]):
    """Descriptions of files of the package by name. Each is made when it is asked for: counting them reads none.

    Args:
        kind: kind of files, of :data:`spherical_wrist.package_files.KINDS`.
        describe: describes the file of a name.
    """

    def __init__(self, kind: str, describe: Callable[[str], Entry]) -> None:
        self._names, self._describe = tuple(package_files(kind)), describe

    def __getitem__(self, name: str) -> Entry:
        """Return the description of a file."""
        if name not in self._names:
            raise KeyError(name)
        return self._describe(name)

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self._names)

    def __len__(self) -> int:
        """Return the number of files."""
        return len(self._names)


class Kind(NamedTuple):
    """Kind of entries that can be listed.

    Attributes:
        name: key in JSON, and name on the command line.
        others: other names on the command line.
        meaning: what the things are, and what takes them.
        entries: returns the description of each by its name.
        own: returns the description of one that is not of the package, such as ``my.py:Law``; None if there are none.
        keys: entries of a description that the list of the kind shows beside the summary.
    """

    name: str
    others: tuple[str, ...]
    meaning: str
    entries: Callable[[], Mapping[str, Entry]]
    own: Callable[[str], Entry] | None = None
    keys: tuple[str, ...] = ()


def command(
    kind: Annotated[
        str | None,
        Argument(metavar="KIND", help="laws, metrics, ..., or all [what there is]", autocompletion=completion.kinds),
    ] = None,
    name: Annotated[
        str | None,
        Argument(metavar="NAME", help="one of them, or your own: my.py:Law [all]", autocompletion=completion.listed),
    ] = None,
    json: Json = False,
) -> None:
    """Everything listed can be set with --set NAME=VALUE, in an experiment file, or in Python.

    Examples: wrist list laws, wrist list law slotine_li, wrist list metrics, wrist list law my.py:Law.

    Raises:
        UnknownNameError: there is no such kind or name.
    """
    known = kinds()
    if kind is None and not json:
        _print_kinds(known)
    elif kind in (None, ALL):
        found = {each.name: dict(each.entries()) for each in known.values()}
        if json:
            print_json(found)
        else:
            _print_all(known, found)
    else:
        of, which = _asked(known, str(kind), name)
        if which is None:
            _show_kind(of, json)
        else:
            _show_one(of, which, json)


def kinds() -> dict[str, Kind]:
    """Return every kind of entries that can be listed, by name."""
    from spherical_wrist.comparison.cases import DEFAULT
    from spherical_wrist.experiment.axes import AXES
    from spherical_wrist.experiment.description import PARTS, Experiment
    from spherical_wrist.experiment.options import FLAGS
    from spherical_wrist.experiment.presets import HARDWARE

    found = [_family(part, family, FLAGS.get(part, f"--set {part}")) for part, family in PARTS.items()]
    found += [
        Kind("experiment", ("parameters", "settings"), "its parameters: --set", lambda: _fields(Experiment)),
        Kind("hardware", (), "presets of sensors and motors: --hardware", lambda: _plain(HARDWARE)),
        Kind("wrists", ("wrist", "models", "model"), "wrist models: --model",
             lambda: PackageFiles("model", _wrist), _wrist),
        Kind("motions", ("motion",), "recorded motions: --reference recorded:NAME",
             lambda: PackageFiles("motion", _motion), _motion),
        Kind("cases", ("case", "suite"), "cases of wrist compare: --case", lambda: {e.name: _case(e) for e in DEFAULT}),
        Kind("axes", ("axis",), "axes of wrist frontier: --axis", lambda: {n: _axis(a) for n, a in AXES.items()}),
        Kind("metrics", ("metric", "figures"), "figures of merit of a run, as in JSON and bounds", _metrics,
             keys=("unit",)),
        Kind("channels", ("channel", "series", "arrays"), "series of a run, as recorded", _channels, keys=("unit",)),
        Kind("warnings", ("warning", "checks"), "what makes the figures of a run doubtful", _warnings),
        Kind("guides", ("guide",), "guides: wrist guide NAME", _guides),
    ]  # fmt: skip
    return {each.name: each for each in found}


def family_title(part: str) -> str:
    """Return the name of the kind that has the members of a part."""
    return part if part in UNCOUNTABLE else f"{part}s"


OTHERS = {"sensing": ("sensors", "sensor"), "actuation": ("motors", "motor", "actuators", "actuator")}


def _family(part: str, family: type[Member], option: str) -> Kind:
    """Return the kind of the members of a part."""
    meaning = family_meaning(part)
    others = (part, *OTHERS.get(part, ()))
    keys = ("status",) if part == "law" else ()
    return Kind(
        family_title(part),
        others,
        f"{meaning}: {option}",
        lambda: {name: describe_member(member) for name, member in family.members.items()},
        lambda text: describe_member(family.member(text)),
        keys,
    )


def family_meaning(part: str) -> str:
    """Return the meaning of a part, from its declaration in the experiment."""
    from spherical_wrist.experiment.description import Experiment

    return Experiment.model_fields[part].description or ""


# --- descriptions as plain data


def describe_member(member: type[Member]) -> Entry:
    """Return the declarations of a law, reference, disturbance, sensor or motor."""
    from spherical_wrist.control import Law

    described = _describe(member)
    if not issubclass(member, Law):
        return {**described, "source": _source(member)}
    bound = member.tracks_to
    fields = member.State.model_fields
    return {
        "summary": described["summary"],
        "status": member.status,
        "tracks_to": None if bound is None else bound._asdict(),
        "parts": sorted(member.ablations),
        "parameters": described["parameters"],
        "state": {name: _parameter(member.State, name) for name in fields},
        "source": _source(member),
    }


def _source(member: type[Member]) -> str:
    """Return the file of a class: within the package, or the user's."""
    file = member.address.rpartition(":")[0]
    return file or f"{member.__module__.replace('.', '/')}.py"


def _describe(model: type[BaseModel]) -> Entry:
    """Return the summary of a model and, for each parameter, default, unit, meaning and, if there are some, choices."""
    return {
        "summary": _first(cleandoc(model.__doc__ or "")),
        "parameters": {name: _parameter(model, name) for name in model.model_fields},
    }


def _first(text: str) -> str:
    return " ".join(text.partition("\n\n")[0].split())


def _fields(model: type[BaseModel]) -> dict[str, Entry]:
    return {name: {"summary": info.pop("meaning"), **info} for name, info in _describe(model)["parameters"].items()}


def _parameter(model: type[BaseModel], name: str) -> Entry:
    from pydantic_core import PydanticUndefined, to_jsonable_python

    from spherical_wrist.parameters import unit_of

    field = model.model_fields[name]
    choices = [choice for choice in get_args(field.annotation) if isinstance(choice, str)]
    return {
        "default": None if field.default is PydanticUndefined else to_jsonable_python(field.default),
        "unit": unit_of(model, name),
        "meaning": field.description or "",
        **({"choices": choices} if choices else {}),
    }


def _plain(presets: Mapping[str, Mapping[str, Any]]) -> dict[str, Entry]:
    return {name: {"summary": _words(values), "values": dict(values)} for name, values in presets.items()}


def _words(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {_text(value)}" for name, value in values.items() if value is not None)


def _case(case: Any) -> Entry:
    from pydantic_core import to_jsonable_python

    return {
        "summary": f"{case.meaning}. Shows: {case.discriminates}",
        "changes": to_jsonable_python(dict(case.changes)),
        "judged_by": list(case.figures),
    }


def _axis(axis: Any) -> Entry:
    return {
        "summary": axis.meaning,
        "parameter": axis.parameter,
        "unit": axis.unit,
        "base": axis.base,
        "limit": axis.limit,
    }


def _metrics() -> dict[str, Entry]:
    from spherical_wrist.measure.metrics import METRICS

    return {
        name: {
            "summary": f"{metric.label}: {metric.meaning}",
            "label": metric.label,
            "unit": metric.unit,
            "meaning": metric.meaning,
            "runs": metric.needs.runs,
            "less_is_better": metric.less_is_better,
        }
        for name, metric in METRICS.items()
    }


def _channels() -> dict[str, Entry]:
    from spherical_wrist.channels import CHANNELS

    return {
        name: {
            "summary": each.meaning,
            "unit": each.unit,
            "axes": None if each.axes is None else list(each.axes),
            "written_by": str(each.source),
            "exists_for": str(each.when),
        }
        for name, each in CHANNELS.items()
    }


def _warnings() -> dict[str, Entry]:
    from spherical_wrist.measure.metrics import METRICS
    from spherical_wrist.measure.warnings import CHECKS

    return {
        name: {
            "summary": f"{METRICS[each.metric].label} > {METRICS[each.metric].written(each.limit)}: {each.meaning}",
            **each._asdict(),
        }
        for name, each in CHECKS.items()
    }


def _guides() -> dict[str, Entry]:
    from spherical_wrist.guides import NAMES, read_guide

    return {name: {"summary": read_guide(name).title} for name in NAMES}


def _wrist(file: str) -> Entry:
    """Return the parts and figures of a wrist model: one of the package, or an MJCF file."""
    import numpy as np

    from spherical_wrist.experiment.description import Experiment

    wrist = Experiment(model=Path(file)).nominal()
    model = wrist.model
    largest = np.abs(wrist.motors) @ wrist.upper
    names = [model.actuator(number).name for number in range(model.nu)]
    mass, lever = float(model.body_subtreemass[wrist.body]), 1e3 * float(np.linalg.norm(wrist.lever))
    return {
        "summary": f"{mass:.3g} kg, tip {lever:.3g} mm from the joint, torque up to {_listed(largest)} N·m",
        "joint": model.joint(0).name,
        "motors": names,
        "largest_torque_Nm": [float(each) if np.isfinite(each) else None for each in largest],
        "moving_mass_kg": mass,
        "lever_m": [float(each) for each in wrist.lever],
        "timestep_s": float(model.opt.timestep),
        "warnings": list(wrist.warnings),
    }


def _listed(limits: Any) -> str:
    return ", ".join(f"{each:.3g}" for each in limits)


def _motion(file: str) -> Entry:
    """Return what a recorded motion is: one of the package, or a file."""
    from spherical_wrist.reference import Reference

    return {"summary": Reference.resolve(f"recorded:{file}", default="").about()}


# --- one kind, or one thing


def _asked(known: Mapping[str, Kind], kind: str, name: str | None) -> tuple[Kind, str | None]:
    """Return the kind and the name that the arguments mean; a name alone is looked for in all kinds.

    Raises:
        UnknownNameError: there is none.
    """
    word = kind.lower()
    for each in known.values():
        if word in (each.name, *each.others):
            return each, name
    if name is None:
        if is_code(kind):
            return known[family_title("law")], kind
        for each in known.values():
            if kind in each.entries():
                return each, kind
    every = [word for each in known.values() for word in (each.name, *each.others, *each.entries())]
    near = get_close_matches(kind, every, n=1, cutoff=0.6)
    guess = f"; did you mean {near[0]!r}?" if near else ""
    raise ParameterError(f"nothing called {kind!r} to list{guess} (there are {', '.join(known)}, and {ALL})")


def _show_kind(kind: Kind, json: bool) -> None:
    entries = kind.entries()
    if json:
        print_json(dict(entries))
        return
    console = printer()
    console.print(_entries(entries, kind.keys))
    singular = kind.others[0] if kind.others else kind.name
    if kind.name != "guides":
        console.print(Text(f"\n{kind.meaning}; one of them: wrist list {singular} NAME", "dim"), soft_wrap=True)


def _show_one(kind: Kind, name: str, json: bool) -> None:
    entries = kind.entries()
    if name in entries:
        entry = entries[name]
    elif kind.own is not None and (is_code(name) or Path(name).suffix):
        entry = kind.own(name)
    else:
        raise UnknownNameError(kind.others[0] if kind.others else kind.name, name, entries)
    if json:
        print_json({name: entry})
        return
    console = printer()
    console.print(Text.assemble((name, "bold green"), f"  {entry.get('status', '')}".rstrip()))
    if text := _docstring(kind, name) or entry["summary"]:
        console.print(Text(textwrap.indent(_reflowed(text, console.width - 2), "  ")), soft_wrap=True)
    _print_details(console, kind, name, entry)


def _docstring(kind: Kind, name: str) -> str:
    """Return the docstring of a member of a part; empty for other objects."""
    from spherical_wrist.experiment.description import PARTS

    for part, family in PARTS.items():
        if family_title(part) == kind.name:
            text = cleandoc(family.member(name).__doc__ or "").partition("\nAttributes:")[0]
            return text.replace("``", "").replace(":class:", "").replace(":func:", "").strip()
    return ""


def _reflowed(text: str, width: int) -> str:
    """Wrap the paragraphs of a docstring to a width; equations and lists, which are indented, stay as they are."""

    def wrapped(part: str) -> str:
        if part.startswith(" ") or "\n " in part:
            return part
        return textwrap.fill(" ".join(part.split()), width, break_on_hyphens=False)

    return "\n\n".join(map(wrapped, text.split("\n\n")))


def _print_details(console: Console, kind: Kind, name: str, entry: Entry) -> None:
    from spherical_wrist.experiment.description import PARTS
    from spherical_wrist.experiment.options import FLAGS

    part = next((part for part in PARTS if family_title(part) == kind.name), "")
    for title, key, prefix in (("parameters", "parameters", f"{part}."), ("state", "state", "state.")):
        if entry.get(key):
            console.print(Text(f"\n{title}", "bold"))
            console.print(_table(prefix, entry[key]))
    if entry.get("tracks_to"):
        bound = entry["tracks_to"]
        claim = f"{bound['rms_rad']:g} rad RMS, {bound['max_rad']:g} rad at most"
        console.print(
            Text.assemble(("\nclaim", "bold"), f"  {claim}: default motion, 25 % of torque, 0.5 to 1.5 of the mass")
        )
    if entry.get("parts"):
        console.print(Text.assemble(("\nparts", "bold"), f"  {listed(entry['parts'], 20)}: wrist ablate {name}"))
    rest = {key: value for key, value in entry.items() if key not in DETAILED and value not in (None, [], "")}
    if rest:
        table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
        for key, value in rest.items():
            table.add_row(f"  {key}", _text(value) if not isinstance(value, Mapping) else _words(value))
        console.print()
        console.print(table)
    if part:
        use = f"{FLAGS[part]} {name}" if part in FLAGS else f"--set {part}={name}"
        console.print(Text(f"\nuse it: wrist run {use}", "dim"), soft_wrap=True)


DETAILED = ("summary", "status", "parameters", "state", "tracks_to", "parts", "meaning")
"""Entries of a description that have a place of their own."""


# --- tables

USAGES = (
    ("wrist list KIND", "the names"),
    ("wrist list KIND NAME", "one of them, or your own: wrist list law my.py:Law"),
    ("wrist list all", "everything, with units and defaults"),
)


def _print_kinds(known: Mapping[str, Kind]) -> None:
    console = printer()
    table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    table.add_column(style="bold green")
    table.add_column(justify="right", style="dim")
    table.add_column()
    for kind in known.values():
        table.add_row(kind.name, str(len(kind.entries())), kind.meaning)
    console.print(table)
    console.print()
    for usage, meaning in USAGES:
        console.print(Text.assemble((f"{usage:22}", "dim"), (meaning, "dim")))


def _print_all(known: Mapping[str, Kind], found: Mapping[str, dict[str, Entry]]) -> None:
    console = printer()
    for title, entries in found.items():
        console.rule(Text(title.capitalize(), "bold"), align="left")
        part = known[title].others[0] if known[title].others else ""
        for name, entry in entries.items():
            if "parameters" in entry:
                console.print(Text.assemble((name, "bold green"), f"  {entry['summary']}"))
                console.print(_table(f"{part}.", entry["parameters"]))
                console.print()
        if not any("parameters" in entry for entry in entries.values()):
            console.print(known[title].meaning)
            flat = {name: {"meaning": entry["summary"], **entry} for name, entry in entries.items()}
            console.print(_table("", flat) if title == "experiment" else _entries(entries, known[title].keys))
            console.print()


def _entries(entries: Mapping[str, Entry], keys: Iterable[str]) -> Table:
    """Return names, chosen entries and summaries of a kind; where names are long, the summaries go below them."""
    if max(map(len, entries)) > LONGEST:
        return _stacked(entries, keys)
    table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    table.add_column(style="bold green", no_wrap=True)
    for _ in keys:
        table.add_column(style="dim", no_wrap=True)
    table.add_column(ratio=1)
    for name, entry in entries.items():
        table.add_row(name, *(str(entry[key]) for key in keys), entry["summary"])
    return table


def _stacked(entries: Mapping[str, Entry], keys: Iterable[str]) -> Table:
    table = Table(show_header=False, box=None, padding=0)
    for name, entry in entries.items():
        notes = " ".join(str(entry[key]) for key in keys)
        table.add_row(Text.assemble((name, "bold green"), (f"  {notes}", "dim")))
        table.add_row(Padding(Text(entry["summary"]), (0, 0, 0, 4)))
    return table


def _table(prefix: str, parameters: Mapping[str, Any]) -> Table:
    table = Table(show_header=False, box=None, padding=(0, 1), pad_edge=False)
    table.add_column(min_width=24)
    table.add_column(style="cyan", max_width=31)
    table.add_column(style="dim")
    table.add_column(ratio=1)
    for name, info in parameters.items():
        meaning = f"{info['meaning']}: {', '.join(info['choices'])}" if "choices" in info else info["meaning"]
        table.add_row(f"  {prefix}{name}", _text(info["default"]), info["unit"], meaning)
    return table


def _text(value: Any) -> str:
    """Write a default with at most six digits."""
    if isinstance(value, list):
        nested = any(isinstance(entry, list) for entry in value)
        return "[" + (",\n " if nested else ", ").join(map(_text, value)) + "]"
    if value is None:
        return "—"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value)
