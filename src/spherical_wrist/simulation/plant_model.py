"""The plant as the loop steps it, perturbed in place: what compiling it anew would give, in a tenth of the time.

All that the ball joint moves is one rigid body. With the masses m_i, centres c_i and inertia tensors J_i about them of
its parts, in the frame of the jointed body, a perturbation makes m = s m_i, c = c_i + R_i Δ and J = s J_i of each, and
adds a point mass at the tip. The whole has, by the parallel-axis theorem,

    M = Σ m,   c̄ = Σ m c / M,   J̄ = Σ [J + m (|d|² 1 − d dᵀ)],   d = c − c̄,

of which the compiled model keeps the principal values and axes. What else depends on them MuJoCo derives itself.
"""

from copy import copy
from typing import NamedTuple, Self

import mujoco
import numpy as np
import numpy.typing as npt

from spherical_wrist.errors import ModelError
from spherical_wrist.plant import IMPEDANCE, STOPPING_TIME, Perturbation, perturb
from spherical_wrist.simulation.physics import loop_model, switch_off, try_step
from spherical_wrist.wrist import Wrist

Array = npt.NDArray[np.float64]


class Parts(NamedTuple):
    """The parts of what the joint moves, in the frame of the jointed body.

    Attributes:
        masses: of each [kg], (n,).
        centres: of mass, from the origin of that frame [m], (n, 3).
        turns: from each part's own frame to that frame, (n, 3, 3).
        tensors: inertia about each centre [kg·m²], (n, 3, 3).
        tip: tool tip [m], (3,).
    """

    masses: Array
    centres: Array
    turns: Array
    tensors: Array
    tip: Array

    @classmethod
    def of(cls, wrist: Wrist) -> Self:
        """Those of a nominal wrist, at whose start the frame of the jointed body is its mount."""
        model, moving = wrist.model, wrist.moving
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        back = wrist.mount.T
        axes = back @ data.ximat[moving].reshape(-1, 3, 3)
        tensors = (axes * model.body_inertia[moving][:, None, :]) @ axes.transpose(0, 2, 1)
        centres = (data.xipos[moving] - data.xpos[wrist.body]) @ wrist.mount
        turns = back @ data.xmat[moving].reshape(-1, 3, 3)
        return cls(model.body_mass[moving].copy(), centres, turns, tensors, model.jnt_pos[0] + wrist.lever)


class PlantModel:
    """A plant that can be perturbed again and again.

    Args:
        nominal: the wrist that the controller believes in.
        timestep: physics step [s].

    Attributes:
        model: the plant as perturbed last.
        data: its data, as made.

    Raises:
        ModelError: MuJoCo refuses the wrist, or cannot step it.
    """

    def __init__(self, nominal: Wrist, timestep: float) -> None:
        self._nominal, self._timestep = nominal, timestep
        self.model = self._compiled(Perturbation())
        self.data = mujoco.MjData(self.model)
        try_step(self.model, self.data)
        self._parts = Parts.of(nominal)
        self._damping = self.model.dof_damping.copy()
        self._friction = self.model.dof_frictionloss.copy(), self.model.dof_solref.copy(), self.model.dof_solimp.copy()
        body = self.model.jnt_bodyid[0]
        same = self.model.body_sameframe[body] or self.model.body_simple[body]
        touches = not self.model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT
        # else other bodies would move on their own, or MuJoCo would count on principal axes that a perturbation turns:
        # those of the body's own frame, and of the boxes in which it looks for contacts
        self._is_one_body = self.model.nbody == body + 1 and not (same or touches)

    def another(self) -> Self:
        """The same plant again, with a model and data of its own, in half the time of making it."""
        made = copy(self)
        made.model = copy(self.model)
        made.data = mujoco.MjData(made.model)
        return made

    def perturb(self, change: Perturbation) -> None:
        """Perturbs the nominal wrist, and puts the data back as it was made.

        Raises:
            ModelError: MuJoCo refuses the plant, or cannot step it.
        """
        if self._is_one_body:
            self._change(change)
        else:
            self.model = self._compiled(change)
            self.data = mujoco.MjData(self.model)
            try_step(self.model, self.data)
        mujoco.mj_resetData(self.model, self.data)

    def _compiled(self, change: Perturbation) -> mujoco.MjModel:
        spec = self._nominal.spec.copy()
        perturb(spec, self._nominal, change)
        return loop_model(spec, self._timestep)

    def _change(self, change: Perturbation) -> None:
        model, body = self.model, self.model.jnt_bodyid[0]
        with np.errstate(over="ignore", invalid="ignore"):
            mass, centre, tensor = whole(self._parts, change)
        largest = np.abs([mass, *centre, *tensor.ravel()]).max()
        if not largest <= mujoco.mjMAXVAL:
            raise ModelError(
                f"the plant's mass, centre or inertia is {largest:g}: MuJoCo takes up to {mujoco.mjMAXVAL:g}; "
                "give a smaller mass_scale, com_shift or payload"
            )
        inertia, axes = (found[..., ::-1] for found in np.linalg.eigh(tensor))  # the largest first, as MuJoCo has them
        axes = axes * np.sign(np.linalg.det(axes))
        model.body_mass[body], model.body_ipos[body], model.body_inertia[body] = mass, centre, inertia
        mujoco.mju_mat2Quat(model.body_iquat[body], np.ascontiguousarray(axes).ravel())
        model.dof_damping[:] = self._damping + change.damping
        loss, model.dof_solref[:], model.dof_solimp[:] = self._friction
        model.dof_frictionloss[:] = loss + change.friction
        if change.friction > 0.0:
            model.dof_solref[:] = STOPPING_TIME, 1.0
            model.dof_solimp[:] = IMPEDANCE, IMPEDANCE, 0.001, 0.5, 2.0
        model.opt.disableflags = self._nominal.model.opt.disableflags
        switch_off(model)
        mujoco.mj_setConst(model, self.data)


def whole(parts: Parts, change: Perturbation) -> tuple[float, Array, Array]:
    """Mass, centre of mass, and inertia tensor about it, of everything that the joint moves, perturbed."""
    masses = change.mass_scale * parts.masses
    centres = parts.centres + parts.turns @ np.array(change.com_shift)
    if change.payload > 0.0:
        masses, centres = np.append(masses, change.payload), np.vstack([centres, parts.tip])
    mass = masses.sum()
    centre = masses @ centres / mass
    d = centres - centre
    spread = (masses[:, None] * d).T @ d
    tensor = change.mass_scale * parts.tensors.sum(axis=0) + np.trace(spread) * np.eye(3) - spread
    return float(mass), centre, tensor
