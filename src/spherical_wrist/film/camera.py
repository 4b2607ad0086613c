"""From where a film is taken."""

import mujoco

from spherical_wrist.errors import UnknownNameError

USUAL, FREE = "overview", "free"
"""The camera that a film is taken from where a model has it, and the one that MuJoCo frames the model with."""

UNSET, VIEW = (90.0, -45.0), (127.0, -7.0)
"""Azimuth and elevation [°] of the free camera of models that do not say, MuJoCo's own and those taken here: seen from
above, what holds a wrist would hide its tool.
"""

STEP_BACK = 1.2
"""MuJoCo's free camera stands where a model just fits in, which leaves no room for a tool that moves."""

LEAST_ASPECT = 1.0
"""What cameras of a model show is given by the height of the picture: a narrower one would cut off the sides."""


def camera_names(model: mujoco.MjModel) -> list[str]:
    """The names of a model's cameras, and that of the free one."""
    named = (mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_CAMERA, camera) for camera in range(model.ncam))
    return [*(name for name in named if name), FREE]


def usual_camera(model: mujoco.MjModel) -> str:
    """The camera to take where none is asked for."""
    return USUAL if USUAL in camera_names(model) else FREE


def find_camera(model: mujoco.MjModel, name: str) -> mujoco.MjvCamera:
    """A camera of a model by name; the one called ``free`` looks at the middle of the model from where it fits in.

    Raises:
        UnknownNameError: the model has no such camera.
    """
    camera = mujoco.MjvCamera()
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA, name)
    if index >= 0:
        camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, index
    elif name == FREE:
        mujoco.mjv_defaultFreeCamera(model, camera)
        if (camera.azimuth, camera.elevation) == UNSET:
            camera.azimuth, camera.elevation = VIEW
        camera.distance *= STEP_BACK
    else:
        raise UnknownNameError("camera", name, camera_names(model))
    return camera


def widen(camera: mujoco.MjvGLCamera, aspect: float) -> None:
    """Opens a camera so far that a picture that is narrower than square shows as much to the sides as a square one.

    Args:
        camera: of a scene that has been updated.
        aspect: width over height of the picture.
    """
    if aspect < LEAST_ASPECT:
        camera.frustum_top *= LEAST_ASPECT / aspect
        camera.frustum_bottom *= LEAST_ASPECT / aspect
