"""MuJoCo's geoms as Rerun's shapes."""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, Protocol

import mujoco
import numpy as np
import numpy.typing as npt
import rerun as rr

GEOM = mujoco.mjtGeom

_UNSET = np.array([0.5, 0.5, 0.5, 1.0], dtype=np.float32)
"""MuJoCo's own colour of a geom, which lets its material show."""

_HIDDEN_FROM = 3
"""MuJoCo's viewers do not show geoms of this group and above: by custom, the shapes for collisions."""


class Drawable(Protocol):
    """Geometry that a wrist is drawn from; a :class:`~spherical_wrist.wrist.Wrist` is one."""

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled model, with all its geometry."""

    @property
    def anchor(self) -> npt.NDArray[np.float64]:
        """Centre of the ball joint in the world [m]."""

    @property
    def mount(self) -> npt.NDArray[np.float64]:
        """Rotation (3, 3) to the world from the frame that attitudes are relative to."""

    @property
    def moving(self) -> list[int]:
        """Indices of the bodies that the ball joint moves."""


class Placed(NamedTuple):
    """A geom and where it is at the start.

    Attributes:
        name: as in the MJCF file.
        geom: its index in the model.
        moving: whether the ball joint moves it.
        position: of its centre [m]; from the centre of the ball joint where it moves, else in the world.
        rotation: of its axes in the world, (3, 3).
    """

    name: str
    geom: int
    moving: bool
    position: npt.NDArray[np.float64]
    rotation: npt.NDArray[np.float64]


def visible_geoms(wrist: Drawable) -> Iterator[Placed]:
    """The geoms that MuJoCo's own viewers show."""
    model = wrist.model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for geom in range(model.ngeom):
        if model.geom_group[geom] >= _HIDDEN_FROM or colour(model, geom)[3] == 0:
            continue
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, geom) or f"geom_{geom}"
        moving = int(model.geom_bodyid[geom]) in wrist.moving
        position = data.geom_xpos[geom] - (wrist.anchor if moving else 0.0)
        yield Placed(name, geom, moving, position, data.geom_xmat[geom].reshape(3, 3).copy())


def colour(model: mujoco.MjModel, geom: int) -> list[int]:
    """Colour of a geom as MuJoCo paints it: red, green, blue and opacity up to 255."""
    rgba = model.geom_rgba[geom]
    if model.geom_matid[geom] >= 0 and np.array_equal(rgba, _UNSET):
        rgba = model.mat_rgba[model.geom_matid[geom]]
    return [round(255.0 * min(max(float(part), 0.0), 1.0)) for part in rgba]


def solid(model: mujoco.MjModel, placed: Placed) -> Any:
    """A geom as a Rerun archetype; None for kinds that Rerun has no shape for."""
    return _shapes(model, [placed], [colour(model, placed.geom)], rr.components.FillMode.Solid)


def wires(model: mujoco.MjModel, geoms: Sequence[Placed], rgb: Sequence[int]) -> Iterator[tuple[str, Any]]:
    """The outlines of geoms, meshes in full: Rerun archetypes with a name, one for every kind of shape."""
    for kind in sorted({int(model.geom_type[placed.geom]) for placed in geoms}):
        same = [placed for placed in geoms if model.geom_type[placed.geom] == kind]
        if kind == GEOM.mjGEOM_MESH:
            yield from ((placed.name, _mesh(model, placed, rgb)) for placed in same)
            continue
        shapes = _shapes(model, same, [rgb], rr.components.FillMode.MajorWireframe)
        if shapes is not None:
            yield GEOM(kind).name.removeprefix("mjGEOM_").lower(), shapes


def _shapes(model: mujoco.MjModel, geoms: Sequence[Placed], colours: Any, fill: rr.components.FillMode) -> Any:
    """Geoms of one kind as one archetype; of meshes, the first only."""
    kind = model.geom_type[geoms[0].geom]
    sizes = np.array([model.geom_size[placed.geom] for placed in geoms])
    centres = np.array([placed.position for placed in geoms])
    axes = np.array([placed.rotation[:, 2] for placed in geoms])
    line: Any = [rr.Radius.ui_points(0.7)]
    style: dict[str, Any] = {
        "quaternions": [_xyzw(placed.rotation) for placed in geoms],
        "colors": colours,
        "fill_mode": fill,
    }
    if kind == GEOM.mjGEOM_BOX:
        return rr.Boxes3D(half_sizes=sizes, centers=centres, radii=line, **style)
    style["line_radii"] = line
    if kind == GEOM.mjGEOM_SPHERE:
        return rr.Ellipsoids3D(radii=sizes[:, 0], centers=centres, **style)
    if kind == GEOM.mjGEOM_ELLIPSOID:
        return rr.Ellipsoids3D(half_sizes=sizes, centers=centres, **style)
    if kind == GEOM.mjGEOM_CYLINDER:
        return rr.Cylinders3D(lengths=2.0 * sizes[:, 1], radii=sizes[:, 0], centers=centres, **style)
    if kind == GEOM.mjGEOM_CAPSULE:
        # Rerun's capsule begins at its origin, MuJoCo's has its centre there
        begins = centres - sizes[:, 1:2] * axes
        return rr.Capsules3D(lengths=2.0 * sizes[:, 1], radii=sizes[:, 0], translations=begins, **style)
    if kind == GEOM.mjGEOM_MESH:
        return _mesh(model, geoms[0], colours[0])
    return None


def _mesh(model: mujoco.MjModel, placed: Placed, rgba: Sequence[int]) -> Any:
    mesh = model.geom_dataid[placed.geom]
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    vertices = model.mesh_vert[first : first + count] @ placed.rotation.T + placed.position
    first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    faces = model.mesh_face[first : first + count]
    return rr.Mesh3D(vertex_positions=vertices, triangle_indices=faces, albedo_factor=rgba)


def _xyzw(rotation: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, rotation.ravel())
    return np.roll(quaternion, -1)
