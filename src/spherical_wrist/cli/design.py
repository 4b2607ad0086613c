"""``wrist design``: gains of laws by one criterion, constraints and an objective."""

from __future__ import annotations

import time
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Annotated, Any

from rich.text import Text
from typer import Argument, Option

from spherical_wrist.cli import completion
from spherical_wrist.cli.options import Jobs, Json
from spherical_wrist.cli.progress import counting
from spherical_wrist.cli.tables import Entry, fitted, json_bytes, print_json, printer, short
from spherical_wrist.errors import ParameterError

if TYPE_CHECKING:
    from spherical_wrist.control import Law
    from spherical_wrist.design import Design


def command(
    law: Annotated[
        list[str] | None,
        Argument(
            metavar="[LAW]...",
            help="'NAME', 'NAME PARAMETER=VALUE ...', path/to/file.py:Name, or an experiment file",
            autocompletion=completion.laws,
        ),
    ] = None,
    all_: Annotated[
        bool, Option("--all", help="every law of the package but those of the paper and baselines")
    ] = False,
    check: Annotated[bool, Option("--check", help="measure the gains that are there; search for none")] = False,
    trials: Annotated[
        int | None, Option(metavar="N", help="sets of gains to try [those of the package's own search, or 100]")
    ] = None,
    seed: Annotated[int, Option(metavar="N", min=0, help="seed of the search")] = 0,
    output: Annotated[
        Path | None, Option("--output", "-o", metavar="OUT.json", help="keep what was found; laws are added to a file")
    ] = None,
    jobs: Jobs = None,
    json: Json = False,
) -> int:
    """Find gains, or with --check measure those that a law has, by one criterion for every law.

    The constraints: margins over a range of masses, no ringing return, no oscillation with late samples and a payload,
    little chattering; their table is printed. Of gains that meet all that the law claims, those with the smallest
    objective are best: a mean of the errors on four design runs, and of the chattering that they cost.

    CMA-ES searches the ranges that a law declares for its gains, beginning in their middle; the same seed and --trials
    come to the same gains. The package keeps what was found so, and these are the defaults of its laws. A law of your
    own without declared ranges is searched from a quarter to four times its gains.

    --check takes some seconds a law, a search some minutes. Needs cmaes, python-control and Slycot: pip install
    'spherical-wrist[tune,margins]'.

    Exit code: 0 all constraints that a law claims are met, 1 one is not, 2 wrong input, 130 stopped by Ctrl-C.

    Raises:
        ParameterError: the options contradict each other.
    """
    from spherical_wrist.comparison.law_selection import laws_from_texts, registered
    from spherical_wrist.design import Design, designed, find_gains, judge
    from spherical_wrist.design.record import kept_trials, merged
    from spherical_wrist.design.report import to_dict
    from spherical_wrist.files import write_together
    from spherical_wrist.simulation.runner import Runner

    if all_ and law:
        raise ParameterError("--all: give either laws or --all")
    if not (law or all_ or check):
        raise ParameterError(
            f"give laws to search gains for, --all for the {len(designed())} of the package whose gains are searched, "
            "or --check to measure the gains that are there"
        )
    if check and output:
        raise ParameterError("--check finds nothing to keep: leave out -o")
    laws = laws_from_texts(law, {}, {}) if law else registered()
    if all_:
        laws = {name: each for name, each in laws.items() if name in designed()}
    began, before = time.perf_counter(), dict(laws)
    searches: dict[str, Any] = {}
    if not check:
        if output is not None:
            merged(output, {})  # refuses a file of another kind before the search
        for label, each in laws.items():
            budget = trials if trials is not None else kept_trials(each)
            with counting(f"designing {label}") as progress:
                searches[label] = find_gains(each, seed=seed, trials=budget, jobs=jobs, progress=progress)
        laws = {label: found.law for label, found in searches.items()}
    with counting("measuring") as progress:
        verdicts = Runner(jobs).map(judge, list(laws.values()), progress)
    judged = {label: (each, verdict) for (label, each), verdict in zip(laws.items(), verdicts, strict=True)}
    table = to_dict(judged, time.perf_counter() - began)
    designs = {label: Design(seed, found.trials, found.gains, judged[label][1]) for label, found in searches.items()}
    table["found"] = {label: _found(before[label], design) for label, design in designs.items()}
    if output is not None:
        named = {before[label].name: design for label, design in designs.items()}
        write_together({output: json_bytes(merged(output, named))})
        table["files"] = [str(output)]
    if json:
        print_json(table)
    else:
        _print(table, before)
    claims = [each for row in table["laws"] for each in row["constraints"].values() if each["claimed"]]
    return 0 if all(each["met"] for each in claims) else 1


def _found(law: Law, design: Design) -> dict[str, Any]:
    from spherical_wrist.design.search import space_of_design

    ranges = {each.name.removeprefix("law."): each for each in space_of_design(law).ranges}
    return {
        "seed": design.seed,
        "trials": design.trials,
        "gains": design.gains,
        "ranges": {name: {"low": each.low, "high": each.high, "unit": each.unit} for name, each in ranges.items()},
    }


def _print(table: dict[str, Any], before: dict[str, Law]) -> None:
    from spherical_wrist.design import CONSTRAINTS

    console = printer()
    for label, found in table["found"].items():
        rows: list[list[Entry]] = []
        for name, value in found["gains"].items():
            own, ends = getattr(before[label], name), found["ranges"][name]
            own = max(own, key=abs) if isinstance(own, tuple) else own
            rows.append([name, short(value), short(own), f"{short(ends['low'])} – {short(ends['high'])}", ends["unit"]])
        title = f"{label}: best of {found['trials']} sets of gains, seed {found['seed']}"
        console.print(fitted(title, ["gain", "found", "before", "searched", "unit"], rows, console.width))
        console.print()
    console.print(_constraints(table, console.width))
    console.print(_figures(table, console.width))
    for each in CONSTRAINTS:
        limit = f"{'≥' if each.at_least else '≤'} {short(each.shown(each.limit))} {each.shown_unit}".rstrip()
        for text in wrap(f"{each.name} {limit}: {each.meaning}", console.width - 2, subsequent_indent="  "):
            console.print(Text(text, "dim"))
    console.print(Text("red: a constraint that is not met; in brackets: one that the law does not claim.", "dim"))
    for law in table["laws"]:
        for name, each in law["constraints"].items():
            if not each["met"]:
                why = f"not claimed: {each['reason']}" if "reason" in each else "claimed"
                console.print(Text(f"{law['law']} breaks {name}, {why}", "" if each["claimed"] else "dim"))
    for file in table["files"]:
        console.print(Text.assemble("written to ", (file, "bold")), soft_wrap=True)


def _constraints(table: dict[str, Any], width: int) -> Any:
    from spherical_wrist.design import CONSTRAINTS

    headings = ["law", "gains\nfrom", *(each.column for each in CONSTRAINTS)]
    rows: list[list[Entry]] = []
    for law in table["laws"]:
        entries: list[Entry] = [law["law"], Text(law["gains_from"], "dim")]
        for each in CONSTRAINTS:
            found = law["constraints"][each.name]
            lost = found["value"] is None and not found["met"]
            text = "lost" if lost else short(each.shown(found["value"]))
            style = "" if found["met"] else "red"
            entries.append(Text(text if found["claimed"] else f"({text})", style))
        rows.append(entries)
    return fitted("constraints", headings, rows, width)


def _figures(table: dict[str, Any], width: int) -> Any:
    from spherical_wrist.design import FIGURES

    laws = sorted(table["laws"], key=lambda law: (law["objective"] is None, law["objective"]))
    rows: list[list[Entry]] = [
        [law["law"], Text(short(law["objective"]), "bold"), *(short(law["figures"][each.name]) for each in FIGURES)]
        for law in laws
    ]
    headings = ["law", "objective", *(each.heading for each in FIGURES)]
    return fitted("objective: the geometric mean of these; less is better", headings, rows, width)
