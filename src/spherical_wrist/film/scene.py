"""Rendering of the wrist, its ghost and its trails by MuJoCo."""

from collections.abc import Sequence
from copy import copy
from typing import NamedTuple, Self

import mujoco
import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.film.camera import find_camera, widen
from spherical_wrist.film.dressing import dressed_model
from spherical_wrist.film.opengl import Picture, Renderer
from spherical_wrist.wrist import Wrist

GEOM, CATEGORY = mujoco.mjtGeom, mujoco.mjtCatBit

GHOST_OPACITY, GHOST_GLOW = 0.3, 0.25
"""Opacity and emission of the ghost; the emission keeps its colour in the shadow."""

BEHIND = 0.002
"""Distance that the ghost and its trail are moved away from the camera, in extents of the model.

Too little to be seen, but without an error the wrist hides the ghost, which would otherwise flicker through it.
"""

LINE, NEWEST = 3.5 / 720.0, 0.99
"""Width of the trails, in heights of the picture, and opacity of their newest piece.

Opaque pieces would be lit, in another colour than the rest.
"""


class Trail(NamedTuple):
    """A line that fades out.

    Attributes:
        points: in the world [m], oldest first, (n, 3).
        rgb: colour, up to 1.
        behind: True if another trail in the same place hides it.
    """

    points: Array
    rgb: tuple[float, float, float]
    behind: bool = False


class SceneRenderer:
    """Renders a wrist at any attitude. A context manager: it holds an OpenGL context.

    Args:
        wrist: its geometry.
        size: width and height of the pictures [px].
        camera: name of a camera of the model, or ``free``.
        ghost_rgb: colour of the ghost, up to 1; None for no ghost.

    Raises:
        UnknownNameError: the model has no such camera.
        FilmError: there is no OpenGL here, or it cannot make pictures of that size.
    """

    def __init__(
        self, wrist: Wrist, size: tuple[int, int], camera: str, ghost_rgb: tuple[float, float, float] | None
    ) -> None:
        self._model = dressed_model(wrist, size)
        self._data = mujoco.MjData(self._model)
        self._joint = int(np.flatnonzero(wrist.model.jnt_bodyid == wrist.body)[0])
        self._size = size
        self._camera = find_camera(self._model, camera)
        self._option = mujoco.MjvOption()
        self._option.sitegroup[:] = 0  # marks for the author of the model
        self._ghost_model = _painted(self._model, ghost_rgb) if ghost_rgb else None
        room = 4 * self._model.ngeom + 4000
        self._scene = mujoco.MjvScene(self._model, maxgeom=room)
        self._renderer = Renderer(self._model, size)

    def __enter__(self) -> Self:
        """Return the renderer."""
        return self

    def __exit__(self, *_: object) -> None:
        """Free the OpenGL context."""
        self._renderer.close()

    def picture(self, attitude: Array, desired_attitude: Array, trails: Sequence[Trail] = ()) -> Picture:
        """Render the wrist.

        Args:
            attitude: of the wrist, unit quaternion (w, x, y, z), body → world.
            desired_attitude: of the ghost.
            trails: to draw.

        Returns:
            The picture.
        """
        scene, (wide, high) = self._scene, self._size
        self._place(attitude)
        mujoco.mjv_updateScene(
            self._model, self._data, self._option, None, self._camera, CATEGORY.mjCAT_ALL.value, scene
        )
        for camera in scene.camera:
            widen(camera, wide / high)
        if self._ghost_model is not None:
            self._add_ghost(desired_attitude)
        for trail in trails:
            first = scene.ngeom
            _add_trail(scene, trail, LINE * high)
            if trail.behind:
                self._move_behind(first)
        return self._renderer.picture(scene)

    def _place(self, attitude: Array) -> None:
        """Compute the poses at an attitude, without dynamics."""
        start = int(self._model.jnt_qposadr[self._joint])
        self._data.qpos[start : start + 4] = attitude
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)

    def _add_ghost(self, attitude: Array) -> None:
        scene, first = self._scene, self._scene.ngeom
        self._place(attitude)
        # geoms that the joint does not move are static, so that the ghost has the moving ones only
        mujoco.mjv_addGeoms(
            self._ghost_model, self._data, self._option, mujoco.MjvPerturb(), CATEGORY.mjCAT_DYNAMIC.value, scene
        )
        self._move_behind(first)
        for geom in scene.geoms[first : scene.ngeom]:
            geom.emission = GHOST_GLOW

    def _move_behind(self, first: int) -> None:
        """Move geoms from an index on away from the camera."""
        scene = self._scene
        away = BEHIND * self._model.stat.extent * np.asarray(scene.camera[0].forward)
        for geom in scene.geoms[first : scene.ngeom]:
            geom.pos = geom.pos + away


def _painted(model: mujoco.MjModel, rgb: tuple[float, float, float]) -> mujoco.MjModel:
    """Return a copy whose visible geoms all have one translucent colour."""
    painted = copy(model)
    visible = np.where(painted.geom_matid >= 0, painted.mat_rgba[painted.geom_matid, 3], 1.0) if painted.nmat else 1.0
    painted.geom_rgba[:, 3] = np.where(visible * painted.geom_rgba[:, 3] > 0.0, GHOST_OPACITY, 0.0)
    painted.geom_rgba[:, :3] = rgb
    painted.geom_matid[:] = -1
    return painted


def _add_trail(scene: mujoco.MjvScene, trail: Trail, width: float) -> None:
    count = len(trail.points) - 1
    for i in range(count):
        geom = scene.geoms[scene.ngeom]
        rgba = np.array([*trail.rgb, NEWEST * (i + 1.0) / count], dtype=np.float32)
        mujoco.mjv_initGeom(geom, GEOM.mjGEOM_LINE, np.zeros(3), np.zeros(3), np.zeros(9), rgba)
        mujoco.mjv_connector(geom, GEOM.mjGEOM_LINE, width, trail.points[i], trail.points[i + 1])
        scene.ngeom += 1
