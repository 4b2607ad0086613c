"""The pictures of a run, one for any instant."""

from typing import Self

import numpy as np

from spherical_wrist.experiment.run import Run
from spherical_wrist.film.camera import usual_camera
from spherical_wrist.film.caption import Caption, Colour, Style
from spherical_wrist.film.motion import Array, Motion
from spherical_wrist.film.opengl import Picture
from spherical_wrist.film.shot import Shot
from spherical_wrist.film.stage import Stage, Trail
from spherical_wrist.kinematics import tip_position
from spherical_wrist.wrist import Wrist

ACTUAL, DESIRED = (255, 130, 20), (20, 190, 110)
"""Colours as in a recording's scene, darker: a model's backdrop may be bright."""

TRAIL, TRAIL_STEP = 1.5, 0.01
"""Length of the trails, and of the pieces that they are made of [s]."""


class Frames:
    """The pictures of a run. A context manager, since rendering holds resources.

    Args:
        run: what is shown.
        wrist: its plant.
        motion: of the run.
        shot: how it is shown.

    Raises:
        UnknownNameError: it has no such camera.
        FilmError: nothing can be rendered here.
    """

    def __init__(self, run: Run, wrist: Wrist, motion: Motion, shot: Shot) -> None:
        self._wrist = wrist
        self._motion, self._ghost = motion, shot.ghost
        self.camera = shot.camera if shot.camera is not None else usual_camera(self._wrist.model)
        self._caption = Caption(shot.size, _style(run, motion, shot))
        self._stage = Stage(self._wrist, shot.size, self.camera, _share(DESIRED) if shot.ghost else None)

    def __enter__(self) -> Self:
        """The frames themselves."""
        self._stage.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        """Frees what rendering holds."""
        self._stage.__exit__()

    def at(self, instant: float) -> Picture:
        """The picture of one instant [s]."""
        motion, wrist = self._motion, self._wrist
        began = np.ceil(max(instant - TRAIL, float(motion.time[0])) / TRAIL_STEP)
        # pieces begin and end at the same instants in every frame, or curves would quiver
        instants = np.append(TRAIL_STEP * np.arange(began, np.ceil(instant / TRAIL_STEP - 1e-6)), instant)
        actual, desired = motion.attitudes(instants), motion.desired_attitudes(instants)
        tip, desired_tip = _tips(actual, wrist), _tips(desired, wrist)
        trails = [Trail(tip, _share(ACTUAL))]
        if self._ghost:
            trails.append(Trail(desired_tip, _share(DESIRED), behind=True))
        picture = self._stage.picture(actual[-1], desired[-1], trails)
        self._caption.write(picture, instant, float(np.linalg.norm(desired_tip[-1] - tip[-1])))
        return picture


def _tips(attitudes: Array, wrist: Wrist) -> Array:
    return tip_position(attitudes, wrist.anchor, wrist.mount, wrist.lever)


def _share(rgb: Colour) -> tuple[float, float, float]:
    red, green, blue = rgb
    return red / 255.0, green / 255.0, blue / 255.0


def _style(run: Run, motion: Motion, shot: Shot) -> Style:
    law, reference = (str(run.description[part]["name"]).rpartition("/")[2] for part in ("law", "reference"))
    legend = (("actual", ACTUAL), ("desired", DESIRED)) if shot.ghost else (("actual", ACTUAL),)
    begin, end = shot.span(motion)
    shown = (motion.time >= begin) & (motion.time <= end)
    largest = float(motion.tip_error()[shown].max(initial=0.0))
    return Style(law, f"on {reference}", legend, shot.speed, largest, 2 if shot.speed >= 0.1 else 4)
