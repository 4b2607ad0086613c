"""Pictures of a run at any instant."""

from typing import Self

import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.colours import ACTUAL, DESIRED, rgb
from spherical_wrist.film.camera import default_camera
from spherical_wrist.film.caption import Caption, Colour, Style
from spherical_wrist.film.motion import Poses
from spherical_wrist.film.opengl import Picture
from spherical_wrist.film.scene import SceneRenderer, Trail
from spherical_wrist.film.settings import FilmSettings
from spherical_wrist.kinematics import tip_position
from spherical_wrist.simulation.run import Run
from spherical_wrist.wrist import Wrist

ACTUAL_COLOUR, DESIRED_COLOUR = rgb(ACTUAL), rgb(DESIRED)

TRAIL, TRAIL_STEP = 1.5, 0.01
"""Length of the trails, and of their pieces [s]."""


class Frames:
    """Pictures of a run. A context manager: rendering holds an OpenGL context.

    Args:
        run: the run.
        wrist: its plant.
        motion: of the run.
        settings: of the film.

    Raises:
        UnknownNameError: it has no such camera.
        FilmError: there is no OpenGL here.
    """

    def __init__(self, run: Run, wrist: Wrist, motion: Poses, settings: FilmSettings) -> None:
        self._wrist = wrist
        self._motion, self._ghost = motion, settings.ghost
        self.camera = settings.camera if settings.camera is not None else default_camera(self._wrist.model)
        self._caption = Caption(settings.size, _style(run, motion, settings))
        self._renderer = SceneRenderer(
            self._wrist, settings.size, self.camera, _share(DESIRED_COLOUR) if settings.ghost else None
        )

    def __enter__(self) -> Self:
        """Return the frames."""
        self._renderer.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        """Free the OpenGL context."""
        self._renderer.__exit__()

    def at(self, instant: float) -> Picture:
        """Render the picture of an instant [s]."""
        motion, wrist = self._motion, self._wrist
        began = np.ceil(max(instant - TRAIL, float(motion.time[0])) / TRAIL_STEP)
        # pieces begin and end at the same instants in every frame, or curves would quiver
        instants = np.append(TRAIL_STEP * np.arange(began, np.ceil(instant / TRAIL_STEP - 1e-6)), instant)
        actual, desired = motion.attitudes(instants), motion.desired_attitudes(instants)
        tip, desired_tip = _tips(actual, wrist), _tips(desired, wrist)
        trails = [Trail(tip, _share(ACTUAL_COLOUR))]
        if self._ghost:
            trails.append(Trail(desired_tip, _share(DESIRED_COLOUR), behind=True))
        picture = self._renderer.picture(actual[-1], desired[-1], trails)
        self._caption.write(picture, instant, float(np.linalg.norm(desired_tip[-1] - tip[-1])))
        return picture


def _tips(attitudes: Array, wrist: Wrist) -> Array:
    return tip_position(attitudes, wrist.anchor, wrist.mount, wrist.lever)


def _share(rgb: Colour) -> tuple[float, float, float]:
    red, green, blue = rgb
    return red / 255.0, green / 255.0, blue / 255.0


def _style(run: Run, motion: Poses, settings: FilmSettings) -> Style:
    law, reference = (str(run.description[part]["name"]).rpartition("/")[2] for part in ("law", "reference"))
    legend = (("actual", ACTUAL_COLOUR), ("desired", DESIRED_COLOUR))[: 2 if settings.ghost else 1]
    begin, end = settings.span(motion)
    shown = (motion.time >= begin) & (motion.time <= end)
    largest = float(motion.tip_error()[shown].max(initial=0.0))
    return Style(law, f"on {reference}", legend, settings.speed, largest, 2 if settings.speed >= 0.1 else 4)
