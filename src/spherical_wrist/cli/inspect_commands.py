"""The commands that look at recordings, and their options."""

from pathlib import Path
from typing import Annotated

import typer

from spherical_wrist.cli import completion
from spherical_wrist.cli.app import Option, app

Json = Annotated[bool, Option("--json", help="print one JSON object and nothing else")]


@app.command()
def inspect(
    recording: Annotated[
        Path,
        typer.Argument(metavar="FILE.rrd", help="recording made by wrist run", autocompletion=completion.recordings),
    ],
    plot: Annotated[
        list[Path] | None,
        Option("--plot", metavar="OUT.png|.svg", help="draw the run on one sheet; may be repeated"),
    ] = None,
    export: Annotated[
        list[Path] | None,
        Option("--export", metavar="OUT.csv|.parquet|.npz", help="write every array of the series; may be repeated"),
    ] = None,
    json: Json = False,
) -> None:
    """Show what was run, with which versions, and check the stored metrics against the recorded series.

    The sheet has attitude, errors, torque and disturbance over time and the phase portrait of every axis; sliding
    surface, boundary layer and slope where the law has them; faults of sensors and motors where they are not ideal.

    An export has every number bit for bit: CSV and Parquet as one column a component, named like error_x_rad, NPZ as
    NumPy arrays. Parquet and NPZ also carry experiment, outcome, metrics and versions as JSON. (With pandas, read the
    CSV with float_precision="round_trip".)

    Exit code: 0 consistent, 2 wrong input, or a recording that contradicts itself (nothing is written then).
    """
    from spherical_wrist.cli.inspect import inspect_recording

    inspect_recording(recording, plot or [], export or [], json)


@app.command()
def diff(
    a: Annotated[
        Path, typer.Argument(metavar="A.rrd", help="recording made by wrist run", autocompletion=completion.recordings)
    ],
    b: Annotated[Path, typer.Argument(metavar="B.rrd", help="another one", autocompletion=completion.recordings)],
    tolerance: Annotated[
        float,
        Option(
            metavar="SIZE",
            help="difference that counts as none, in the unit of each array: rad, rad/s, N·m, m … [0: same bits]",
        ),
    ] = 0.0,
    plot: Annotated[
        list[Path] | None,
        Option("--plot", metavar="OUT.png|.svg", help="draw the differences over time; may be repeated"),
    ] = None,
    json: Json = False,
) -> int:
    """Show how two runs differ: experiments, versions, outcomes, metrics, and where their series part.

    Series are compared over the instants that both have, so a thinned recording fits a full one, and a short one the
    beginning of a long one. The difference of a row is the Euclidean norm of that of its vectors; of attitudes, the
    angle between them, in which q and −q are one.

    Exit code: 0 the same experiment with the same series (versions, wall time and thinning do not count), 1 they
    differ, 2 wrong input.
    """
    from spherical_wrist.cli.diff import diff_recordings

    return diff_recordings(a, b, tolerance, plot or [], json)
