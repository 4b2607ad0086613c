"""The command that films runs, and its options."""

import os
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from spherical_wrist.cli import completion
from spherical_wrist.cli.app import Option, app


@app.command()
def render(
    recording: Annotated[
        Path,
        typer.Argument(metavar="FILE.rrd", help="recording made by wrist run", autocompletion=completion.recordings),
    ],
    output: Annotated[
        Path | None, Option("--output", "-o", metavar="FILE.mp4|.gif", help="film to write [that of FILE.rrd, as .mp4]")
    ] = None,
    speed: Annotated[float | None, Option(metavar="FACTOR", help="0.25 is slowed four times [1]")] = None,
    fps: Annotated[
        float | None, Option(metavar="N", help="frames per second; of a GIF, 100/N is rounded [30; GIF: 20]")
    ] = None,
    size: Annotated[str | None, Option(metavar="WIDTHxHEIGHT", help="pixels, even numbers for MP4 [1280x720]")] = None,
    from_: Annotated[float | None, Option("--from", metavar="SECONDS", help="simulated time to begin with")] = None,
    to: Annotated[float | None, Option("--to", metavar="SECONDS", help="simulated time to end with")] = None,
    camera: Annotated[
        str | None, Option(metavar="NAME", help="camera of the model, or free [overview, or else free]")
    ] = None,
    no_ghost: Annotated[bool, Option("--no-ghost", help="do not show the desired attitude")] = False,
    frame: Annotated[
        Path | None, Option("--frame", metavar="FILE.png", help="make a still picture instead of a film")
    ] = None,
    at: Annotated[
        float | None,
        Option("--at", metavar="SECONDS", help="time of the still picture [that of the largest tip error]"),
    ] = None,
    json: Annotated[bool, Option("--json", help="print one JSON object and nothing else")] = False,
) -> int:
    """Film a recorded run, rendered by MuJoCo; no screen is needed.

    The wrist as it moved, the desired attitude as a green ghost, and where the tool tip was (orange) and was to be
    (green) in the last 1.5 s. A run that diverged is shown to its end.

    MP4 (H.264) plays in every browser and needs PyAV: pip install 'spherical-wrist[video]'. A GIF shows every frame for
    a multiple of 10 ms: 20, 25 or 50 frames a second are exact, 30 become 33.3.

    Rendering needs OpenGL. On Linux that is EGL, unless MUJOCO_GL says osmesa or glfw; on Debian and Ubuntu:
    apt install libegl1 libgl1-mesa-dri libopengl0.

    Exit code: 0 rendered, 2 wrong input, 130 or 143 stopped by a signal (no film is left).
    """
    _import_mujoco()
    from spherical_wrist.cli.render import RenderOptions, render_recording

    shot = {"speed": speed, "fps": fps, "size": size, "start": from_, "end": to, "camera": camera}
    options = RenderOptions(output, frame, at, not no_ghost, json)
    return render_recording(recording, {name: value for name, value in shot.items() if value is not None}, options)


def _import_mujoco() -> None:
    """Imports mujoco without OpenGL: it would load what MUJOCO_GL names, and break where that is not there.

    What is rendered with is chosen later, and what it lacks then said in one line.
    """
    wanted = os.environ.get("MUJOCO_GL")
    os.environ["MUJOCO_GL"] = "off"
    try:
        import_module("mujoco")
    finally:
        if wanted is None:
            del os.environ["MUJOCO_GL"]
        else:
            os.environ["MUJOCO_GL"] = wanted
