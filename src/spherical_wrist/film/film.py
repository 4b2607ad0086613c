"""Films and pictures of runs, as files."""

from collections.abc import Callable
from contextlib import ExitStack
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

from spherical_wrist.errors import ParameterError, UnknownNameError
from spherical_wrist.experiment.run import Run
from spherical_wrist.files import replacing
from spherical_wrist.film import gif, mp4
from spherical_wrist.film.frames import Frames
from spherical_wrist.film.motion import Motion
from spherical_wrist.film.shot import Shot

FORMATS = {".mp4": mp4, ".gif": gif}
"""What can be written, by the suffix of the file's name."""

SAMPLES = 8
"""Pictures that the colours of a GIF are chosen from."""


class Film(NamedTuple):
    """What was made.

    Attributes:
        path: the file.
        frames: number of its pictures; 1 for a still one.
        size: their width and height [px].
        fps: frames per second; None for a still picture.
        begin: simulated time of the first picture [s].
        end: simulated time at which the last one is over [s].
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
        """How long it plays [s]."""
        return float(self.frames / self.fps) if self.fps else 0.0


def render_film(
    run: Run, path: Path | str, shot: Shot | None = None, progress: Callable[[int, int], None] | None = None
) -> Film:
    """Films a run: the wrist as it moved, the desired attitude as a ghost, and the trails of the tool tip.

    Pictures go to the file one by one, so that long films take no more memory than short ones.

    Args:
        run: what to film.
        path: file to write, ``*.mp4`` or ``*.gif``: completely or not at all. One that is there already is replaced.
        shot: what to show of it, and how.
        progress: called with how many of how many pictures are done.

    Raises:
        UnknownNameError: the name of the file ends with no format that can be written, or the model has no such camera.
        ParameterError: the recording has not what is to be shown, or the format not what was asked for.
        ModelError: the model of the run is not here.
        FilmError: nothing can be rendered or encoded here.
        RecordingError: the file cannot be written, or the run has no pose to show.
    """
    shot, path = shot or Shot(), Path(path)
    kind = FORMATS.get(path.suffix.lower())
    if kind is None:
        raise UnknownNameError("film format", path.suffix or path.name, FORMATS, "; the suffix of the file decides")
    kind.check(shot.size)
    rate, motion = kind.frame_rate(shot.fps), Motion.of(run)
    instants = shot.instants(motion, rate)
    with ExitStack() as stack:
        part = stack.enter_context(replacing(path, "film"))
        frames = stack.enter_context(Frames(run, stack.enter_context(run.plant()), motion, shot))
        film: gif.Gif | mp4.Mp4
        if kind is gif:
            chosen = np.linspace(0, len(instants) - 1, min(SAMPLES, len(instants))).round().astype(int)
            film = gif.Gif(part, rate, [frames.at(float(instants[index])) for index in chosen])
        else:
            film = mp4.Mp4(part, shot.size, rate)
        stack.enter_context(film)
        for done, instant in enumerate(instants, 1):
            film.add(frames.at(float(instant)))
            if progress is not None:
                progress(done, len(instants))
    begin = float(instants[0])
    return Film(path, len(instants), shot.size, rate, begin, begin + len(instants) * shot.speed / rate, frames.camera)


def render_picture(run: Run, path: Path | str, time: float | None = None, shot: Shot | None = None) -> Film:
    """Makes a still picture of a run, as it would be in a film.

    Args:
        run: what to show.
        path: file to write, ``*.png``: completely or not at all.
        time: simulated time [s]; without it, when the tool tip was furthest from where it was to be.
        shot: how to show it; of its times and its speed, nothing counts.

    Raises:
        WristError: as for films.
    """
    shot, path = (shot or Shot()).replaced(start=None, end=None, speed=1.0), Path(path)
    if path.suffix.lower() != ".png":
        raise UnknownNameError("picture format", path.suffix or path.name, [".png"])
    motion = Motion.of(run)
    begin, end = shot.span(motion)
    instant = float(motion.time[np.argmax(motion.tip_error())]) if time is None else time
    if not begin <= instant <= end:
        raise ParameterError(f"at {instant:g} s: the recording is from {begin:g} s to {end:g} s")
    with replacing(path, "picture") as part, run.plant() as plant, Frames(run, plant, motion, shot) as frames:
        Image.fromarray(frames.at(instant)).save(part, "png")
    return Film(path, 1, shot.size, None, instant, instant, frames.camera)
