"""Images of an environment: the wrist, and a green ghost at the desired attitude."""

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.film.camera import default_camera
from spherical_wrist.film.scene import SceneRenderer
from spherical_wrist.so3 import quaternion_exp, quaternion_product
from spherical_wrist.wrist import Wrist

SIZE = (640, 480)
"""Width and height of the images [px]."""

GHOST = (20 / 255, 190 / 255, 110 / 255)


class EnvironmentRenderer:
    """Renderer of a wrist. OpenGL is initialized at the first image.

    Args:
        wrist: nominal wrist, which gives the geometry.
    """

    def __init__(self, wrist: Wrist) -> None:
        self._wrist = wrist
        self._scene: SceneRenderer | None = None

    def render(self, attitude: Array, error: Array) -> npt.NDArray[np.uint8]:
        """Render an image (480, 640, 3) of the wrist at an attitude q, and of its ghost at q_d = q exp(error).

        Raises:
            FilmError: OpenGL is not available.
        """
        if self._scene is None:
            self._scene = SceneRenderer(self._wrist, SIZE, default_camera(self._wrist.model), GHOST)
        w, x, y, z = map(float, attitude)
        a, b, c = map(float, error)
        return self._scene.picture(attitude, np.array(quaternion_product((w, x, y, z), quaternion_exp((a, b, c)))))

    def close(self) -> None:
        """Free OpenGL."""
        if self._scene is not None:
            self._scene.__exit__()
            self._scene = None
