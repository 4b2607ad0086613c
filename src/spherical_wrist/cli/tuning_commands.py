"""The command that tunes gains, and its options."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from spherical_wrist.cli import completion
from spherical_wrist.cli.app import Option, app


class Sampler(StrEnum):
    """Ways to propose gains."""

    NSGA2 = "nsga2"
    TPE = "tpe"


@app.command()
def tune(
    law: Annotated[
        str,
        typer.Argument(
            metavar="LAW",
            help="'NAME', 'NAME PARAMETER=VALUE ...', path/to/file.py:Name, or an experiment file",
            autocompletion=completion.laws,
        ),
    ],
    case: Annotated[
        list[str] | None, Option(metavar="NAME", help="case to tune for; may be repeated [six of wrist compare's]")
    ] = None,
    cases: Annotated[Path | None, Option(metavar="FILE.toml", help="a suite of your own: tables [[case]]")] = None,
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
    set_: Annotated[
        list[str] | None,
        Option(
            "--set",
            metavar="NAME=VALUE",
            help="any parameter, in every run; may be repeated (see wrist list)",
            autocompletion=completion.settings,
        ),
    ] = None,
    duration: Annotated[float | None, Option(metavar="SECONDS", help="simulated time of every run [10]")] = None,
    seed: Annotated[int | None, Option(help="seed of everything random [0]")] = None,
    output: Annotated[
        Path | None, Option("--output", "-o", metavar="DIR", help="folder of the study [tune-LAW]")
    ] = None,
    jobs: Annotated[int | None, Option(metavar="N", help="runs at a time [one a core]")] = None,
    json: Annotated[bool, Option("--json", help="print one JSON object and nothing else")] = False,
) -> int:
    """Tune the gains of a law: small errors against little chattering, over a family of perturbed wrists.

    Every set of gains runs all cases. What counts are the geometric means of the RMS error and of the chattering over
    them; gains with which a case diverges, or has more tip error than --bound, are out. The default gains are tried
    first. What is found is a front: gains that no other ones beat in both. Each is written as an experiment file that
    wrist run takes.

    The study is kept in DIR/tune.db: the same command goes on with it, with more --trials, or after Ctrl-C. With the
    same seed it comes to the same gains, however often it was stopped and whatever --jobs says. DIR also gets
    tune.json, front.png, front.svg and front/trial-N.toml.

    The family, where --case and --cases do not say: wrong masses and torques with ideal hardware, and every fault of
    sensors and motors on three motions. Needs Optuna: pip install 'spherical-wrist[tune]'.

    Exit code: 0 tuned, 2 wrong input, 130 or 143 stopped by a signal (what was tried is kept).
    """
    from spherical_wrist.cli.tune import TuneOptions, tune_law

    given = {"duration": duration, "seed": seed}
    changes = {name: value for name, value in given.items() if value is not None}
    options = TuneOptions(
        case or [], cases, parameter or [], per_axis, bound, trials, sampler.value, seed or 0, output, jobs, json
    )
    return tune_law(law, changes, set_ or [], options)
