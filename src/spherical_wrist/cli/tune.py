"""``wrist tune``: gains of a law, searched over a family of wrists."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Iterator, Mapping
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from rich.text import Text
from typer import Argument, Option

from spherical_wrist.cli import completion
from spherical_wrist.cli.options import (
    CONDITIONS,
    CaseFile,
    Changes,
    Hardware,
    Jobs,
    Json,
    Plots,
    Settings,
    Width,
    read_experiment,
    with_parameters,
)
from spherical_wrist.cli.progress import counting
from spherical_wrist.cli.results import ResultFiles, result_files
from spherical_wrist.cli.signals import heard, noted
from spherical_wrist.cli.streams import complain
from spherical_wrist.cli.tables import Entry, fitted, heading_lines, json_bytes, print_json, printer, short
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.options import FLAGS

if TYPE_CHECKING:
    from spherical_wrist.control import Law
    from spherical_wrist.tuning.search import SearchResult

ROWS = 12
"""Points of the front that are printed."""
OURS = re.compile(r"trial-\d+\.toml")


class Sampler(StrEnum):
    """Ways to propose gains."""

    NSGA2 = "nsga2"
    TPE = "tpe"


@with_parameters(*CONDITIONS)
def command(
    *,
    law: Annotated[
        str,
        Argument(
            metavar="LAW",
            help="'NAME', 'NAME PARAMETER=VALUE ...', path/to/file.py:Name, or an experiment file",
            autocompletion=completion.laws,
        ),
    ],
    case: Annotated[
        list[str] | None, Option(metavar="NAME", help="case to tune for; may be repeated [six of wrist compare's]")
    ] = None,
    cases: CaseFile = None,
    parameter: Annotated[
        list[str] | None,
        Option(
            "--parameter",
            metavar="NAME=LOW:HIGH",
            help="range to search, such as law.K=0.01:0.2; may be repeated [all positive ones, from 1/4 to 4 times]",
        ),
    ] = None,
    per_axis: Annotated[bool, Option("--per-axis", help="search the components of vectors one by one")] = False,
    bound: Annotated[
        float | None, Option(metavar="MM", help="largest tip error that gains may have in any case [any]")
    ] = None,
    trials: Annotated[int, Option(metavar="N", help="sets of gains to try, with those already tried")] = 200,
    sampler: Annotated[Sampler, Option(help="how gains are proposed")] = Sampler.NSGA2,
    changes: Changes,
    hardware: Hardware = None,
    set_: Settings = None,
    output: Annotated[
        Path | None, Option("--output", "-o", metavar="DIR", help="folder of the study [tune-LAW]")
    ] = None,
    plot: Plots = None,
    width: Width = None,
    jobs: Jobs = None,
    json: Json = False,
) -> int:
    """Every set of gains runs all cases; their errors and chattering are averaged (geometric means).

    Gains with which a case diverges, or has more tip error than --bound, are out. The default gains are tried first.
    The result is a Pareto front: gains that no other ones beat in both. Each is written as an experiment file that
    wrist run takes.

    The study is kept in DIR/tune.log: the same command goes on with it, with more --trials, or after Ctrl-C. With the
    same seed it comes to the same gains, however often it was stopped and whatever --jobs says. DIR also gets
    tune.json, front.png, .svg and .pdf, and front/trial-N.toml.

    The default family: wrong masses and torques with ideal hardware, and every fault of
    sensors and motors on three motions. Needs Optuna: pip install 'spherical-wrist[tune]'.

    Exit code: 0 tuned, 2 wrong input, 130 or 143 stopped by a signal (what was tried is kept).
    """
    from spherical_wrist.cli.output import warn
    from spherical_wrist.comparison.cases import DEFAULT, read_cases, select
    from spherical_wrist.tuning.family import Family, usual
    from spherical_wrist.tuning.pareto import FOLDER, summary_of
    from spherical_wrist.tuning.ranges import space_of
    from spherical_wrist.tuning.search import Search, tune

    file = Path(law) if law.endswith(".toml") else None
    tables, every = read_experiment(file, hardware, changes, set_)
    tuned = _law(law, tables, every)
    chosen = select(read_cases(cases) if cases else DEFAULT, case or []) if case or cases else usual()
    everywhere = {name: value for name, value in every.items() if not name.startswith("law.")}
    family = Family.of(chosen, tuned, tables, everywhere, bound)
    space = space_of(tuned, parameter or [], per_axis=per_axis)
    search = Search(space, bool(parameter), family, sampler.value, changes.get("seed", 0))
    folder = output or Path(f"tune-{tuned.name}")
    files = result_files(folder, plot, None, width)
    with noted() as received, counting("tuning") as progress:
        found = tune(search, folder, trials, jobs=jobs, progress=progress, stop=lambda: bool(received))
    if received:
        heard()
    if found is None:
        print("stopped before the first trials were done", file=sys.stderr)
        return 128 + received[0]
    table = summary_of(found)
    _write(found, table, files, folder, _case_options(cases, changes, set_ or []))
    _warn(found)
    warn(table["warnings"])
    if json:
        print_json(table)
    else:
        _print(table, folder)
        files.say(f"front.png, .svg, .pdf, tune.json, tune.log, {FOLDER}/trial-*.toml")
    if found.stopped:
        done = f"stopped after {len(found.trials)} of {trials} trials; the same command goes on"
        print(done, file=sys.stderr)
        return 128 + received[0]
    return 0


def _law(text: str, tables: Mapping[str, Any], every: Mapping[str, Any]) -> Law:
    from spherical_wrist.comparison.law_selection import laws_from_texts

    if text.endswith(".toml") and "law" not in tables:
        raise ParameterError(f"{text!r} says nothing about the law: add a table [law] with its name")
    (law,) = laws_from_texts([text], tables, every).values()
    return law


def _case_options(cases: Path | None, changes: Mapping[str, Any], settings: list[str]) -> list[str]:
    """Return options of ``wrist compare`` that make the same cases."""
    suite = ["--cases", str(cases)] if cases else []
    given = [part for name, value in changes.items() for part in (FLAGS[name], str(value))]
    other = (text for text in settings if not text.strip().startswith("law."))
    return [*suite, *given, *(part for text in other for part in ("--set", text))]


def _write(found: SearchResult, table: dict[str, Any], files: ResultFiles, folder: Path, again: list[str]) -> None:
    from spherical_wrist.files import make_folder, write_together
    from spherical_wrist.picture_file import folder_pictures, picture_content
    from spherical_wrist.tuning.gains_file import gains_file
    from spherical_wrist.tuning.pareto import FOLDER
    from spherical_wrist.tuning.picture import front_picture
    from spherical_wrist.tuning.search import FILE

    make_folder(folder / FOLDER)
    chosen = [part for case in table["cases"] for part in ("--case", case["case"])]
    drawing = front_picture(table, files.width)
    contents = folder_pictures(drawing, "front")
    for point in table["front"]:
        law = found.space.law_with(point["values"])
        path = str(folder / point["file"])
        compare = ["wrist", "compare", path, "--law", path, *chosen, *again, "--seeds", "1"]
        contents[point["file"]] = gains_file(found.search.family.base, law, point, table, compare).encode()
    table["files"] = [FILE, *contents, "tune.json"]
    contents["tune.json"] = json_bytes(table)
    plots = {file: picture_content(drawing, file) for file in files.plots}
    write_together({folder / name: content for name, content in contents.items()} | plots)
    for file in (folder / FOLDER).iterdir():
        if OURS.fullmatch(file.name) and f"{FOLDER}/{file.name}" not in contents:
            file.unlink()  # no longer on the front


def _warn(found: SearchResult) -> None:
    from spherical_wrist.simulation.run import versions

    now = versions()
    other = [f"{name} {found.versions[name]}" for name in now if found.versions.get(name) not in (None, now[name])]
    if other:
        complain(f"the study was begun with {', '.join(other)}: figures may differ in their last digits", "warning")


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


def _table(table: dict[str, Any], width: int) -> Any:
    from spherical_wrist.measure.metrics import METRICS

    names = [each["name"] for each in table["parameters"]]
    figures = ("rms_error_rad", "error_ratio", "chattering_Nm_per_s", "chattering_ratio", "max_tip_error_mm")
    headings = ["trial"]
    headings += [heading_lines(METRICS[each].label_and_unit) if each in METRICS else "×" for each in figures]
    rows: list[list[Entry]] = []
    default = table["default"]
    for point in [*([default] if default["rms_error_rad"] is not None else []), *shown(table)]:
        style = "bold" if point["trial"] in (table["precise"], table["calm"]) else ""
        name = "default" if point is default else str(point["trial"])
        gains = (short(point["values"][each]) for each in names)
        rows.append([Text(text, style) for text in (name, *(short(point[each]) for each in figures), *gains)])
    headings += [each.removeprefix("law.") for each in names]
    room = max(width, 60)
    while len(headings) > 6 and _width(headings, rows) > room:
        headings, rows = headings[:-1], [row[:-1] for row in rows]
    return fitted("× : as a multiple of the default gains'", headings, rows, room)


def shown(table: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the points of the front to print: evenly spread ones, and those with names."""
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
        yield Text("no gains that were tried are better than the default ones in one respect and no worse in the other")
    if table["idle"]:
        idle = ", ".join(name.removeprefix("law.") for name in table["idle"])
        yield Text(f"left alone, because they change nothing on these cases: {idle}", "dim")
