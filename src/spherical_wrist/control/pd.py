"""Proportional-derivative control with gravity compensation, the model-free baseline."""

from typing import Any, ClassVar

from spherical_wrist.control.contract import Bound, Command, Law, LawStatus, Signal
from spherical_wrist.parameters import NonNegativeVector, PositiveVector, quantity


class PD(Law):
    """PD with gravity compensation: τ = P e + D ė + g(q).

    A spring and a damper on the attitude error, and the gravity torque of the nominal model. It knows no inertia and no
    reference acceleration, so it lags behind a moving reference even with a perfect model. Stable about a fixed
    attitude by passivity (Takegaki and Arimoto, 1981).
    """

    gravity_only: ClassVar[bool] = True
    status: ClassVar[LawStatus] = "baseline"
    tracks_to: ClassVar[Bound] = Bound(0.105, 0.135)

    P: PositiveVector = quantity((0.16, 0.16, 0.06), "N·m/rad", "proportional gain per axis")
    D: NonNegativeVector = quantity((0.016, 0.016, 0.006), "N·m·s/rad", "derivative gain per axis")

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Any, command: Command) -> None:
        """See the class."""
        for i in range(3):
            command.torque[i] = parameters.P[i] * signal.error[i] + parameters.D[i] * signal.rate_error[i] + signal.N[i]
