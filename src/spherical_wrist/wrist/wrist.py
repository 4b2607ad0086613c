"""Wrist: a compiled model, and the indices of its parts."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.compat.libmujoco import warnings_kept_in_data
from spherical_wrist.errors import ModelError
from spherical_wrist.wrist.dynamics_check import check_motors, check_passive, remarks
from spherical_wrist.wrist.hinges import ball_from_hinges
from spherical_wrist.wrist.mjcf import compiled, default_model, read_spec
from spherical_wrist.wrist.parts import AXES, UNNAMED, Names, ball_joint, motor_matrix, tip_site, torque_motors
from spherical_wrist.wrist.reduction import reduced


@dataclass(frozen=True)
class Wrist:
    """Compiled wrist model, and the indices of its parts.

    The *mount* is the frame in which the jointed body lies at the start, and attitudes are relative to it: body →
    mount. For the package's wrist, as for every model whose ball starts unturned, it is along the world's.

    Attributes:
        spec: the editable description that the model was compiled from; of a model with more joints, with these held
            at their initial positions.
        model: the compiled model, with all its geometry. Its only joint is the ball, its actuators are the motors.
        names: parts that were chosen by name in the description; hinges are its joint.
        body: index of the body that the ball joint moves.
        motors: (3, 3) matrix G with τ = G u: body-frame torque [N·m] from the three motor controls.
        lower: smallest motor controls (3,), −inf for a motor without a limit.
        upper: largest motor controls (3,).
        anchor: centre of the ball joint in the world [m].
        mount: rotation (3, 3) from the mount to the world.
        lever: vector from the centre of the ball joint to the tool tip, in the body frame [m].
        warnings: a sentence for everything in the model that a run treats in another way than MuJoCo would.
    """

    spec: mujoco.MjSpec
    model: mujoco.MjModel
    names: Names
    body: int
    motors: Array
    lower: Array
    upper: Array
    anchor: Array
    mount: Array
    lever: Array
    warnings: tuple[str, ...] = ()

    @classmethod
    def load(cls, path: Path | str | None = None, names: Names = UNNAMED) -> "Wrist":
        """Read a wrist from an MJCF file; without one, the wrist that comes with the package.

        Raises:
            ModelError: the file is missing or not MJCF, or the model is not a wrist.
        """
        file = default_model() if path is None else Path(path)
        return cls.of(read_spec(file), str(file), names)

    @classmethod
    @warnings_kept_in_data()
    def of(cls, spec: mujoco.MjSpec, name: str = "wrist", names: Names = UNNAMED) -> "Wrist":
        """Compile a description and find the wrist's parts in it.

        Args:
            spec: the description; it is not changed.
            name: name of the model in messages.
            names: joint, motors and tip, if the model has several; or hinges to be turned into the joint.

        Raises:
            ModelError: it does not compile, or is not a wrist: a ball joint; three plain torque motors on it whose axes
                span the space; a site for the tool tip on a body that it moves. Or motors or springs do what the
                controller's model cannot know.
        """
        whole = model = compiled(spec, name)
        missing: list[str] = []
        joint, motors, site, hinged = 0, list[int](), 0, None
        try:
            if names.hinges is None:
                joint = ball_joint(model, names.joint)
            elif names.joint is None:
                hinged = ball_from_hinges(spec, model, names.hinges, names.motors)
            else:
                raise ModelError("a ball joint and hinges are named: name one or the other, --joint or --hinges")
        except ModelError as error:
            raise ModelError(f"model {name!r}: {error}") from None
        if hinged:
            spec, names = hinged.spec, names._replace(joint=hinged.joint, hinges=None)
            whole = model = compiled(spec, name)
            joint = ball_joint(model, hinged.joint)
        try:
            if hinged and hinged.missing:
                raise ModelError(hinged.missing)
            motors = torque_motors(model, joint, names.motors)
        except ModelError as error:
            missing.append(str(error))
        else:
            check_motors(model, motors, name)
        if model.njnt > 1 or model.nactuator > len(motors):
            spec = reduced(spec, model, joint, motors)
            model = compiled(spec, name)
        body = int(model.jnt_bodyid[0])
        try:
            site = tip_site(model, body, names.tip)
        except ModelError as error:
            missing.append(str(error))
        if missing:
            raise ModelError(f"model {name!r}: {'; and '.join(missing)}")
        check_passive(model, name)
        warnings = (*(hinged.warnings if hinged else ()), *remarks(whole, joint, motors, model))
        matrix, lower, upper = motor_matrix(model, range(AXES), name)
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        anchor, mount = data.xanchor[0].copy(), _rotation(data.xmat[body])
        lever = mount.T @ (data.site_xpos[site] - anchor)
        return cls(spec, model, names, body, matrix, lower, upper, anchor, mount, lever, warnings)

    @cached_property
    def moving(self) -> list[int]:
        """Indices of the bodies that the ball joint moves."""
        weld = self.model.body_weldid
        return [b for b in range(1, self.model.nbody) if weld[b] == weld[self.body]]

    @cached_property
    def limit_shares(self) -> tuple[tuple[float, float, float], ...]:
        """Shares of the motors' limits per torque [1/(N·m)]: times a body-frame torque, the share of each limit.

        One row a motor and direction; none for a limit that is infinite or zero.
        """
        controls = np.asarray(np.linalg.inv(self.motors), dtype=np.float64)
        rows = [row / limit for limits in (self.upper, self.lower) for row, limit in _limited(controls, limits)]
        return tuple((float(x), float(y), float(z)) for x, y, z in rows)


class WristFile(NamedTuple):
    """Source of a wrist.

    Attributes:
        model: MJCF file; None for the wrist that comes with the package.
        names: joint, motors and tip, if the model has several.
    """

    model: Path | None = None
    names: Names = UNNAMED

    def load(self) -> Wrist:
        """Load the wrist.

        Raises:
            ModelError: see :meth:`Wrist.load`.
        """
        return Wrist.load(self.model, self.names)


def _limited(controls: Array, limits: Array) -> list[tuple[Array, float]]:
    """Return the rows of motors whose limit is finite and not zero, with it."""
    return [(row, float(limit)) for row, limit in zip(controls, limits, strict=True) if 0.0 < abs(limit) < np.inf]


def _rotation(flat: Array) -> Array:
    """Return a rotation matrix (3, 3), with an identity made exact, so that no bits depend on rounding."""
    matrix = flat.reshape(3, 3).copy()
    return np.eye(3) if np.allclose(matrix, np.eye(3), atol=1e-12) else matrix
