"""``wrist compare``: laws × cases, ranked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any

from rich.console import Group
from rich.text import Text
from typer import Option

from spherical_wrist.cli.options import (
    CONDITIONS,
    CaseFile,
    CaseNames,
    Changes,
    ExperimentFile,
    Folder,
    Hardware,
    Jobs,
    Json,
    Laws,
    Plots,
    Seeds,
    Settings,
    Tables,
    Width,
    read_experiment,
    with_parameters,
)
from spherical_wrist.cli.progress import counting
from spherical_wrist.cli.results import ResultFiles, result_files, write_results
from spherical_wrist.cli.tables import Entry, fitted, heading_lines, number, print_json, printer, short

FEW = 40
"""Number of cells up to which every figure is printed without --full."""
WIDE = 118
ABOUT = (
    "×: √(attitude error · tip error) as a multiple of the best law's on the case; median over the cases, with an "
    "interval of 95 % (bootstrap over cases and seeds); worst of all runs; number of cases on which it is first, and "
    "within 5 % of the first; lost: cases with a run that did not complete, which count as infinite"
)

ABOUT_WINNERS = (
    "next: × and place of the runner-up; ≤5%: number of laws within 5 % of the best; lost: of laws that lost a run"
)
MOST_LOST = 12
"""Number of lost runs up to which each is printed."""


@with_parameters(*CONDITIONS)
def command(
    *,
    experiment: ExperimentFile = None,
    law: Laws = None,
    case: CaseNames = None,
    cases: CaseFile = None,
    changes: Changes,
    hardware: Hardware = None,
    set_: Settings = None,
    output: Folder = None,
    plot: Plots = None,
    table: Tables = None,
    width: Width = None,
    record: Annotated[
        list[str] | None,
        Option(metavar="LAW:CASE", help="record this run to DIR, or those that match 'pd:*', or all; may be repeated"),
    ] = None,
    full: Annotated[bool, Option("--full", help="print every figure of every law on every case")] = False,
    seeds: Seeds = None,
    jobs: Jobs = None,
    json: Json = False,
) -> None:
    """The suite: every case shows another difference between laws; wrist list cases says which.

    A case of your own is a table of a FILE.toml with a name and any parameters: [[case]] name = "late",
    sensing.delay = 0.002.

    A law is judged by attitude and tip error together, as a multiple of the best law's: by the median over the cases,
    and by its worst run. A lost run counts as infinite. Cases with something random are run with N seeds, from --seed
    on, the others once. With -o: comparison.json, .csv, .md, .tex, .png, .svg and .pdf.

    Exit code: 0 compared (runs may be lost), 2 wrong input, 130 stopped by Ctrl-C.
    """
    from spherical_wrist.cli.output import warn
    from spherical_wrist.comparison.cases import DEFAULT, read_cases, select
    from spherical_wrist.comparison.compare import SEEDS, compare
    from spherical_wrist.comparison.comparison_table import comparison_table
    from spherical_wrist.comparison.law_selection import laws_from_texts
    from spherical_wrist.comparison.picture import comparison_picture
    from spherical_wrist.comparison.report import as_csv, as_markdown, to_dict

    tables, every = read_experiment(experiment, hardware, changes, set_)
    files = result_files(output, plot, table, width)
    laws = laws_from_texts(law or [], tables, every)
    chosen = select(read_cases(cases) if cases else DEFAULT, case or [])
    with counting("comparing") as progress:
        results = compare(
            laws,
            chosen,
            tables,
            every,
            seeds=SEEDS if seeds is None else seeds,
            record=record or [],
            folder=output,
            jobs=jobs,
            progress=progress,
        )
    found = to_dict(results, str(cases or "default"))
    replaced = {each.name: names for each in chosen if (names := each.overridden(every))}
    if replaced:
        found["warnings"].append(replaced_in_words(replaced))
    write_results(
        files,
        "comparison",
        found,
        lambda width: comparison_picture(found, width),
        lambda: comparison_table(found),
        lambda: {
            "comparison.csv": as_csv(found).encode(),
            "comparison.md": as_markdown(found, number).encode(),
        },
    )
    if json:
        print_json(found)
    else:
        print_comparison(found, full=full, files=files)
    warn(found["warnings"])


def print_comparison(table: dict[str, Any], *, full: bool, files: ResultFiles) -> None:
    """Print the ranking, then the errors or every figure of the cells, and the runs that were lost.

    Args:
        table: comparison as :func:`spherical_wrist.comparison.report.to_dict` returns it.
        full: print every figure.
        files: files that were written.
    """
    from spherical_wrist.comparison.law_selection import named_laws

    console = printer()
    console.print(Text(_verdict(table), "bold"))
    console.print(_standings(table, console.width))
    console.print(Text(ABOUT, "dim"))
    console.print(Text(f"worst on {worst_in_words(table)}", "dim"))
    console.print()
    console.print(_winners(table, console.width))
    console.print(Text(ABOUT_WINNERS, "dim"))
    every = full or len(table["cells"]) <= FEW
    for block in (_figures if every else _matrix)(table, console.width):
        console.print()
        console.print(block)
    console.print()
    lost = [cell for cell in table["cells"] if cell["outcome"] != "completed"]
    for cell in lost if full else lost[:MOST_LOST]:
        case = f"{cell['case']}, seed {cell['seed']}," if cell["seed"] else cell["case"]
        where = f"{cell['law']} on {case} {cell['outcome']} at {cell['ended_at_s']:.6g} s: {cell['reason']}"
        console.print(Text(where, "red"), soft_wrap=True)
    if len(lost) > MOST_LOST and not full:
        console.print(Text(f"and {len(lost) - MOST_LOST} more lost runs: --full", "red"))
    for note in named_laws(table["laws"]):
        console.print(Text(note, "dim"), soft_wrap=True)
    if files.folder is None:
        console.print(Text("every figure: --full; files and the picture: -o DIR; commands that replay: --json", "dim"))
    recorded = sum(cell["recording"] is not None for cell in table["cells"])
    files.say(", ".join(table["files"]) + (f" and {recorded} recordings" if recorded else ""))


def _verdict(table: Mapping[str, Any]) -> str:
    """Return on how many runs the first law keeps the tip within the bound, and which laws do on all."""
    kept: dict[str, list[bool]] = {}
    for cell in table["cells"]:
        kept.setdefault(cell["law"], []).append(cell["within_bound"])
    bound = "the bound of each case" if table["bound_mm"] is None else f"{table['bound_mm']:g} mm"
    first, always = table["laws"][0]["law"], [law for law, runs in kept.items() if all(runs)]
    said = f"{first} is first: within {bound} in {sum(kept[first])} of {len(kept[first])} runs"
    others = f"in all of them: {', '.join(always)}" if always else "no law is in all of them"
    return said if len(kept) == 1 else f"{said}; {others}"


def worst_in_words(table: Mapping[str, Any]) -> str:
    """Return the cases on which laws have their worst run, each with the places of those laws."""
    places: dict[str, list[str]] = {}
    for row in table["laws"]:
        places.setdefault(row["worst_case"], []).append(f"#{row['rank']}")
    return "; ".join(f"{case}: {' '.join(laws)}" for case, laws in places.items())


def replaced_in_words(replaced: Mapping[str, Sequence[str]]) -> str:
    """Return a warning about cases some of whose parameters have other values than the case says.

    Args:
        replaced: names of the parameters by case.
    """
    names = ", ".join(dict.fromkeys(name for each in replaced.values() for name in each))
    return f"settings take the place of what cases are about ({names}): {', '.join(replaced)}"


def _standings(table: dict[str, Any], width: int) -> Group:
    from spherical_wrist.comparison.report import CHATTERING, ratio_text
    from spherical_wrist.result import counted

    wide = width >= WIDE
    group = list(table["laws"][0]["groups"])[-1]
    failures = any(row["lost"] for row in table["laws"])
    headings = ["#", "law", "med.\n×", "95 %", "worst\n×", *(["on"] if wide else []), "1st", "≤5%"]
    headings += [*(["lost"] if failures else []), *([f"chattering,\n{_first(group)} ×"] if wide else [])]
    rows: list[list[Entry]] = []
    for row in table["laws"]:
        low, high = map(ratio_text, row["median_interval_95"])
        entries: list[Entry] = [str(row["rank"]), Text(row["law"], "bold"), ratio_text(row["median_ratio"])]
        entries += [low if low == high else f"{low}–{high}", ratio_text(row["worst_ratio"])]
        entries += [row["worst_case"]] if wide else []
        entries += [str(row["wins"]), str(row["within_5_percent"])]
        if failures:
            entries.append(Text(str(len(row["lost"])), "red" if row["lost"] else ""))
        if wide:
            spread = row["groups"][group][CHATTERING]
            entries.append("—" if spread is None else f"{spread['mean']:.3g}")
        rows.append(entries)
    runs = sum(len(case["seeds"]) for case in table["cases"])
    title = f"{counted(len(rows), 'law')} × {counted(len(table['cases']), 'case')}"
    once = sum(not case["random"] for case in table["cases"])
    if runs > len(table["cases"]):
        title += f": {runs} runs of each law"
        title += f" ({counted(once, 'case')} once: nothing is random there)" if once else ""
    return fitted(title, headings, rows, width, names=1)


def _first(text: str) -> str:
    return text.partition(" ")[0]


def _winners(table: dict[str, Any], width: int) -> Group:
    """Lay out the winner and the runner-up of every case."""
    from spherical_wrist.comparison.report import ratio_text

    place = {row["law"]: f"#{row['rank']}" for row in table["laws"]}
    wide = width >= WIDE
    rows: list[list[Entry]] = []
    for case in table["cases"]:
        close, second = case["within_5_percent"], case["runner_up"]
        rows.append(
            [
                case["case"],
                Text(case["winner"] or "all lost", "bold"),
                ratio_text(case["runner_up_ratio"]) if second else "—",
                (second if wide else place[second]) if second else "—",
                " ".join(place[law] for law in close[:5]) + ("" if len(close) <= 5 else " …") if wide else "",
                str(len(close)),
                str(len(case["lost_by"])) if case["lost_by"] else "",
            ]
        )
    headings = ["case", "best law", "next\n×", "next", "≤5%", "≤5%", "lost"]
    shown = [column for column in range(len(headings)) if wide or column != 4]
    rows = [[row[column] for column in shown] for row in rows]
    words = (0, 3, 4) if wide else (0,)
    return fitted("which law wins what", [headings[column] for column in shown], rows, width, names=1, words=words)


def _matrix(table: dict[str, Any], width: int) -> Iterator[Group]:
    """Yield tables of ratios to the best law, cases × laws, each with as many laws as fit the terminal."""
    names = [case["case"] for case in table["cases"]]
    rows_of = {(row["law"], row["case"]): row for row in table["standings"]}
    room = max(1, (width - max(map(len, names)) - 1) // len("12345 "))
    for first in range(0, len(table["laws"]), room):
        laws = table["laws"][first : first + room]
        rows = [[case, *(_ratio(rows_of[law["law"], case]) for law in laws)] for case in names]
        title = "× of the laws above, by rank" if not first else ""
        yield fitted(title, ["case", *(f"#{law['rank']}" for law in laws)], rows, width)


def _ratio(row: Mapping[str, Any]) -> Text:
    from spherical_wrist.comparison.ranking import CLOSE
    from spherical_wrist.comparison.report import ratio_text

    best, close = row["rank"] == 1, row["ratio"] is not None and row["ratio"] <= CLOSE
    return Text(
        ratio_text(row["ratio"]), "red" if row["ratio"] is None else "bold green" if best else "green" if close else ""
    )


def _figures(table: dict[str, Any], width: int) -> Iterator[Group]:
    """Yield a table for each case, best law first, with every figure that fits the terminal; medians over the seeds."""
    from spherical_wrist.comparison.report import FIGURES, NARROW, heading, median_figure, ratio_text, seeds_in_words

    rows_of = {(row["law"], row["case"]): row for row in table["standings"]}
    cells: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for cell in table["cells"]:
        cells.setdefault((cell["law"], cell["case"]), []).append(cell)
    for case in table["cases"]:
        name = case["case"]
        own = {law: cells[law, name] for law in case["ranking"]}
        first, *others = FIGURES if width >= WIDE else NARROW
        keys = [first, *(key for key in others if any(median_figure(each, key) is not None for each in own.values()))]
        rows: list[list[Entry]] = []
        for law, each in own.items():
            row = rows_of[law, name]
            low, high = map(ratio_text, row["ratio_range"])
            entries: list[Entry] = [law, ratio_text(row["ratio"]), "" if low == high else f"{low}–{high}"]
            entries += [short(median_figure(each, key)) for key in keys]
            if row["lost_seeds"]:
                entries[3] = Text(next(cell["outcome"] for cell in each if cell["outcome"] != "completed"), "red")
            rows.append(entries)
        headings = ["law", "×", "seeds", *(heading_lines(heading(key)) for key in keys)]
        if not any(row[2] for row in rows):
            headings, rows = headings[:2] + headings[3:], [row[:2] + row[3:] for row in rows]
        said = ". ".join(filter(None, (case["meaning"], seeds_in_words(case), case["discriminates"])))
        yield fitted(f"{name}: {said}", headings, rows, width)
