"""What a control law is: frozen parameters, a state that the loop owns, and one step.

A law is a class with annotated parameters and a static method ``step`` in plain Python. The closed loop compiles
``step`` with the functions it names, so it is written with scalar loops, ``math`` and ``numpy`` scalars; the same
source runs interpreted. To write one of your own::

    from spherical_wrist.control import Law

    class Spring(Law):
        stiffness: float = 0.1
        damping: float = 0.004

        @staticmethod
        def step(signal, parameters, state, command):
            for i in range(3):
                command.torque[i] = parameters.stiffness * signal.error[i] + parameters.damping * signal.rate_error[i]

and ``wrist run --law my_law.py:Spring``.
"""

from collections.abc import Mapping, MutableSequence
from typing import Any, ClassVar, Literal, Protocol, get_args

import numpy as np
import numpy.typing as npt

from spherical_wrist.errors import LawError, WristError
from spherical_wrist.parameters import Member, quantity

Array = npt.NDArray[np.float64]

SIGNAL = np.dtype(
    [
        ("time", "f8"),
        ("period", "f8"),
        ("attitude", "f8", 4),
        ("rate", "f8", 3),
        ("desired_attitude", "f8", 4),
        ("desired_rate", "f8", 3),
        ("error", "f8", 3),
        ("rate_error", "f8", 3),
        ("feed_forward", "f8", 3),
        ("H", "f8", (3, 3)),
        ("N", "f8", 3),
        ("horizon", "f8"),
    ],
    align=True,
)
COMMAND = np.dtype([("torque", "f8", 3), ("surface", "f8", 3), ("slope", "f8", 3)], align=True)


class Signal(Protocol):
    """What a law sees at a control instant. Vectors are in the body frame.

    Attributes:
        time: time of the control instant [s].
        period: control period [s].
        attitude: measured attitude, quaternion (w, x, y, z), body → world.
        rate: measured angular velocity ω [rad/s].
        desired_attitude: desired attitude at the time of the measured one: this instant, but for the age of a sample.
        desired_rate: desired angular velocity, in the desired frame [rad/s].
        error: e = log(q⁻¹ q_d) [rad].
        rate_error: ė = R_e ω_d − ω [rad/s].
        feed_forward: R_e ω̇_d − ω × R_e ω_d [rad/s²]; with prediction, half a control period ahead.
        H: 3 × 3 inertia matrix of the nominal model [kg·m²]; with prediction, half a period ahead.
        N: Coriolis, centrifugal, gravity and known damping torque of the nominal model [N·m], likewise; of laws that
            ask for gravity only, gravity at rest.
        horizon: how far ahead of the sample H, N and feed-forward are evaluated [s]: half a period, and what is known
            of the age of the sample and the lag of the motors; 0 without prediction.
    """

    time: float
    period: float
    attitude: Array
    rate: Array
    desired_attitude: Array
    desired_rate: Array
    error: Array
    rate_error: Array
    feed_forward: Array
    H: Array
    N: Array
    horizon: float


class Command(Protocol):
    """What a law returns, by writing into it. All three are not-a-number before each step.

    Attributes:
        torque: body-frame torque τ [N·m], before the limits of the motors. Must be written.
        surface: sliding surface S [rad/s]; left alone by laws that have none.
        slope: slope λα of that surface [1/s]; left alone by laws that have none.
    """

    torque: MutableSequence[float]
    surface: MutableSequence[float]
    slope: MutableSequence[float]


class Law(Member):
    """A control law. Subclass it, annotate the parameters, write ``step``.

    Parameters may be numbers, booleans, ``Literal`` strings (which ``step`` sees as their index), and tuples or nested
    tuples of numbers (which it sees as arrays).

    Attributes:
        state_size: how many numbers of state the law keeps between steps; they start at :meth:`initial_state`.
        gravity_only: the law wants ``signal.N`` to be gravity alone (the nominal model at rest).
    """

    kind: ClassVar[str] = "law"
    fault: ClassVar[type[WristError]] = LawError
    state_size: ClassVar[int] = 0
    gravity_only: ClassVar[bool] = False

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Array, command: Command) -> None:
        """One control instant: reads ``signal`` and ``parameters``, updates ``state``, writes ``command``.

        Args:
            signal: what is measured, desired and modelled.
            parameters: the law's parameters by name.
            state: float64 array of ``state_size`` numbers, kept from step to step.
            command: where the torque, and the surface and its slope if there are any, are written.
        """
        raise NotImplementedError("a law needs a static method step(signal, parameters, state, command)")

    def initial_state(self) -> Array:
        """The state before the first step: zeros."""
        return np.zeros(self.state_size)

    @property
    def looks_ahead(self) -> bool:
        """Whether the nominal model is to be evaluated half a control period ahead."""
        return bool(getattr(self, "prediction", False))

    @property
    def boundary_layer(self) -> tuple[float, float, float] | None:
        """Half-width per axis of the band around S = 0 [rad/s] that counts as having reached it; None without one."""
        return None

    def derived(self) -> Mapping[str, Array]:
        """Arrays that follow from the parameters, such as a table, which ``step`` sees beside them by these names.

        They are asked for more than once: keep what takes long to compute. A shape of its own is compiled on its own.
        """
        return {}

    def packed(self) -> Array:
        """The parameters as the bytes of one record of :meth:`layout`, in a float64 array for the compiled loop."""
        record = np.zeros(1, self.layout())
        for name, value in self._arrays().items():
            record[name] = value
        return record.view(np.float64)

    def layout(self) -> np.dtype[Any]:
        """The record that ``step`` sees as ``parameters``: every field a float64, or an array of them.

        Raises:
            LawError: a parameter has a name that records keep for themselves.
        """
        shapes = [(name, "f8", value.shape) for name, value in self._arrays().items()]
        for name, _, _ in shapes:
            if hasattr(np.record, name):  # interpreted, parameters.mean would be the record's own method
                raise LawError(f"law {self.name!r}: a parameter cannot be called {name!r}: take another name")
        return np.dtype([*shapes, ("_", "f8")])  # never empty

    def _arrays(self) -> dict[str, Array]:
        """The parameters, then what is derived from them."""
        parameters = {name: _numbers(self, name) for name in type(self).model_fields}
        derived = {name: np.asarray(value, dtype=np.float64) for name, value in self.derived().items()}
        for name in derived.keys() & parameters.keys():
            raise LawError(f"law {self.name!r}: derived() returns {name!r}, the name of a parameter: take another")
        return {**parameters, **derived}


class ModelBasedLaw(Law):
    """A law that uses H and N: it can have them half a control period ahead, which the sample-and-hold asks for."""

    abstract: ClassVar[bool] = True

    prediction: bool = quantity(True, "", "take model and feed-forward half a period ahead")


def _numbers(law: Law, name: str) -> Array:
    """A field's value as a float64 array, of no dimensions for a number; a ``Literal`` string as its index."""
    value = getattr(law, name)
    choices: tuple[Any, ...] = get_args(type(law).model_fields[name].annotation)
    try:
        return np.array(choices.index(value) if isinstance(value, str) else value, dtype=np.float64)
    except (ValueError, TypeError):
        raise LawError(
            f"law {law.name!r}: a step cannot see the parameter {name} = {value!r}: "
            "it must be a number, a boolean, a Literal string, or a rectangular tuple of numbers"
        ) from None


SwitchingName = Literal["sign", "saturation", "tanh"]
