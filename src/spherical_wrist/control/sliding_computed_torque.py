"""Computed torque with a sliding-surface term in parallel, eq. (34)–(35): the paper's baseline."""

from collections.abc import Mapping
from typing import Any, ClassVar

from spherical_wrist.control.computed_torque import ComputedTorque, computed_torque
from spherical_wrist.control.contract import Bound, Command, LawStatus, Signal
from spherical_wrist.control.sliding_surface import SlidingSurfaceLaw, add_switching


class SlidingComputedTorque(SlidingSurfaceLaw, ComputedTorque):
    """Computed torque plus K sw(S / φ) with S = λ e + ė, eq. (34)–(35): the paper's baseline.

    With ``sign`` the state slides on S = 0 while K exceeds what the model misses, eq. (41)–(43), at the price of
    chattering. Within a boundary layer φ the term is a proportional-derivative gain K/φ, without chattering; against a
    torque d the error then stays at φ atanh(d/K) / λ for ``tanh``, φ d / (K λ) for ``saturation``.
    """

    status: ClassVar[LawStatus] = "paper"
    exempt: ClassVar[Mapping[str, str]] = {
        "restlessness": "the paper asks for no margin against delays, and at half the mass it has none",
    }
    tracks_to: ClassVar[Bound] = Bound(3.1e-3, 4.1e-3)

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        computed_torque(signal, parameters.Kp, parameters.Kv, command)
        for i in range(3):
            add_switching(signal, parameters.K, parameters.switching, parameters.phi, parameters.slope, i, command)
