"""Parameters of the laws with a sliding surface, and the switching torque that drives S to zero."""

from typing import ClassVar

from spherical_wrist.control.contract import Array, Command, ModelBasedLaw, Signal
from spherical_wrist.control.switching import SwitchingName, switch
from spherical_wrist.parameters import Positive, PositiveVector, quantity


class SlidingSurfaceLaw(ModelBasedLaw):
    """A law with a sliding surface S = λ e + ė, eq. (17) with n = 2, and a switching torque K sw(S / φ)."""

    abstract: ClassVar[bool] = True
    has_surface: ClassVar[bool] = True

    K: PositiveVector = quantity((0.05, 0.05, 0.03), "N·m", "switching gain per axis")
    slope: Positive = quantity(30.0, "1/s", "slope λ of the sliding surface")
    switching: SwitchingName = quantity("tanh", "", "switching function")
    phi: PositiveVector = quantity((0.3, 0.3, 0.5), "rad/s", "boundary layer φ per axis; sign only reports with it")

    @property
    def boundary_layer(self) -> tuple[float, float, float]:
        """The boundary layer φ."""
        return self.phi


def add_switching(
    signal: Signal, K: Array, kind: float, layer: Array, slope: float, axis: int, command: Command
) -> None:
    """Add K sw(S / φ) with S = slope · e + ė to the torque of one axis, eq. (35), and write S and its slope."""
    surface = slope * signal.error[axis] + signal.rate_error[axis]
    command.slope[axis] = slope
    command.surface[axis] = surface
    command.torque[axis] += K[axis] * switch(kind, surface, layer[axis])
