"""The true wrist that MuJoCo steps: the nominal one, perturbed in ways that the controller does not know."""

from typing import NamedTuple

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from spherical_wrist.so3 import Vector3
from spherical_wrist.wrist import Wrist

DRAWN_DENSITY = 2000.0
"""Density [kg/m³] of the sphere that a payload is drawn as; its dynamics are those of a point."""


STOPPING_TIME, IMPEDANCE = 0.002, 0.9999
"""Of MuJoCo's friction constraint [s, –]: the quickest that is stable at steps of 1 ms, and the hardest that it takes.

Below the limit of the friction, the constraint of impedance d and b = 2 / (d · time) leaves ω̇ = (1 − d) a − d b ω of
the acceleration a that the joint would have without. So under a load τ it creeps at (1 − d) / (d b) τ/I = 10⁻⁷ s · τ/I
instead of sticking, I the harmonic mean of the joint's three inertias; at MuJoCo's defaults (0.02 s, 0.9) that would
be 10⁻³ s · τ/I. MuJoCo takes two physics steps for the time where they are longer.
"""


class Perturbation(NamedTuple):
    """What differs between the plant and the nominal model.

    Attributes:
        mass_scale: multiplies mass and inertia of every moving body.
        com_shift: moves the centre of mass of every moving body [m], in its own frame.
        payload: point mass at the tool tip [kg].
        friction: dry friction torque per axis of the joint [N·m]: Coulomb's law, but for a creep of 10⁻⁷ s times
            the load over the inertia.
        damping: viscous damping added to that of the joint [N·m·s/rad].
    """

    mass_scale: float = 1.0
    com_shift: Vector3 = (0.0, 0.0, 0.0)
    payload: float = 0.0
    friction: float = 0.0
    damping: float = 0.0


def perturbed(nominal: Wrist, change: Perturbation) -> Wrist:
    """A plant: ``nominal`` with ``change`` applied and compiled anew. The nominal wrist is left as it is."""
    spec = nominal.spec.copy()
    perturb(spec, nominal, change)
    return Wrist.of(spec, "plant", nominal.names)


def perturb(spec: mujoco.MjSpec, nominal: Wrist, change: Perturbation) -> None:
    """Applies ``change`` to a copy of the description of ``nominal``."""
    for body in spec.bodies:
        if body.id in nominal.moving:
            _perturb_inertia(body, nominal.model, change)
    # these would be applied to the given inertias once more, and undo or repeat the change
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO
    spec.compiler.settotalmass = -1.0
    spec.compiler.boundmass = spec.compiler.boundinertia = 0.0
    if change.payload > 0.0:
        _add_payload(next(body for body in spec.bodies if body.id == nominal.body), nominal, change.payload)
    joint = spec.joints[0]
    joint.damping = _plus(joint.damping, change.damping)
    joint.frictionloss = _plus(joint.frictionloss, change.friction)
    if change.friction > 0.0:
        joint.solref_friction = [STOPPING_TIME, 1.0]
        joint.solimp_friction = [IMPEDANCE, IMPEDANCE, 0.001, 0.5, 2.0]


def _perturb_inertia(body: mujoco.MjsBody, model: mujoco.MjModel, change: Perturbation) -> None:
    # the compiled values, made explicit: geometry no longer contributes mass, whatever the file said
    body.explicitinertial = True
    body.mass = change.mass_scale * model.body_mass[body.id]
    body.inertia = change.mass_scale * model.body_inertia[body.id]
    body.fullinertia = np.full(6, np.nan)
    body.ipos = model.body_ipos[body.id] + np.asarray(change.com_shift)
    body.iquat = model.body_iquat[body.id]


def _add_payload(body: mujoco.MjsBody, wrist: Wrist, mass: float) -> None:
    """Adds a point mass at the tip to the jointed body, by the parallel-axis theorem."""
    tip = wrist.model.jnt_pos[0] + wrist.lever  # in the body's frame
    axes = Rotation.from_quat(body.iquat, scalar_first=True).as_matrix()
    centre = (body.mass * body.ipos + mass * tip) / (body.mass + mass)
    inertia = axes @ np.diag(body.inertia) @ axes.T
    for part, place in ((body.mass, body.ipos), (mass, tip)):
        arm = place - centre
        inertia += part * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    body.mass, body.ipos, body.iquat, body.inertia = body.mass + mass, centre, [1.0, 0.0, 0.0, 0.0], np.zeros(3)
    body.fullinertia = [*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]]
    radius = (3.0 * mass / (4.0 * np.pi * DRAWN_DENSITY)) ** (1.0 / 3.0)
    sphere = {"type": mujoco.mjtGeom.mjGEOM_SPHERE, "size": [radius, 0.0, 0.0], "rgba": [0.85, 0.55, 0.2, 1.0]}
    body.add_geom(name="payload", pos=tip, mass=0.0, contype=0, conaffinity=0, **sphere)


def _plus(value: float | np.ndarray, change: float) -> float | np.ndarray:
    """Adds to a joint coefficient that MuJoCo keeps as a number or as a polynomial's first coefficient."""
    if np.ndim(value) == 0:
        return value + change
    value = np.array(value)
    value[0] += change
    return value
