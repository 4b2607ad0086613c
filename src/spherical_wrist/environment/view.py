"""Pictures of an environment: the wrist and, as a green ghost, where it is to be."""

import numpy as np
import numpy.typing as npt

from spherical_wrist.film.camera import usual_camera
from spherical_wrist.film.stage import Stage
from spherical_wrist.so3 import quaternion_exp, quaternion_product
from spherical_wrist.wrist import Wrist

SIZE = (640, 480)
"""Width and height of the pictures [px]."""

GHOST = (20 / 255, 190 / 255, 110 / 255)

Array = npt.NDArray[np.float64]


class View:
    """What looks at a wrist; OpenGL is taken when the first picture is asked for.

    Args:
        wrist: its geometry.
    """

    def __init__(self, wrist: Wrist) -> None:
        self._wrist = wrist
        self._stage: Stage | None = None

    def picture(self, attitude: Array, error: Array) -> npt.NDArray[np.uint8]:
        """A picture (480, 640, 3) of the wrist at an attitude, and of its ghost an error e = log(q⁻¹ q_d) away.

        Raises:
            FilmError: there is no OpenGL here.
        """
        if self._stage is None:
            self._stage = Stage(self._wrist, SIZE, usual_camera(self._wrist.model), GHOST)
        w, x, y, z = map(float, attitude)
        a, b, c = map(float, error)
        return self._stage.picture(attitude, np.array(quaternion_product((w, x, y, z), quaternion_exp((a, b, c)))))

    def close(self) -> None:
        """Gives OpenGL back."""
        if self._stage is not None:
            self._stage.__exit__()
            self._stage = None
