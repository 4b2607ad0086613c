"""``wrist render``: a recording to a film or to a still picture."""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from rich.text import Text
from typer import Option

from spherical_wrist.cli.options import Json, RecordingFile
from spherical_wrist.cli.tables import print_json, printer

if TYPE_CHECKING:
    from spherical_wrist.film import Film

ONLY_FILMS = {"speed": "--speed", "fps": "--fps", "start": "--from", "end": "--to"}
"""Options that a still picture does not have, keyed by the setting that they change."""


def command(
    recording: RecordingFile,
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
    json: Json = False,
) -> int:
    """The film shows the wrist as it moved, the desired attitude as a green ghost, and the path of the tool tip.

    The path is that of the last 1.5 s: where the tip was (orange) and was to be (green). A run that diverged is shown
    to its end.

    MP4 (H.264) plays in every browser and needs PyAV: pip install 'spherical-wrist[video]'. A GIF shows every frame for
    a multiple of 10 ms: 20, 25 or 50 frames a second are exact, 30 become 33.3.

    Rendering needs OpenGL. On Linux that is EGL, unless MUJOCO_GL says osmesa or glfw; on Debian and Ubuntu:
    apt install libegl1 libgl1-mesa-dri libopengl0.

    Exit code: 0 rendered, 2 wrong input, 130 or 143 stopped by a signal (no film is left).

    Raises:
        ParameterError: options contradict each other, or a value is not valid.
    """
    _import_mujoco()
    from spherical_wrist.cli.progress import counting
    from spherical_wrist.cli.signals import Stopped, stopping
    from spherical_wrist.errors import ParameterError
    from spherical_wrist.film import FilmSettings, render_film, render_picture
    from spherical_wrist.recording.runs import load_recording

    given = {"speed": speed, "fps": fps, "size": size, "start": from_, "end": to, "camera": camera}
    settings: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    if frame is None and at is not None:
        raise ParameterError("--at is the time of a still picture: give --frame FILE.png too, or --from and --to")
    useless = [option for name, option in ONLY_FILMS.items() if name in settings] + ["-o"] * bool(output)
    if frame is not None and useless:
        raise ParameterError(f"{useless[0]} is for films, and --frame makes a still picture: leave one out")
    shot = FilmSettings(**settings, ghost=not no_ghost)
    try:
        with stopping():
            if frame is None:
                film = recording.with_suffix(".mp4") if output is None else output
                with counting("rendering") as progress:
                    made = render_film(load_recording(recording), film, shot, progress)
            else:
                made = render_picture(load_recording(recording), frame, at, shot)
    except Stopped as stopped:
        return 128 + stopped.number
    if json:
        print_json(_summary(made, recording))
    else:
        _print(made, fps)
    return 0


def _summary(made: Film, recording: Path) -> dict[str, Any]:
    wide, high = made.size
    film = {"fps": float(made.fps), "duration_s": made.duration} if made.fps else {}
    return {
        "recording": str(recording),
        "output": str(made.path),
        "frames": made.frames,
        "width": wide,
        "height": high,
        **film,
        "from_s": made.begin,
        "to_s": made.end,
        "camera": made.camera,
        "bytes": made.path.stat().st_size,
    }


def _print(made: Film, fps: float | None) -> None:
    console = printer()
    wide, high = made.size
    size = made.path.stat().st_size
    shown = f"{size / 1e6:.1f} MB" if size >= 1e6 else f"{size / 1e3:.0f} kB"
    if made.fps is None:
        text = f"  {wide}x{high} at {made.begin:g} s, {shown}"
    else:
        text = f"  {made.frames} frames of {wide}x{high}, {made.duration:.3g} s at {float(made.fps):.4g} fps, {shown}"
    console.print(Text.assemble((str(made.path), "bold"), text), soft_wrap=True)
    if fps is not None and made.fps is not None and abs(float(made.fps) - fps) > 1e-3 * fps:
        note = f"frames of a GIF last a multiple of 10 ms: {float(made.fps):.4g} fps instead of {fps:g}"
        console.print(Text(note, style="yellow"))


def _import_mujoco() -> None:
    """Import mujoco without OpenGL, which it would load as MUJOCO_GL says, and fail if that is missing.

    The library to render with is chosen later, and a missing one is then reported in one line.
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
