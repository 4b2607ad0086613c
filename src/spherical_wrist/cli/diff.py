"""``wrist diff``: differences between two runs."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.console import Console
from rich.table import Table
from rich.text import Text
from typer import Argument, Option

from spherical_wrist.cli import completion
from spherical_wrist.cli.options import Json, Plots, Width
from spherical_wrist.cli.tables import Entry, fitted, number, print_json, printer
from spherical_wrist.errors import ParameterError

if TYPE_CHECKING:
    from spherical_wrist.inspection.difference import ArrayDifference, Difference
    from spherical_wrist.inspection.run_difference import MetricPair, RunDifference
    from spherical_wrist.simulation.run import Run

DIFFERENT = 1


def command(
    a: Annotated[
        Path, Argument(metavar="A.rrd", help="recording made by wrist run", autocompletion=completion.recordings)
    ],
    b: Annotated[Path, Argument(metavar="B.rrd", help="another one", autocompletion=completion.recordings)],
    tolerance: Annotated[
        float,
        Option(
            metavar="SIZE",
            help="difference that counts as none, in the unit of each array: rad, rad/s, N·m, m … [0: same bits]",
        ),
    ] = 0.0,
    plot: Plots = None,
    width: Width = None,
    json: Json = False,
) -> int:
    """Series are compared over the instants that both have: a thinned recording fits a full one, a short a long one.

    The difference of a row is the Euclidean norm of that of its vectors; of attitudes, the angle between them, in which
    q and −q are one. A plot shows the differences over time.

    Exit code: 0 the same experiment with the same series (versions, wall time and thinning do not count), 1 they
    differ, 2 wrong input.

    Raises:
        ParameterError: options contradict each other, or a value is not valid.
    """
    from spherical_wrist.files import check_writable, note_input, write_together
    from spherical_wrist.inspection.run_difference import run_difference, to_dict
    from spherical_wrist.picture_file import PICTURES, check_ending
    from spherical_wrist.picture_style import WIDTHS, width_inches
    from spherical_wrist.recording.runs import load_recording

    plots = plot or []
    if not 0.0 <= tolerance < inf:
        raise ParameterError(f"--tolerance {tolerance:g}: a number of 0 or more is needed, such as 1e-9")
    inches = WIDTHS["two-column"] if width is None else width_inches(width)
    for recording in (a, b):
        note_input(recording)
    for file in plots:
        check_ending(file, "picture", PICTURES)
        check_writable(file, "picture")
    runs = load_recording(a), load_recording(b)
    difference = run_difference(*runs, tolerance)
    if plots:
        from spherical_wrist.inspection.difference_picture import difference_picture
        from spherical_wrist.picture_file import picture_content

        drawing = difference_picture(*runs, difference.series, (a.name, b.name), inches)
        write_together({file: picture_content(drawing, file) for file in plots}, "picture")
    if json:
        print_json({"a": str(a), "b": str(b), "plots": [str(file) for file in plots], **to_dict(difference)})
    else:
        _print(difference, runs, (a, b), plots)
    return 0 if difference.same else DIFFERENT


def _print(found: RunDifference, runs: tuple[Run, Run], paths: tuple[Path, Path], plots: list[Path]) -> None:
    from spherical_wrist.cli.output import headline, thinning, verdict_text, warn
    from spherical_wrist.cli.parameters_table import written

    console = printer()
    console.print(_verdict(found))
    for side, path, run in zip("AB", paths, runs, strict=True):
        console.print(Text.assemble((side, "bold"), "  ", (str(path), "bold"), f"  {len(run)} samples", thinning(run)))
        console.print(Text("   ") + headline(run) + Text(": ") + verdict_text(run.verdict), soft_wrap=True)
        warn(f"{side}: {warning}" for warning in run.warnings)
    width = console.width
    if found.settings:
        rows: list[list[Entry]] = [[each.name, *map(written, each[2:]), each.unit] for each in found.settings]
        _columns(console, "Experiment", ["parameter", "A", "B", ""], rows)
    if found.versions:
        rows = [[name, *(version or "—" for version in pair)] for name, pair in found.versions.items()]
        _columns(console, "Versions", ["", "A", "B"], rows)
    if any(figure.a != figure.b for figure in found.metrics.values()):
        rows = [_metric(name, figure) for name, figure in found.metrics.items() if figure != (None, None)]
        console.print(fitted("Metrics", ["", "A", "B", "change", ""], rows, width))
    series = found.series
    parted = [array for array in series.arrays if array.first is not None]
    if parted:
        headings = ["", "first at\n[s]", "row\nin A", "largest", "at\n[s]", "RMS", ""]
        console.print(fitted("Series", headings, [_row(array) for array in parted], width))
    for line in _notes(found):
        console.print(line)
    for plot in plots:
        console.print(Text.assemble("picture written to ", (str(plot), "bold")), soft_wrap=True)


def _columns(console: Console, title: str, headings: list[str], rows: list[list[Entry]]) -> None:
    """Print a table whose values wrap if the terminal is too narrow; names and units do not."""
    table = Table(
        title=title, title_justify="left", title_style="bold", box=None, padding=(0, 2, 0, 0), header_style="dim"
    )
    for heading in headings:
        table.add_column(Text(heading), overflow="fold", no_wrap=heading not in ("A", "B"))
    for row in rows:
        table.add_row(*(Text(entry) if isinstance(entry, str) else entry for entry in row))
    console.print(table)


def _metric(name: str, figure: MetricPair) -> list[Entry]:
    from spherical_wrist.cli.output import metric_figure
    from spherical_wrist.measure.metrics import METRICS

    metric, change = METRICS[name], figure.change
    if change is None:
        text = "—"
    elif abs(change) < 10.0:
        text = f"{100.0 * change:+.3g} %" if change else "0"
    else:
        text = f"× {change + 1.0:.3g}"
    return [
        metric.label,
        *(metric_figure(name, value) for value in (figure.a, figure.b)),
        text,
        Text(metric.shown_unit, "dim"),
    ]


def _row(array: ArrayDifference) -> list[Entry]:
    first, worst = array.first, array.largest_at
    style = "dim" if array.same else ""
    texts = [
        array.name,
        f"{first.time:.6g}" if first else "—",
        str(first.row_a) if first else "—",
        number(array.largest),
        f"{worst.time:.6g}" if worst else "—",
        number(array.rms),
        array.unit,
    ]
    return [Text(text, style) for text in texts]


def _notes(found: RunDifference) -> Iterator[Text]:
    """Yield notes on arrays, and on the extent of the comparison."""
    series = found.series
    for array in series.arrays:
        if not array.comparable:
            in_a, in_b = (f"{count} a row" if count else "none" for count in array.components)
            yield Text(f"{array.name}: {in_a} in A, {in_b} in B", "yellow")
        if array.undefined:
            yield Text(f"{array.name}: {array.undefined} rows in which only one of both is a finite number", "yellow")
    same = [array.name for array in series.arrays if array.comparable and array.first is None]
    if same and series.common:
        yield Text(f"bit for bit the same: {', '.join(same)}", "dim")
    yield from _extent(series)


def _extent(series: Difference) -> Iterator[Text]:
    if series.common_span is None:
        yield Text("the series have no instant in common", "yellow")
        return
    begin, end = series.common_span
    text = f"compared: {series.common} instants that both have, t = {begin:g} … {end:.6g} s"
    if not series.whole:
        ends = ", ".join(f"{side} to {span[1]:.6g} s" for side, span in zip("AB", series.spans, strict=True) if span)
        text += f"; one goes on where the other has ended ({ends})"
    yield Text(text, "dim" if series.whole else "yellow")


def _verdict(found: RunDifference) -> Text:
    series = found.series
    within = f" (within {series.tolerance:g} of each unit)" if series.tolerance else ", bit for bit"
    if found.same:
        return Text(f"the same experiment with the same series{within}", "bold green")
    parts = [f"{len(found.settings)} parameters" if len(found.settings) != 1 else "1 parameter"] * bool(found.settings)
    parts += ["the outcome"] * (not found.same_outcome)
    first = series.first
    if first is not None:
        parts.append(f"the series, from t = {first.time:.6g} s (row {first.row_a} of A, {first.row_b} of B)")
    elif not series.same:
        parts.append("the extent of the series")
    return Text(f"different: {'; '.join(parts)}", "bold red")
