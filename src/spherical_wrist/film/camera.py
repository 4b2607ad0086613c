"""Cameras of films."""

import mujoco

from spherical_wrist.errors import UnknownNameError

USUAL, FREE = "overview", "free"
"""Names of the default camera, and of the free camera with which MuJoCo frames the model."""

UNSET, VIEW = (90.0, -45.0), (127.0, -7.0)
"""Azimuth and elevation [°] of the free camera of models that set none: MuJoCo's, and those used here.

Seen from above, the holder of a wrist would hide its tool.
"""

STEP_BACK = 1.2
"""Factor on the distance of MuJoCo's free camera, at which the model just fits in: a tool that moves needs room."""

LEAST_ASPECT = 1.0
"""Width over height below which a camera is widened: its angle is vertical, and the sides would be cut off."""


def camera_names(model: mujoco.MjModel) -> list[str]:
    """Return the names of a model's cameras, and that of the free one."""
    named = (mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_CAMERA, camera) for camera in range(model.ncam))
    return [*(name for name in named if name), FREE]


def default_camera(model: mujoco.MjModel) -> str:
    """Return the name of the camera used by default."""
    return USUAL if USUAL in camera_names(model) else FREE


def find_camera(model: mujoco.MjModel, name: str) -> mujoco.MjvCamera:
    """Return a camera of a model by name; ``free`` looks at the middle of the model, which fits in.

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
        raise UnknownNameError("camera", name, camera_names(model), most=12)
    return camera


def widen(camera: mujoco.MjvGLCamera, aspect: float) -> None:
    """Widen a camera so that a picture narrower than square shows as much to the sides as a square one.

    Args:
        camera: of a scene that has been updated.
        aspect: width over height of the picture.
    """
    if aspect < LEAST_ASPECT:
        camera.frustum_top *= LEAST_ASPECT / aspect
        camera.frustum_bottom *= LEAST_ASPECT / aspect
