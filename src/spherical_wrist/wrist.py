"""A wrist: an MJCF model with one ball joint that carries a tool, and three torque motors on that joint."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt

from spherical_wrist.errors import ModelError, one_line
from spherical_wrist.libmujoco import warnings_kept_in_data

Array = npt.NDArray[np.float64]
JOINT, OBJECT, TRANSMISSION = mujoco.mjtJoint, mujoco.mjtObj, mujoco.mjtTrn

_PHYSICAL = (
    "timestep", "gravity", "body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia", "jnt_pos",
    "dof_damping", "dof_armature", "dof_frictionloss", "jnt_stiffness", "site_pos", "actuator_gear", "actuator_gainprm",
    "geom_pos", "geom_size",
)  # fmt: skip
"""What is computed with or drawn, and MuJoCo takes from a file as it is, even where it is not a number."""

REFUSALS = (ValueError, RuntimeError, MemoryError, mujoco.FatalError, mujoco.UnexpectedError)
"""What MuJoCo raises at a model that it cannot take; RuntimeError where its bindings do not know why."""

_ADVICE = "see models/README.md for what a wrist model needs"


def default_model() -> Path:
    """The MJCF file of the wrist that comes with the package."""
    here = Path(__file__).resolve()
    installed = here.parent / "models" / "wrist.xml"
    return installed if installed.exists() else here.parents[2] / "models" / "wrist.xml"


@warnings_kept_in_data()
def read_spec(path: Path) -> mujoco.MjSpec:
    """Parses an MJCF file.

    Raises:
        ModelError: the file cannot be read or is not MJCF.
    """
    if not path.is_file():
        raise ModelError(f"model {str(path)!r}: no such file; give the path of an MJCF file")
    if not str(path).isprintable():  # bytes that are no letters, or a zero in it
        raise ModelError(f"model {str(path)!r}: MuJoCo cannot open a file of such a name; rename it")
    try:
        return mujoco.MjSpec.from_file(str(path))
    except REFUSALS as error:
        raise ModelError(f"model {str(path)!r} is not valid MJCF: {one_line(error)}") from None


@dataclass(frozen=True)
class Wrist:
    """A compiled wrist model and where its parts are.

    Attributes:
        spec: the editable description that the model was compiled from.
        model: the compiled model, with all its geometry.
        body: index of the body that the ball joint moves.
        motors: (3, 3) matrix G with τ = G u: body-frame torque [N·m] from the three motor controls.
        lower: smallest motor controls (3,), −inf where a motor has no limit.
        upper: largest motor controls (3,).
        anchor: centre of the ball joint in the world [m].
        lever: from that centre to the tool tip, in the body frame [m].
    """

    spec: mujoco.MjSpec
    model: mujoco.MjModel
    body: int
    motors: Array
    lower: Array
    upper: Array
    anchor: Array
    lever: Array

    @classmethod
    def load(cls, path: Path | str | None = None) -> "Wrist":
        """Reads a wrist from an MJCF file; without one, the wrist that comes with the package.

        Raises:
            ModelError: the file is missing or not MJCF, or the model is not a wrist.
        """
        file = default_model() if path is None else Path(path)
        return cls.of(read_spec(file), str(file))

    @classmethod
    @warnings_kept_in_data()
    def of(cls, spec: mujoco.MjSpec, name: str = "wrist") -> "Wrist":
        """Compiles a description and finds the wrist's parts in it.

        Raises:
            ModelError: it does not compile, or is not a wrist: exactly one joint, a ball on a static body; three plain
                torque motors on it whose axes span the space; a site named ``tip`` on what it moves; at the start, the
            frame of the jointed body along that of the world.
        """
        try:
            model = spec.compile()
        except REFUSALS as error:
            raise ModelError(f"model {name!r} does not compile: {one_line(error)}") from None
        _check_numbers(model, name)
        joint = _ball(model, name)
        body = int(model.jnt_bodyid[joint])
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        if not np.allclose(data.xmat[body], np.eye(3).ravel(), atol=1e-12):
            raise ModelError(f"model {name!r}: the jointed body's frame must be the world's at the start; {_ADVICE}")
        motors, lower, upper = _motors(model, joint, name)
        site = mujoco.mj_name2id(model, OBJECT.mjOBJ_SITE, "tip")
        if site < 0 or model.body_weldid[model.site_bodyid[site]] != model.body_weldid[body]:
            raise ModelError(f"model {name!r} has no site 'tip' on what the ball joint moves; {_ADVICE}")
        anchor = data.xanchor[joint].copy()
        return cls(spec, model, body, motors, lower, upper, anchor, data.site_xpos[site] - anchor)

    @cached_property
    def moving(self) -> list[int]:
        """Indices of the bodies that the ball joint moves."""
        weld = self.model.body_weldid
        return [b for b in range(1, self.model.nbody) if weld[b] == weld[self.body]]


def _check_numbers(model: mujoco.MjModel, name: str) -> None:
    for place in _PHYSICAL:
        owner = model.opt if place in ("gravity", "timestep") else model
        values = np.abs(np.ravel(getattr(owner, place)))
        if not (values <= mujoco.mjMAXVAL).all():
            raise ModelError(
                f"model {name!r} has {place} = {values.max():g}: finite numbers below {mujoco.mjMAXVAL:g} are needed"
            )


def _ball(model: mujoco.MjModel, name: str) -> int:
    kinds = [JOINT(kind).name.removeprefix("mjJNT_").lower() for kind in model.jnt_type]
    if kinds != ["ball"]:
        raise ModelError(f"model {name!r} has joints {kinds or 'none'}: exactly one ball joint is needed; {_ADVICE}")
    if model.body_weldid[model.body_parentid[model.jnt_bodyid[0]]] != 0:
        raise ModelError(f"model {name!r}: the ball joint must hang on a body that does not move; {_ADVICE}")
    return 0


def _motors(model: mujoco.MjModel, joint: int, name: str) -> tuple[Array, Array, Array]:
    plain = (
        model.nu == 3
        and model.na == 0
        and all(model.actuator_trntype == TRANSMISSION.mjTRN_JOINT)
        and all(model.actuator_trnid[:, 0] == joint)
        and all(model.actuator_gaintype == mujoco.mjtGain.mjGAIN_FIXED)
        and all(model.actuator_biastype == mujoco.mjtBias.mjBIAS_NONE)
    )
    if not plain:
        raise ModelError(
            f"model {name!r}: three torque motors on the ball joint, and nothing else, must actuate it; {_ADVICE}"
        )
    gain = model.actuator_gainprm[:, 0]
    motors = (model.actuator_gear[:, :3] * gain[:, None]).T.copy()
    if abs(np.linalg.det(motors)) < 1e-9 * np.linalg.norm(motors) ** 3:
        raise ModelError(f"model {name!r}: the gears of the three motors must span all three axes; {_ADVICE}")
    bounds = np.full((3, 2), (-np.inf, np.inf))
    limited = model.actuator_ctrllimited.astype(bool)
    bounds[limited] = model.actuator_ctrlrange[limited]
    force = model.actuator_forcelimited.astype(bool)
    by_force = np.sort(model.actuator_forcerange / gain[:, None], axis=1)
    bounds[force, 0] = np.maximum(bounds, by_force)[force, 0]
    bounds[force, 1] = np.minimum(bounds, by_force)[force, 1]
    return motors, bounds[:, 0].copy(), bounds[:, 1].copy()
