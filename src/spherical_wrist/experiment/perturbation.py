"""Differences between the plant and the nominal model, and initial errors."""

from typing import NamedTuple

from spherical_wrist.so3 import Vector3


class Perturbation(NamedTuple):
    """Differences between the plant and the nominal model.

    Attributes:
        mass_scale: factor on mass and inertia of every moving body.
        com_shift: shift of the centre of mass of every moving body [m], in its own frame.
        payload: point mass at the tool tip [kg].
        friction: dry friction torque per axis of the joint [N·m]: Coulomb's law, except for a creep rate of 10⁻⁷ s
            times load over inertia.
        damping: additional viscous damping of the joint [N·m·s/rad].
    """

    mass_scale: float = 1.0
    com_shift: Vector3 = (0.0, 0.0, 0.0)
    payload: float = 0.0
    friction: float = 0.0
    damping: float = 0.0

    @property
    def moves_mass(self) -> bool:
        """True if it changes masses or their places."""
        return self._replace(friction=0.0, damping=0.0) != Perturbation()


class Start(NamedTuple):
    """Initial errors of the plant, relative to the reference.

    Attributes:
        error: attitude error e [rad].
        rate_error: rate error ė [rad/s].
    """

    error: Vector3 = (0.0, 0.0, 0.0)
    rate_error: Vector3 = (0.0, 0.0, 0.0)
