"""Computed torque with a sliding-surface term in parallel, eq. (34)–(35): the paper's baseline."""

from typing import Any

from spherical_wrist.control.computed_torque import ComputedTorque, computed_torque
from spherical_wrist.control.contract import Array, Command, Signal, SwitchingName
from spherical_wrist.control.switching import switch
from spherical_wrist.parameters import Positive, PositiveVector, quantity


def add_switching(
    signal: Signal, K: Array, kind: float, layer: Array, slope: float, axis: int, command: Command
) -> None:
    """Adds K sw(S / φ) with S = slope · e + ė to the torque of one axis, eq. (35), and records S and its slope."""
    surface = slope * signal.error[axis] + signal.rate_error[axis]
    command.slope[axis] = slope
    command.surface[axis] = surface
    command.torque[axis] += K[axis] * switch(kind, surface, layer[axis])


class SlidingComputedTorque(ComputedTorque):
    """Computed torque plus K sw(S / φ) with S = λ e + ė, eq. (34)–(35): the paper's baseline.

    With ``sign`` the state slides on S = 0 while K exceeds what the model misses, eq. (41)–(43), at the price of
    chattering. Within a boundary layer φ the term is a proportional-derivative gain K/φ, without chattering; against a
    torque d the error then stays at φ atanh(d/K) / λ for ``tanh``, φ d / (K λ) for ``saturation``.
    """

    K: PositiveVector = quantity((0.05, 0.05, 0.03), "N·m", "switching gain per axis")
    slope: Positive = quantity(30.0, "1/s", "slope λ of the sliding surface")
    switching: SwitchingName = quantity("tanh", "", "switching function")
    phi: PositiveVector = quantity((0.3, 0.3, 0.5), "rad/s", "boundary layer φ per axis; sign only reports with it")

    @property
    def boundary_layer(self) -> tuple[float, float, float]:
        """The boundary layer φ."""
        return self.phi

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Array, command: Command) -> None:
        """See the class."""
        computed_torque(signal, parameters.Kp, parameters.Kv, command)
        for i in range(3):
            add_switching(signal, parameters.K, parameters.switching, parameters.phi, parameters.slope, i, command)
