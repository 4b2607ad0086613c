"""The command that replays recordings, and its options."""

from pathlib import Path
from typing import Annotated

import typer

from spherical_wrist.cli import completion
from spherical_wrist.cli.app import Option, app


@app.command()
def replay(
    recording: Annotated[
        Path,
        typer.Argument(metavar="FILE.rrd", help="recording made by wrist run", autocompletion=completion.recordings),
    ],
    trust: Annotated[
        bool, Option("--trust", help="run Python code (a law of one's own, say) that the recording carries")
    ] = False,
    extract: Annotated[
        Path | None, Option(metavar="DIR", help="only write the files that the recording carries to a folder")
    ] = None,
    json: Annotated[bool, Option("--json", help="print one JSON object and nothing else")] = False,
) -> int:
    """Simulate a recording again from what is inside it, and compare bit for bit.

    The recording carries its experiment, its model with meshes, recorded motions and Python files of the user's own:
    nothing else is looked at. Where the bits differ, it says where first, by how much, and which versions or
    processor may be the cause.

    Exit code: 0 bit-identical, 1 different, 2 it cannot be replayed, 130 or 143 stopped by a signal.
    """
    from spherical_wrist.cli.replay import extract_files, replay_recording

    if extract is not None:
        extract_files(recording, extract)
        return 0
    return replay_recording(recording, trust, json)
