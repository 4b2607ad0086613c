"""Films and pictures of runs, as files."""

from collections.abc import Callable
from fractions import Fraction
from itertools import count as counter
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

from spherical_wrist.errors import ParameterError, UnknownNameError
from spherical_wrist.files import replacing
from spherical_wrist.film import gif, mp4
from spherical_wrist.film.frames import Frames
from spherical_wrist.film.motion import Poses
from spherical_wrist.film.opengl import Picture
from spherical_wrist.film.settings import FilmSettings
from spherical_wrist.simulation.run import Run

FORMATS = {".mp4": mp4, ".gif": gif}
"""Modules that write films, by the suffix of the file."""


class Film(NamedTuple):
    """A film or picture that was rendered.

    Attributes:
        path: the file.
        frames: number of frames; 1 for a picture.
        size: width and height [px].
        fps: frames per second; None for a picture.
        begin: simulated time of the first frame [s].
        end: simulated time at the end of the last frame [s].
        camera: name of the camera.
    """

    path: Path
    frames: int
    size: tuple[int, int]
    fps: Fraction | None
    begin: float
    end: float
    camera: str

    @property
    def duration(self) -> float:
        """Playing time [s]."""
        return float(self.frames / self.fps) if self.fps else 0.0


def render_film(
    run: Run,
    path: Path | str,
    settings: FilmSettings | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Film:
    """Film a run: the wrist as it moved, the desired attitude as a ghost, and the trails of the tool tip.

    Args:
        run: the run.
        path: file to write, ``*.mp4`` or ``*.gif``: completely or not at all. An existing file is replaced.
        settings: of the film.
        progress: called with the number of frames done and of all.

    Raises:
        UnknownNameError: the suffix of the file is of no format that can be written, or the model has no such camera.
        ParameterError: the recording does not have the times, or the format cannot have the settings.
        ModelError: the model of the run is not here.
        FilmError: nothing can be rendered or encoded here.
        RecordingError: the file cannot be written, or the run has no pose to show.
    """
    settings, path = settings or FilmSettings(), Path(path)
    kind = FORMATS.get(path.suffix.lower())
    if kind is None:
        raise UnknownNameError("film format", path.suffix or path.name, FORMATS, "; the suffix of the file decides")
    kind.check(settings.size)
    rate, motion = kind.frame_rate(settings.fps), Poses.of(run)
    instants = settings.instants(motion, rate)
    count, done = len(instants), counter()
    with replacing(path, "film") as part, run.plant() as plant, Frames(run, plant, motion, settings) as frames:

        def picture(number: int) -> Picture:
            progress(next(done), count)
            return frames.at(float(instants[number]))

        kind.write(part, settings.size, rate, count, picture)
    progress(count, count)
    begin = float(instants[0])
    return Film(path, count, settings.size, rate, begin, begin + count * settings.speed / rate, frames.camera)


def render_picture(run: Run, path: Path | str, time: float | None = None, settings: FilmSettings | None = None) -> Film:
    """Render a still picture of a run, as a film would show it.

    Args:
        run: the run.
        path: file to write, ``*.png``: completely or not at all.
        time: simulated time [s]; by default that of the largest tip error.
        settings: of the picture; its times and speed do not count.

    Raises:
        WristError: as for films.
    """
    settings, path = (settings or FilmSettings()).replaced(start=None, end=None, speed=1.0), Path(path)
    if path.suffix.lower() != ".png":
        raise UnknownNameError("picture format", path.suffix or path.name, [".png"])
    motion = Poses.of(run)
    begin, end = settings.span(motion)
    instant = float(motion.time[np.argmax(motion.tip_error())]) if time is None else time
    if not begin <= instant <= end:
        raise ParameterError(f"at {instant:g} s: the recording is from {begin:g} s to {end:g} s")
    with replacing(path, "picture") as part, run.plant() as plant, Frames(run, plant, motion, settings) as frames:
        Image.fromarray(frames.at(instant)).save(part, "png")
    return Film(path, 1, settings.size, None, instant, instant, frames.camera)
