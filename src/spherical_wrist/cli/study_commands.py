"""The commands that compare laws, and their options."""

from pathlib import Path
from typing import Annotated

import typer

from spherical_wrist.cli import completion
from spherical_wrist.cli.app import Option, app

Experiment = Annotated[
    Path | None, typer.Argument(metavar="EXPERIMENT.toml", help="experiment that the cases change [the default one]")
]
Laws = Annotated[
    list[str] | None,
    Option(
        "--law",
        metavar="LAW",
        help="'NAME', 'NAME PARAMETER=VALUE ...', path/to/file.py:Name, or an experiment file; may be repeated [all]",
        autocompletion=completion.laws,
    ),
]
Settings = Annotated[
    list[str] | None,
    Option(
        "--set",
        metavar="NAME=VALUE",
        help="any parameter, in every run; may be repeated (see wrist list)",
        autocompletion=completion.settings,
    ),
]
Duration = Annotated[float | None, Option(metavar="SECONDS", help="simulated time of every run [10]")]
Seed = Annotated[int | None, Option(help="seed of everything random [0]")]
Jobs = Annotated[int | None, Option(metavar="N", help="runs at a time [one a core]")]
Folder = Annotated[Path | None, Option("--output", "-o", metavar="DIR", help="folder to write to [write nothing]")]
Json = Annotated[bool, Option("--json", help="print one JSON object and nothing else")]


@app.command()
def compare(
    experiment: Experiment = None,
    law: Laws = None,
    case: Annotated[list[str] | None, Option(metavar="NAME", help="case of the suite; may be repeated [all]")] = None,
    cases: Annotated[Path | None, Option(metavar="FILE.toml", help="a suite of your own: tables [[case]]")] = None,
    set_: Settings = None,
    duration: Duration = None,
    seed: Seed = None,
    output: Folder = None,
    record: Annotated[
        list[str] | None,
        Option(metavar="LAW:CASE", help="record this run to DIR, or those that match 'pd:*', or all; may be repeated"),
    ] = None,
    full: Annotated[bool, Option("--full", help="print every figure of every law on every case")] = False,
    jobs: Jobs = None,
    json: Json = False,
) -> None:
    """Compare laws on a suite of cases, and rank them.

    The suite: disturbances and wrong masses with ideal sensors and motors, then every fault of sensors and motors by
    itself, then all of them together. A case of your own is a table of a FILE.toml with a name and any parameters:
    [[case]] name = "late", sensing.delay = 0.002.

    The score of a law is the geometric mean, over the cases, of its RMS error as a multiple of the best law's. With
    -o: comparison.json, .csv, .md, and a picture of error against chattering as .png and .svg.

    Exit code: 0 compared (laws may have diverged), 2 wrong input, 130 stopped by Ctrl-C.
    """
    from spherical_wrist.cli.compare import CompareOptions, compare_laws

    options = CompareOptions(law or [], case or [], cases, output, record or [], full, jobs, json)
    compare_laws(experiment, _changes(duration, seed), set_ or [], options)


@app.command()
def frontier(
    experiment: Experiment = None,
    law: Laws = None,
    axis: Annotated[
        list[str] | None,
        Option(metavar="NAME", help="mass, com, disturbance, delay or noise; may be repeated [all]"),
    ] = None,
    bound: Annotated[float, Option(metavar="MM", help="largest tip error in the steady window [0.1]")] = 0.1,
    tolerance: Annotated[float, Option(metavar="FRACTION", help="of the values found, relative [0.02]")] = 0.02,
    set_: Settings = None,
    duration: Duration = None,
    seed: Seed = None,
    output: Folder = None,
    jobs: Jobs = None,
    json: Json = False,
) -> None:
    """Find how far from the nominal wrist each law keeps the tool tip within a bound.

    Along each axis (mass, centre of mass, disturbance, delay, attitude noise) alone, values grow until the largest tip
    error exceeds the bound or the run diverges; bisection then finds the first miss. No value tested below it missed;
    what lies between tested values is not known. Everything else is as the experiment says: without one, the
    Lissajous motion of a plant that is as the controller believes, undisturbed.

    The bound of 0.1 mm is what coronary surgery typically needs (Bachta et al., 2011). With -o: frontier.json, .png
    and .svg.

    Exit code: 0 found, 2 wrong input, 130 stopped by Ctrl-C.
    """
    from spherical_wrist.cli.frontier import FrontierOptions, find_frontier

    options = FrontierOptions(law or [], axis or [], bound, tolerance, output, jobs, json)
    find_frontier(experiment, _changes(duration, seed), set_ or [], options)


def _changes(duration: float | None, seed: int | None) -> dict[str, float | int]:
    given = {"duration": duration, "seed": seed}
    return {name: value for name, value in given.items() if value is not None}
