"""Plant: the true wrist that MuJoCo steps, the nominal wrist with perturbations that the controller does not know.

All that the ball joint moves is one rigid body. Its parts have masses m_i, centres c_i and inertia tensors J_i
about them, in the frame of the jointed body. A perturbation makes m = s m_i, c = c_i + R_i Δ and J = s J_i of each, and
adds a point mass at the tip. By the parallel-axis theorem the whole has

    M = Σ m,   c̄ = Σ m c / M,   J̄ = Σ [J + m (|d|² 1 − d dᵀ)],   d = c − c̄.

MuJoCo's gravity compensation (``gravcomp``) of the plant stays that of the nominal wrist: it stands for a
counterweight, or for motors, set up for the masses that were known.

These numbers are applied in two ways: written to the description, which is then compiled, or, in a tenth of the time,
written to a compiled model as principal moments and axes of the whole.
"""

from collections.abc import Sequence
from copy import copy
from typing import NamedTuple, Self

import mujoco
import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ModelError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.experiment.perturbation import Perturbation
from spherical_wrist.prepare.physics import disable_unused_stages, loop_model, try_step
from spherical_wrist.wrist import Wrist

PAYLOAD_DENSITY = 2000.0
"""Density [kg/m³] of the sphere that shows a payload. Its dynamics are those of a point mass."""

OFF = mujoco.mjtDisableBit

WEIGHTLESS = 1e-16
"""Mass [kg] of a body that only takes up a force; below 10⁻¹⁵ kg MuJoCo computes no drag of it in a fluid."""

SOLREF, SOLIMP = (0.002, 1.0), (0.9999, 0.9999, 0.001, 0.5, 2.0)
"""MuJoCo's friction constraint: the quickest stopping time [s] that is stable at steps of 1 ms, the hardest impedance.

Below the limit of the friction, the constraint of impedance d and b = 2 / (d · time) leaves ω̇ = (1 − d) a − d b ω of
the acceleration a that the joint would have without. So under a load τ it creeps at (1 − d) / (d b) τ/I = 10⁻⁷ s · τ/I
instead of sticking, I the harmonic mean of the joint's three inertias; at MuJoCo's defaults (0.02 s, 0.9) that would
be 10⁻³ s · τ/I. MuJoCo takes two physics steps for the time where they are longer.
"""


class RigidParts(NamedTuple):
    """Rigid parts of the moving body, in the frame of the jointed body.

    Attributes:
        masses: mass of each part [kg], (n,).
        centres: centre of mass of each part, from the origin of that frame [m], (n, 3).
        rotations: rotation from each part's own frame to that frame, (n, 3, 3).
        tensors: inertia tensor of each part about its centre [kg·m²], before ``scale``, (n, 3, 3).
        tip: tool tip [m], (3,).
        scale: factor on the tensors.
    """

    masses: Array
    centres: Array
    rotations: Array
    tensors: Array
    tip: Array
    scale: float = 1.0

    @classmethod
    def of(cls, wrist: Wrist) -> Self:
        """Read the moving parts of a nominal wrist. Initially, the jointed body has the attitude of the mount."""
        model, moving = wrist.model, wrist.moving
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        back = wrist.mount.T
        axes = back @ data.ximat[moving].reshape(-1, 3, 3)
        tensors = (axes * model.body_inertia[moving][:, None, :]) @ axes.transpose(0, 2, 1)
        centres = (data.xipos[moving] - data.xpos[wrist.body]) @ wrist.mount
        rotations = back @ data.xmat[moving].reshape(-1, 3, 3)
        return cls(model.body_mass[moving].copy(), centres, rotations, tensors, model.jnt_pos[0] + wrist.lever)

    def perturbed(self, change: Perturbation) -> Self:
        """Return the perturbed parts, with the payload as an additional part."""
        masses = change.mass_scale * self.masses
        centres = self.centres + self.rotations @ np.array(change.com_shift)
        found = self._replace(masses=masses, centres=centres, scale=change.mass_scale)
        if change.payload <= 0.0:
            return found
        return found._replace(
            masses=np.append(masses, change.payload),
            centres=np.vstack([centres, self.tip]),
            rotations=np.concatenate([self.rotations, np.eye(3)[None]]),
            tensors=np.concatenate([self.tensors, np.zeros((1, 3, 3))]),
        )

    def merged(self, indices: Sequence[int] | slice = slice(None)) -> tuple[float, Array, Array]:
        """Compute mass, centre of mass, and inertia tensor about it, of several parts together."""
        masses, centres = self.masses[indices], self.centres[indices]
        mass = masses.sum()
        centre = masses @ centres / mass
        d = centres - centre
        spread = (masses[:, None] * d).T @ d
        tensor = self.scale * self.tensors[indices].sum(axis=0) + np.trace(spread) * np.eye(3) - spread
        return float(mass), centre, tensor


def plant_of(experiment: Experiment) -> Wrist:
    """Return the plant of an experiment, compiled with all its geometry.

    Raises:
        ModelError: the MJCF file is not a wrist.
    """
    return perturbed(experiment.nominal(), experiment.perturbation)


def perturbed(nominal: Wrist, change: Perturbation) -> Wrist:
    """Return a plant: a compiled copy of ``nominal`` with ``change`` applied."""
    spec = nominal.spec.copy()
    perturb_spec(spec, nominal, RigidParts.of(nominal), change)
    return Wrist.of(spec, "plant", nominal.names)


def perturb_spec(spec: mujoco.MjSpec, nominal: Wrist, parts: RigidParts, change: Perturbation) -> None:
    """Apply ``change`` to ``spec``, a copy of the description of ``nominal``, whose moving parts are ``parts``.

    Raises:
        ModelError: the model switches off what ``change`` would add.
    """
    _check_flags(nominal, change)
    whole, jointed = parts.perturbed(change), spec.bodies[nominal.body]
    loaded, in_fluid = change.payload > 0.0, nominal.model.opt.density > 0.0 or nominal.model.opt.viscosity > 0.0
    for index, number in enumerate(nominal.moving):
        body = spec.bodies[number]
        body.explicitinertial = True  # with explicit values, geometry contributes no mass
        if number != nominal.body or not loaded or in_fluid:  # the compiled axes, which are exact
            body.mass = whole.masses[index]
            body.ipos = nominal.model.body_ipos[number] + np.asarray(change.com_shift)
            body.iquat = nominal.model.body_iquat[number]
            body.inertia = change.mass_scale * nominal.model.body_inertia[number]
            body.fullinertia = np.full(6, np.nan)
        else:
            turn = parts.rotations[index]
            body.mass, centre, tensor = whole.merged([index, len(parts.masses)])
            own = turn.T @ tensor @ turn
            body.ipos, body.iquat, body.inertia = turn.T @ centre, [1.0, 0.0, 0.0, 0.0], np.zeros(3)
            body.fullinertia = [*np.diag(own), own[0, 1], own[0, 2], own[1, 2]]
    if loaded:
        _draw_payload(jointed, parts.tip, change.payload)
        if in_fluid:  # where MuJoCo takes the size of a body from its inertia
            _add_point(jointed, parts.tip, change.payload)
    if change.moves_mass:
        _keep_compensation(spec, nominal)
    # these settings would change the explicit inertias again
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO
    spec.compiler.settotalmass = -1.0
    spec.compiler.boundmass = spec.compiler.boundinertia = 0.0
    joint = spec.joints[0]
    joint.damping = _plus(joint.damping, change.damping)
    joint.frictionloss = _plus(joint.frictionloss, change.friction)
    if change.friction > 0.0:
        joint.solref_friction, joint.solimp_friction = SOLREF, SOLIMP


def _check_flags(nominal: Wrist, change: Perturbation) -> None:
    """Refuse friction or damping that MuJoCo would ignore, because the model switches off such torques."""
    flags = nominal.model.opt.disableflags
    needed = {
        "friction": {"frictionloss": OFF.mjDSBL_FRICTIONLOSS, "constraint": OFF.mjDSBL_CONSTRAINT},
        "damping": {"damper": OFF.mjDSBL_DAMPER},
    }
    for name, switches in needed.items():
        off = [flag for flag, bit in switches.items() if flags & bit]
        if getattr(change, name) and off:
            raise ModelError(
                f'{name} = {getattr(change, name):g} would do nothing: the model has <flag {off[0]}="disable"/>; '
                f"remove it there, or leave {name} at 0"
            )


def _keep_compensation(spec: mujoco.MjSpec, nominal: Wrist) -> None:
    """Keep the gravity compensation of the nominal wrist: the same forces at the same points of its bodies.

    MuJoCo lifts a body by ``gravcomp`` times its weight, at its centre of mass. Both belong to the plant here, so every
    such force acts on a body of its own, without weight and with a large factor.
    """
    model = nominal.model
    compensated = [(spec.bodies[number], number) for number in nominal.moving if model.body_gravcomp[number]]
    for body, number in compensated:
        lift, body.gravcomp = model.body_gravcomp[number] * model.body_mass[number], 0.0
        _add_point(body, model.body_ipos[number], WEIGHTLESS).gravcomp = lift / WEIGHTLESS


def _add_point(body: mujoco.MjsBody, place: Array, mass: float) -> mujoco.MjsBody:
    """Weld a point mass to a body."""
    point = body.add_body()
    point.explicitinertial, point.mass, point.inertia = True, mass, np.zeros(3)
    point.ipos, point.iquat = place, [1.0, 0.0, 0.0, 0.0]
    return point


def _draw_payload(body: mujoco.MjsBody, tip: Array, mass: float) -> None:
    radius = (3.0 * mass / (4.0 * np.pi * PAYLOAD_DENSITY)) ** (1.0 / 3.0)
    sphere = {"type": mujoco.mjtGeom.mjGEOM_SPHERE, "size": [radius, 0.0, 0.0], "rgba": [0.85, 0.55, 0.2, 1.0]}
    body.add_geom(name="payload", pos=tip, mass=0.0, contype=0, conaffinity=0, **sphere)


def _plus(value: float | np.ndarray, change: float) -> float | np.ndarray:
    """Add to a joint coefficient, which MuJoCo stores as a number or as the first coefficient of a polynomial."""
    if np.ndim(value) == 0:
        return value + change
    value = np.array(value)
    value[0] += change
    return value


class PlantModel:
    """Plant in the form that the loop steps, which can be perturbed repeatedly.

    Args:
        nominal: nominal wrist.
        timestep: physics step [s].

    Attributes:
        model: model with the last perturbation.
        data: its data.

    Raises:
        ModelError: MuJoCo refuses the wrist, or cannot step it.
    """

    def __init__(self, nominal: Wrist, timestep: float) -> None:
        self._nominal, self._timestep, self._parts = nominal, timestep, RigidParts.of(nominal)
        self.model = self._compiled(Perturbation())
        self.data = mujoco.MjData(self.model)
        try_step(self.model, self.data)
        self._damping = self.model.dof_damping.copy()
        self._friction = self.model.dof_frictionloss.copy(), self.model.dof_solref.copy(), self.model.dof_solimp.copy()
        body = self.model.jnt_bodyid[0]
        same = self.model.body_sameframe[body] or self.model.body_simple[body]
        touches = not self.model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT
        # any other body would need its own inertia. MuJoCo may also rely on the principal axes, which a perturbation
        # turns: for the frame of the body, or for the boxes of its contact detection. Gravity compensation and drag
        # need bodies of their own
        several = self.model.ngravcomp or self.model.opt.density > 0.0 or self.model.opt.viscosity > 0.0
        self._is_one_body = self.model.nbody == body + 1 and not (same or touches or several)

    def copy(self) -> Self:
        """Return a copy with its own model and data, in half the time of creating it."""
        duplicate = copy(self)
        duplicate.model = copy(self.model)
        duplicate.data = mujoco.MjData(duplicate.model)
        return duplicate

    def perturb(self, change: Perturbation) -> None:
        """Apply a perturbation to the nominal wrist, and reset the data.

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
        perturb_spec(spec, self._nominal, self._parts, change)
        return loop_model(spec, self._timestep)

    def _change(self, change: Perturbation) -> None:
        """Write a perturbation to the compiled model."""
        _check_flags(self._nominal, change)
        model, body = self.model, self.model.jnt_bodyid[0]
        with np.errstate(over="ignore", invalid="ignore"):
            mass, centre, tensor = self._parts.perturbed(change).merged()
        largest = np.abs([mass, *centre, *tensor.ravel()]).max()
        if not largest <= mujoco.mjMAXVAL:
            raise ModelError(
                f"the plant's mass, centre or inertia is {largest:g}: MuJoCo takes up to {mujoco.mjMAXVAL:g}; "
                "give a smaller mass_scale, com_shift or payload"
            )
        inertia, axes = (found[..., ::-1] for found in np.linalg.eigh(tensor))  # largest first, as in MuJoCo
        axes = axes * np.sign(np.linalg.det(axes))
        model.body_mass[body], model.body_ipos[body], model.body_inertia[body] = mass, centre, inertia
        mujoco.mju_mat2Quat(model.body_iquat[body], np.ascontiguousarray(axes).ravel())
        model.dof_damping[:] = self._damping + change.damping
        loss, model.dof_solref[:], model.dof_solimp[:] = self._friction
        model.dof_frictionloss[:] = loss + change.friction
        if change.friction > 0.0:
            model.dof_solref[:], model.dof_solimp[:] = SOLREF, SOLIMP
        model.opt.disableflags = self._nominal.model.opt.disableflags
        disable_unused_stages(model)
        mujoco.mj_setConst(model, self.data)
