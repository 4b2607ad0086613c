"""The commands and their options."""

from pathlib import Path
from typing import Annotated, Any

import typer

from spherical_wrist.cli import completion

app = typer.Typer(
    name="wrist",
    help="Closed-loop simulation of a surgical wrist on a ball joint, in MuJoCo, recorded with Rerun.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Option = typer.Option


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"spherical-wrist {version('spherical-wrist')}")
        raise typer.Exit


@app.callback()
def wrist(version: Annotated[bool, Option("--version", callback=_version, is_eager=True)] = False) -> None:
    """Closed-loop simulation of a surgical wrist on a ball joint, in MuJoCo, recorded with Rerun."""


@app.command()
def run(
    experiment: Annotated[Path | None, typer.Argument(help="experiment file; options take precedence over it")] = None,
    law: Annotated[
        str | None,
        Option(
            help="control law, or path/to/file.py:Name [fuzzy_sliding_computed_torque]", autocompletion=completion.laws
        ),
    ] = None,
    reference: Annotated[
        str | None,
        Option(
            help="desired motion, recorded:FILE, or path/to/file.py:Name [lissajous]",
            autocompletion=completion.references,
        ),
    ] = None,
    disturbance: Annotated[
        float | None, Option(metavar="LEVEL", help="disturbance as a fraction of the peak nominal torque [0.25]")
    ] = None,
    disturbance_shape: Annotated[
        str | None,
        Option(
            metavar="SHAPE",
            help="shape of the disturbance, or path/to/file.py:Name [constant]",
            autocompletion=completion.disturbances,
        ),
    ] = None,
    mass_scale: Annotated[float | None, Option(help="scale of the plant's mass and inertia [1.25]")] = None,
    hardware: Annotated[
        str | None,
        Option(
            metavar="NAME",
            help="sensors, motors and friction: ideal or realistic [ideal]",
            autocompletion=completion.hardware,
        ),
    ] = None,
    payload: Annotated[float | None, Option(metavar="KG", help="point mass at the plant's tool tip [0]")] = None,
    duration: Annotated[float | None, Option(metavar="SECONDS", help="simulated time [10]")] = None,
    control_period: Annotated[
        float | None, Option(metavar="SECONDS", help="time from torque to torque [0.001]")
    ] = None,
    seed: Annotated[int | None, Option(help="seed of everything random [0]")] = None,
    model: Annotated[Path | None, Option(metavar="FILE.xml", help="MJCF of the wrist [the package's own]")] = None,
    joint: Annotated[str | None, Option(metavar="NAME", help="ball joint of a model that has several")] = None,
    motors: Annotated[
        str | None, Option(metavar="A,B,C", help="motors on that joint, of a model that has more than three")
    ] = None,
    tip: Annotated[str | None, Option(metavar="SITE", help="site of the tool tip [tip]")] = None,
    set_: Annotated[
        list[str] | None,
        Option(
            "--set",
            metavar="NAME=VALUE",
            help="any parameter, such as law.K=0.02; may be repeated (see wrist list)",
            autocompletion=completion.settings,
        ),
    ] = None,
    output: Annotated[Path, Option("--output", "-o", metavar="FILE.rrd", help="recording to write")] = Path(
        "wrist.rrd"
    ),
    no_recording: Annotated[bool, Option("--no-recording", help="write no recording")] = False,
    record_every: Annotated[int, Option(metavar="N", help="record every N-th control instant only")] = 1,
    live: Annotated[bool, Option("--live", help="show the run while it is simulated, in an open wrist view")] = False,
    viewer: Annotated[
        str | None, Option(metavar="HOST:PORT", help="the viewer to show it live in [127.0.0.1:9876]")
    ] = None,
    json: Annotated[bool, Option("--json", help="print one JSON object and nothing else")] = False,
) -> int:
    """Simulate a closed loop, print how well it tracked, and record it.

    Without arguments: the fuzzy law on a Lissajous motion for 10 s, against a constant disturbance of 25 % and a plant
    25 % heavier than the controller believes. Values in brackets are the defaults.

    Exit code: 0 completed, 1 diverged, 2 wrong input, 130 or 143 stopped by a signal (what was simulated is kept).
    """
    from spherical_wrist.cli.run import RunOptions, run_experiment
    from spherical_wrist.experiment.presets import hardware as preset

    given: dict[str, Any] = {
        **(preset(hardware) if hardware is not None else {}),
        "law": law,
        "reference": reference,
        "disturbance.name": disturbance_shape,
        "disturbance.level": disturbance,
        "mass_scale": mass_scale,
        "payload": payload,
        "duration": duration,
        "control_period": control_period,
        "seed": seed,
        "model": model,
        "joint": joint,
        "motors": motors,
        "tip": tip,
    }
    changes = {name: value for name, value in given.items() if value is not None}
    if disturbance is not None:
        changes["disturbance.amplitude"] = None  # a level takes the place of a torque
    options = RunOptions(None if no_recording else output, record_every, json, live or viewer is not None, viewer)
    return run_experiment(experiment, changes, set_ or [], options)


@app.command(name="list")
def list_(
    json: Annotated[bool, Option("--json", help="print one JSON object and nothing else")] = False,
) -> None:
    """List laws, references, disturbances, sensors, motors and an experiment's parameters, with units and defaults."""
    from spherical_wrist.cli.list import list_parameters

    list_parameters(json)


@app.command()
def paper(
    output: Annotated[Path, Option("--output", "-o", metavar="DIR", help="folder to write")] = Path("paper"),
    json: Annotated[bool, Option("--json", help="print one JSON object and nothing else")] = False,
) -> None:
    """Regenerate the evaluation of the source paper: its table and figures, and a verdict on each of its claims."""
    from spherical_wrist.cli.paper import regenerate_paper

    regenerate_paper(output, json)
