"""``wrist plot``: errors and torque of several laws or recordings over time, in one figure."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option

from spherical_wrist.cli import completion
from spherical_wrist.cli.options import (
    CaseFile,
    Changes,
    Hardware,
    Jobs,
    Json,
    Laws,
    Settings,
    Width,
    read_experiment,
    with_parameters,
)
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.options import OPTIONS

if TYPE_CHECKING:
    from spherical_wrist.control import Law
    from spherical_wrist.simulation.run import Run

CHOSEN = [option.parameter for option in OPTIONS if option.parameter != "law"]


@with_parameters(*CHOSEN)
def command(
    *,
    recordings: Annotated[
        list[str] | None,
        Argument(
            metavar="[NAME=]FILE.rrd",
            help="recordings made by wrist run; for --law also an EXPERIMENT.toml",
            autocompletion=completion.recordings,
        ),
    ] = None,
    output: Annotated[
        list[Path] | None,
        Option("--output", "-o", metavar="OUT.png|.svg|.pdf|.pgf", help="picture to write; may be repeated"),
    ] = None,
    law: Laws = None,
    case: Annotated[str | None, Option("--case", metavar="NAME", help="case of wrist compare for the laws")] = None,
    cases: CaseFile = None,
    changes: Changes,
    hardware: Hardware = None,
    set_: Settings = None,
    from_: Annotated[float | None, Option("--from", metavar="SECONDS", help="begin of what is drawn")] = None,
    to: Annotated[float | None, Option("--to", metavar="SECONDS", help="end of what is drawn")] = None,
    width: Width = None,
    jobs: Jobs = None,
    json: Json = False,
) -> None:
    """Tip error with its bound, attitude error and torque over time: of recordings, and of laws that run for it.

    wrist plot a.rrd b.rrd -o errors.pdf draws two recordings, wrist plot --law pd --law mine=my.py:Law --case heart -o
    errors.pdf two laws on one case. Your own laws stand out. Grey: outside of the steady window, over which figures are
    computed. A cross: where a run was lost.

    Exit code: 0 drawn, 2 wrong input, 130 stopped by Ctrl-C.

    Raises:
        ParameterError: there is nothing to draw, or options contradict each other.
    """
    from spherical_wrist.cli.output import warn
    from spherical_wrist.cli.results import result_files
    from spherical_wrist.cli.tables import print_json
    from spherical_wrist.comparison.bounds import BOUNDS
    from spherical_wrist.files import write_together
    from spherical_wrist.inspection.runs_picture import runs_picture
    from spherical_wrist.measure.warnings import summarized
    from spherical_wrist.picture_file import picture_content

    given = recordings or []
    if not output:
        words = [*given, *(word for each in law or [] for word in ("--law", each))] or ["run.rrd"]
        raise ParameterError(f"name the picture: {shlex.join(['wrist', 'plot', *words, '-o', 'errors.pdf'])}")
    files = result_files(None, output, None, width)
    sources = [each for each in given if not each.endswith(".toml")]
    experiments = [Path(each) for each in given if each.endswith(".toml")]
    if len(experiments) > 1 or (experiments and not law):
        raise ParameterError("an experiment file is for laws: give one, and laws with --law")
    if not sources and not law:
        raise ParameterError(
            "there is nothing to draw: give recordings, as in wrist plot run.rrd -o errors.pdf, or laws, as in "
            "wrist plot --law pd --law slotine_li -o errors.pdf"
        )
    if from_ is not None and to is not None and not from_ < to:
        raise ParameterError(f"--from {from_:g} --to {to:g}: the begin must be before the end")
    runs, statuses = _recorded(sources)
    if law:
        tables, every = read_experiment(experiments[0] if experiments else None, hardware, changes, set_)
        made = _simulated(law, tables, every, case, cases, jobs)
        for label, (run, status) in made.items():
            name = label if label not in runs else f"{label} (run now)"
            runs[name], statuses[name] = run, status
    empty = [label for label, run in runs.items() if not len(run) or not _reaches(run, from_, to)]
    if empty:
        raise ParameterError(f"nothing of {', '.join(empty)} is within the time that is drawn")
    drawing = runs_picture(
        runs, statuses, files.width, bound=BOUNDS["max_tip_error_mm"], attitude_bound=BOUNDS["max_error_rad"],
        window=(from_, to),
    )  # fmt: skip
    write_together({file: picture_content(drawing, file) for file in output}, "picture")
    if json:
        print_json({"plots": [str(file) for file in output], "runs": [_summary(*item) for item in runs.items()]})
    else:
        files.say()
    warn(summarized({label: run.metrics for label, run in runs.items() if not run.outcome.status.lost}))


def _recorded(sources: list[str]) -> tuple[dict[str, Run], dict[str, str]]:
    """Return recorded runs and the statuses of their laws by label: a name that is given, that of the law, or both."""
    from spherical_wrist.control import Law
    from spherical_wrist.files import note_input
    from spherical_wrist.recording.runs import load_recording

    found = []
    for source in sources:
        label, equals, file = source.partition("=")
        if not equals or "/" in label or Path(source).exists():
            label, file = "", source
        note_input(Path(file))
        run = load_recording(Path(file))
        name = str(run.description["law"]["name"]).rpartition("/")[2]
        found.append((label, name, file, run))
    names = [name for label, name, *_ in found if not label]
    runs: dict[str, Run] = {}
    statuses: dict[str, str] = {}
    for label, name, file, run in found:
        shown = label or (name if names.count(name) == 1 else f"{name} ({Path(file).stem})")
        if shown in runs:
            raise ParameterError(f"two recordings would be called {shown!r}: give names, such as mine={file}")
        runs[shown] = run
        law: type[Law] | None = Law.members.get(name)  # type: ignore[assignment]
        statuses[shown] = "user" if law is None else law.status
    return runs, statuses


def _simulated(
    texts: list[str],
    tables: Mapping[str, Any],
    every: Changes,
    case: str | None,
    cases: Path | None,
    jobs: int | None,
) -> Mapping[str, tuple[Run, str]]:
    """Run laws on one experiment, or on one case; return runs and statuses by label."""
    from spherical_wrist.cli.progress import counting
    from spherical_wrist.comparison.cases import DEFAULT, read_cases, select
    from spherical_wrist.comparison.law_selection import laws_from_texts
    from spherical_wrist.experiment.description import Experiment, with_changes
    from spherical_wrist.simulation.runner import Runner

    laws = laws_from_texts(texts, tables, every)
    shared = {name: value for name, value in every.items() if not name.startswith("law.")}

    def experiment(law: Law) -> Experiment:
        if chosen is not None:
            return chosen.experiment(tables, {**shared, "law": law})
        return Experiment(**with_changes(tables, {**shared, "law": law}))

    chosen = select(read_cases(cases) if cases else DEFAULT, [case])[0] if case else None
    work = [experiment(law) for law in laws.values()]
    with counting("simulating") as progress:
        runs = Runner(jobs).map(lambda each, worker: worker.simulate(each), work, progress, lambda each: each.law.name)
    return {label: (run, law.status) for (label, law), run in zip(laws.items(), runs, strict=True)}


def _reaches(run: Run, begin: float | None, end: float | None) -> bool:
    first, last = float(run.time[0]), float(run.time[-1])
    return (begin is None or begin < last or first == last) and (end is None or end > first)


def _summary(label: str, run: Run) -> dict[str, Any]:
    return {
        "label": label,
        "law": run.description["law"],
        "outcome": str(run.outcome.status),
        "ended_at_s": run.outcome.time,
        "metrics": dict(run.metrics),
    }
