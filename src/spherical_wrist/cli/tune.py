"""``wrist tune``: gains of a law, searched over a family of wrists."""

import json
import re
import shlex
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from rich.text import Text

from spherical_wrist.cli.output import print_json, printer
from spherical_wrist.cli.progress import counting
from spherical_wrist.cli.signals import noted
from spherical_wrist.cli.tables import Entry, fitted, short
from spherical_wrist.comparison.cases import DEFAULT, read_cases, select
from spherical_wrist.comparison.contestants import contestants
from spherical_wrist.control import Law
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.command import read_settings
from spherical_wrist.experiment.description import read_toml
from spherical_wrist.experiment.run import versions
from spherical_wrist.files import make_folder, write_together
from spherical_wrist.tuning.family import Family, usual
from spherical_wrist.tuning.front import FOLDER, told
from spherical_wrist.tuning.gains_file import gains_file
from spherical_wrist.tuning.ranges import space_of
from spherical_wrist.tuning.search import Found, Search, tune

ROWS = 12
"""Points of the front that are printed."""
OURS = re.compile(r"trial-\d+\.toml")


class TuneOptions(NamedTuple):
    """What to search and where to; see ``wrist tune --help``."""

    cases: list[str]
    suite: Path | None
    parameters: list[str]
    per_axis: bool
    bound: float | None
    trials: int
    sampler: Any
    seed: int
    folder: Path | None
    jobs: int | None
    json: bool


def tune_law(text: str, changes: Mapping[str, Any], settings: list[str], options: TuneOptions) -> int:
    """Searches, writes and prints; returns the exit code.

    Args:
        text: the law as on the command line; of an experiment file, everything counts.
        changes: values by dotted name that take the place of those in the file and of the cases.
        settings: ``name=value`` texts that take the place of all.
        options: the rest.

    Raises:
        WristError: wrong input, or a file that cannot be written.
    """
    tables = read_toml(Path(text)) if text.endswith(".toml") else {}
    every = {**changes, **read_settings(settings)}
    law = _law(text, tables, every)
    own = options.cases or options.suite
    cases = select(read_cases(options.suite) if options.suite else DEFAULT, options.cases) if own else usual()
    everywhere = {name: value for name, value in every.items() if not name.startswith("law.")}
    family = Family.of(cases, law, tables, everywhere, options.bound)
    space = space_of(law, options.parameters, per_axis=options.per_axis)
    search = Search(space, bool(options.parameters), family, options.sampler, options.seed)
    folder = options.folder or Path(f"tune-{law.name}")
    with noted() as received, counting("tuning") as progress:
        found = tune(search, folder, options.trials, jobs=options.jobs, progress=progress, stop=lambda: bool(received))
    if found is None:
        print("stopped before the first trials were done", file=sys.stderr)
        return 128 + received[0]
    table = told(found)
    _write(found, table, folder, _again(options, changes, settings))
    _warn(found)
    if options.json:
        print_json(table)
    else:
        _print(table, folder)
    if found.stopped:
        done = f"stopped after {len(found.trials)} of {options.trials} trials; the same command goes on"
        print(done, file=sys.stderr)
        return 128 + received[0]
    return 0


def _law(text: str, tables: Mapping[str, Any], every: Mapping[str, Any]) -> Law:
    if text.endswith(".toml") and "law" not in tables:
        raise ParameterError(f"{text!r} says nothing about the law: add a table [law] with its name")
    (law,) = contestants([text], tables, every).values()
    return law


def _again(options: TuneOptions, changes: Mapping[str, Any], settings: list[str]) -> list[str]:
    """Options of ``wrist compare`` that make the same cases."""
    suite = ["--cases", str(options.suite)] if options.suite else []
    given = [part for name, value in changes.items() for part in (f"--{name}", str(value))]
    other = (text for text in settings if not text.strip().startswith("law."))
    return [*suite, *given, *(part for text in other for part in ("--set", text))]


def _write(found: Found, table: dict[str, Any], folder: Path, again: list[str]) -> None:
    from spherical_wrist.comparison.picture import as_files
    from spherical_wrist.tuning.picture import front_picture

    make_folder(folder / FOLDER)
    chosen = [part for case in table["cases"] for part in ("--case", case["case"])]
    contents = as_files(front_picture(table), "front")
    for point in table["front"]:
        law = found.space.law_with(point["values"])
        path = str(folder / point["file"])
        compare = ["wrist", "compare", path, "--law", path, *chosen, *again]
        contents[point["file"]] = gains_file(found.search.family.base, law, point, table, compare).encode()
    table["files"] = ["tune.db", *contents, "tune.json"]
    contents["tune.json"] = (json.dumps(table, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()
    write_together({folder / name: content for name, content in contents.items()})
    for file in (folder / FOLDER).iterdir():
        if OURS.fullmatch(file.name) and f"{FOLDER}/{file.name}" not in contents:
            file.unlink()  # no longer on the front


def _warn(found: Found) -> None:
    now = versions()
    other = [f"{name} {found.versions[name]}" for name in now if found.versions.get(name) not in (None, now[name])]
    if other:
        text = f"the study was begun with {', '.join(other)}: figures may differ in their last digits"
        print(f"wrist: warning: {text}", file=sys.stderr)


def _print(table: dict[str, Any], folder: Path) -> None:
    console = printer()
    default, infeasible = table["default"], table["infeasible"]
    console.print(
        Text.assemble(
            (table["law"]["name"], "bold"),
            f": {table['trials']} sets of gains on {len(table['cases'])} cases",
            f", {infeasible} of them infeasible" if infeasible else "",
            f", {len(table['front'])} on the Pareto front",
        )
    )
    if default["rms_error_rad"] is None:
        failed = ", ".join(
            f"{name} ({each['outcome']})" for name, each in default["cases"].items() if each["outcome"] != "completed"
        )
        console.print(Text(f"the default gains are infeasible: {failed}", "red"))
    if table["front"]:
        console.print(_table(table, console.width))
    for line in _advice(table, folder):
        console.print(line, soft_wrap=True)
    console.print(
        Text.assemble(
            "written to ", (str(folder), "bold"), f": front.png, front.svg, tune.json, tune.db, {FOLDER}/trial-*.toml"
        ),
        soft_wrap=True,
    )


def _table(table: dict[str, Any], width: int) -> Any:
    names = [each["name"] for each in table["parameters"]]
    headings = ["trial", "RMS error\n[rad]", "×", "chattering\n[N·m/s]", "×", "largest tip\nerror [mm]"]
    rows: list[list[Entry]] = []
    default = table["default"]
    for point in [*([default] if default["rms_error_rad"] is not None else []), *shown(table)]:
        style = "bold" if point["trial"] in (table["precise"], table["calm"]) else ""
        name = "default" if point is default else str(point["trial"])
        figures = ("rms_error_rad", "error_ratio", "chattering_Nm_per_s", "chattering_ratio", "max_tip_error_mm")
        gains = (short(point["values"][each]) for each in names)
        rows.append([Text(text, style) for text in (name, *(short(point[each]) for each in figures), *gains)])
    headings += [each.removeprefix("law.") for each in names]
    room = max(width, 60)
    while len(headings) > 6 and _width(headings, rows) > room:
        headings, rows = headings[:-1], [row[:-1] for row in rows]
    return fitted("× : as a multiple of the default gains'", headings, rows, room)


def shown(table: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The points of the front to print: evenly spread, and those with names."""
    front = [point for point in table["front"] if point["trial"] != 0]
    step = max(1.0, (len(front) - 1) / (ROWS - 1))
    places = {round(step * number) for number in range(ROWS)}
    named = (table["precise"], table["calm"])
    return [point for place, point in enumerate(front) if place in places or point["trial"] in named]


def _width(headings: list[str], rows: list[list[Entry]]) -> int:
    columns = zip(*([*map(str, row)] for row in rows), strict=True)
    return sum(
        max(map(len, [*heading.split("\n"), *column])) + 1 for heading, column in zip(headings, columns, strict=True)
    )


def _advice(table: Mapping[str, Any], folder: Path) -> Iterator[Text]:
    by_trial = {point["trial"]: point for point in table["front"]}
    for key, claim in (("precise", "no more chattering"), ("calm", "no larger error")):
        point = by_trial.get(table[key])
        if point is not None and point["trial"]:
            ratios = f"error × {short(point['error_ratio'])}, chattering × {short(point['chattering_ratio'])}"
            command = shlex.join(["wrist", "run", str(folder / point["file"])])
            yield Text.assemble(f"with {claim} than the default gains: {ratios}: ", (command, "bold"))
    if table["precise"] == table["calm"] == 0:
        yield Text("nothing that was tried beats the default gains in one without losing in the other")
    if table["idle"]:
        idle = ", ".join(name.removeprefix("law.") for name in table["idle"])
        yield Text(f"left alone, because they change nothing on these cases: {idle}", "dim")
