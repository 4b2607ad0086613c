"""``wrist render``: a recording to a film or to a still picture."""

import signal
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from rich.text import Text

from spherical_wrist.cli.output import print_json, printer
from spherical_wrist.cli.progress import counting
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.recordings import load_recording
from spherical_wrist.film import Film, Shot, render_film, render_picture

FOR_FILMS = {"speed": "--speed", "fps": "--fps", "start": "--from", "end": "--to"}
"""Options that a still picture does not have, by what they set of a shot."""


class RenderOptions(NamedTuple):
    """What to make of a recording.

    Attributes:
        film: file to write, None for that of the recording with another suffix.
        picture: a still picture to write instead.
        at: simulated time of the picture [s], None for that of the largest tip error.
        ghost: whether to show the desired attitude.
        json: print JSON instead of a line.
    """

    film: Path | None
    picture: Path | None
    at: float | None
    ghost: bool
    json: bool


def render_recording(path: Path, shot: Mapping[str, Any], options: RenderOptions) -> None:
    """Renders and reports.

    Args:
        path: recording.
        shot: what to show of it, and how, where it is not as usual.
        options: what to make of it.

    Raises:
        WristError: wrong input, or no film can be made here.
    """
    if options.picture is None and options.at is not None:
        raise ParameterError("--at is the time of a still picture: give --frame FILE.png too, or --from and --to")
    with _terminated():
        if options.picture is None:
            film = path.with_suffix(".mp4") if options.film is None else options.film
            with counting("rendering") as progress:
                made = render_film(load_recording(path), film, Shot(**shot, ghost=options.ghost), progress)
        else:
            given = [option for name, option in FOR_FILMS.items() if name in shot] + ["-o"] * bool(options.film)
            if given:
                raise ParameterError(f"{given[0]} is for films, and --frame makes a still picture: leave one out")
            made = render_picture(load_recording(path), options.picture, options.at, Shot(**shot, ghost=options.ghost))
    if options.json:
        print_json(_told(made, path))
    else:
        _print(made, shot.get("fps"))


@contextmanager
def _terminated() -> Iterator[None]:
    """Lets SIGTERM end the process as Ctrl-C does, so that no half of a film is left behind."""
    before = signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _told(made: Film, recording: Path) -> dict[str, Any]:
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
