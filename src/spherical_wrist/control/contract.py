"""The contract of a control law: frozen parameters, a named state that the loop owns, and one step.

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

and ``wrist run --law my_law.py:Spring``. A law that remembers something declares it by name, as it does parameters::

    from spherical_wrist.control import Law, LawState
    from spherical_wrist.parameters import Vector, quantity

    class Integral(Law):
        class State(LawState):
            pull: Vector = quantity(0.0, "N·m", "integral torque")

and reads and writes ``state.pull[i]`` in ``step``.
"""

from binascii import crc32
from collections.abc import Iterable, Iterator, Mapping, MutableSequence
from functools import cache, cached_property
from itertools import product
from typing import Any, ClassVar, Literal, NamedTuple, Protocol, get_args

import numpy as np
import numpy.typing as npt

from spherical_wrist import channels
from spherical_wrist.errors import LawError, UnknownNameError, WristError
from spherical_wrist.parameters import Member, Parameters, quantity, unit_of

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
        ("rate_age", "f8"),
        ("horizon", "f8"),
        ("torque_limit", "f8", 3),
    ],
    align=True,
)
COMMAND = channels.COMMAND
USUAL_PERIOD = 1e-3
"""Control period [s] for which a law is packed unless another is given."""


LawStatus = Literal["baseline", "paper", "rival", "ours", "user"]
"""Origin of a law: a simple baseline, the source paper, a strong law of the literature, this project, or a user."""


class Bound(NamedTuple):
    """Errors that a law keeps below on the default motion against 25 % of torque, at 0.5 to 1.5 of the mass.

    Attributes:
        rms_rad: RMS attitude error in the steady window [rad].
        max_rad: largest attitude error there [rad].
    """

    rms_rad: float
    max_rad: float


class Signal(Protocol):
    """Measured, desired and modelled quantities at a control instant. Vectors are in the body frame.

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
        rate_age: known age of the rate less that of the attitude [s]: 0 of a gyroscope; of a rate that is estimated
            from attitudes, half the time between two of them, and what a filter adds.
        horizon: how far ahead of the sample H, N and feed-forward are evaluated [s]: half a period, and what is known
            of the age of the sample and the lag of the motors; 0 without prediction.
        torque_limit: largest torque about each body axis alone that the motors in use give [N·m]; of coils, at this
            attitude. Infinite for motors without a limit.
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
    rate_age: float
    horizon: float
    torque_limit: Array


class Command(Protocol):
    """Output of a law, written by its step. All of it is not-a-number before each step.

    It has a field for every channel of :mod:`spherical_wrist.channels` that laws write.

    Attributes:
        torque: body-frame torque τ [N·m], before the limits of the motors. Must be written.
        surface: sliding surface S [rad/s]; written by laws with ``has_surface`` only.
        slope: slope λα of that surface [1/s]; written by laws with ``has_surface`` only.
    """

    torque: MutableSequence[float]
    surface: MutableSequence[float]
    slope: MutableSequence[float]


class LawState(Parameters):
    """Named state of a law: annotated fields with an initial value each, declared as parameters are.

    Fields are numbers, and tuples or nested tuples of numbers, which ``step`` sees as arrays.
    """


class Law(Member):
    """A control law. Subclass it, annotate the parameters, write ``step``.

    Parameters may be numbers, booleans, ``Literal`` strings (which ``step`` sees as the number :func:`choice`), and
    tuples or nested tuples of numbers (which it sees as arrays).

    Attributes:
        State: fields that the law keeps from step to step; a law without a state declares none.
        state_size: how many numbers the state has, derived from ``State``.
        gravity_only: the law wants ``signal.N`` to be gravity alone (the nominal model at rest).
        has_surface: the law has a sliding surface, and writes ``command.surface`` and ``command.slope``.
        logs: channels that the law writes besides the torque, its surface and its slope.
        status: origin of the law.
        tracks_to: errors that the law keeps below, which the tests of the package check; None of a user's law.
        gains_from: where the gains come from, if the law is searched by ``wrist design`` and they are others.
        exempt: constraints of ``wrist design`` that the law does not claim to meet, each with the reason.
        promises: limits of such constraints that the law keeps beyond those that all laws have, by name.
        ablations: parts of the law, each with the parameters that switch it off; see ``wrist ablate``.
    """

    kind: ClassVar[str] = "law"
    fault: ClassVar[type[WristError]] = LawError
    State: ClassVar[type[LawState]] = LawState
    state_size: ClassVar[int] = 0
    gravity_only: ClassVar[bool] = False
    has_surface: ClassVar[bool] = False
    logs: ClassVar[tuple[str, ...]] = ()
    status: ClassVar[LawStatus] = "user"
    tracks_to: ClassVar[Bound | None] = None
    gains_from: ClassVar[str] = ""
    exempt: ClassVar[Mapping[str, str]] = {}
    promises: ClassVar[Mapping[str, float]] = {}
    ablations: ClassVar[Mapping[str, Mapping[str, Any]]] = {}

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        """Derive the size of the state.

        Raises:
            LawError: the state is not declared by name.
        """
        super().__pydantic_init_subclass__()
        if "state_size" in vars(cls) or not issubclass(cls.State, LawState):
            raise LawError(
                f"law {cls.name!r}: declare its state by name, as class State(LawState) with annotated fields; "
                "state_size follows from them (see `wrist guide law`)"
            )
        cls.state_size = len(cls.state_names())
        if "status" not in vars(cls):  # a user's law is not that of the law that it derives from
            cls.status, cls.tracks_to = "user", None

    @staticmethod
    def step(signal: Signal, parameters: Any, state: Array, command: Command) -> None:
        """Compute one control instant: read ``signal`` and ``parameters``, update ``state``, write ``command``.

        Args:
            signal: measured, desired and modelled quantities.
            parameters: the law's parameters by name.
            state: the law's state by name, kept from step to step.
            command: torque, and the surface and its slope if the law has one, to be written.
        """
        raise NotImplementedError("a law needs a static method step(signal, parameters, state, command)")

    def initial_state(self) -> Mapping[str, Any]:
        """Return initial values by name that depend on parameters; the other fields start at their defaults."""
        return {}

    def packed_state(self) -> Array:
        """Return the state before the first step, as one float64 array for the loop; never empty.

        Raises:
            LawError: :meth:`initial_state` returns a field that is not in ``State``, or one of another shape.
        """
        given = {name: np.asarray(value).tolist() for name, value in self.initial_state().items()}
        record = np.zeros(1, self.state_layout())
        try:
            state = self.State(**given)
            for name in type(state).model_fields:
                value = np.array(getattr(state, name), dtype=np.float64)
                if value.shape != record[name].shape[1:]:
                    raise LawError(f"{name} has shape {value.shape}, its declaration {record[name].shape[1:]}")
                record[name] = value
        except (WristError, ValueError) as error:
            raise LawError(f"law {self.name!r}: its initial state: {error}") from None
        return record.view(np.float64)

    @classmethod
    def state_layout(cls) -> np.dtype[Any]:
        """Return the record that ``step`` sees as ``state``: every field a float64, or an array of them.

        Raises:
            LawError: a field has no initial value, is no number, or has a name that records keep for themselves.
        """
        return _state_layout(cls.State, cls.name)

    @classmethod
    def state_names(cls) -> tuple[str, ...]:
        """Return the name of each number of the state, such as ``integral_x`` or ``weights_x_0_2``."""
        return tuple(name for name, _ in _components(cls))

    @classmethod
    def state_units(cls) -> tuple[str, ...]:
        """Return the unit of each number of the state, ``""`` if it has none."""
        return tuple(unit_of(cls.State, field) for _, field in _components(cls))

    @property
    def looks_ahead(self) -> bool:
        """True if the nominal model is to be evaluated half a control period ahead."""
        return bool(getattr(self, "prediction", False))

    @property
    def boundary_layer(self) -> tuple[float, float, float] | None:
        """Half-width per axis of the band around S = 0 [rad/s] that counts as having reached it; None without one."""
        return None

    def derived(self) -> Mapping[str, Array]:
        """Return arrays that follow from the parameters, such as a table; ``step`` sees them beside the parameters.

        The method is called more than once: cache what takes long to compute. Each shape is compiled on its own.
        """
        return {}

    def designed(self, period: float) -> Mapping[str, Array]:
        """Return arrays that follow from the parameters and the control period [s], such as the gains of a filter.

        ``step`` sees them beside the parameters. Their shapes must not depend on the period.
        """
        return {}

    def computed(self) -> dict[str, Array]:
        """Return the arrays of :meth:`derived`, and those of :meth:`designed` for the usual period."""
        return {**self.derived(), **self.designed(USUAL_PERIOD)}

    def packed(self, period: float = USUAL_PERIOD) -> Array:
        """Return the parameters as the bytes of one record of :meth:`layout`, in a float64 array for the loop.

        Args:
            period: control period [s], for the arrays of :meth:`designed`.
        """
        record = np.zeros(1, self.layout())
        for name, value in self._arrays.items():
            record[name] = value
        if period != USUAL_PERIOD:
            for name, value in self.designed(period).items():
                record[name] = value
        return record.view(np.float64)

    def layout(self) -> np.dtype[Any]:
        """Return the record that ``step`` sees as ``parameters``: every field a float64, or an array of them.

        Raises:
            LawError: a parameter has a name that records keep for themselves.
        """
        shapes = [(name, "f8", value.shape) for name, value in self._arrays.items()]
        _check_names((name for name, _, _ in shapes), f"law {self.name!r}: a parameter")
        return np.dtype([*shapes, ("_", "f8")])  # never empty

    @cached_property
    def _arrays(self) -> dict[str, Array]:
        """Return the parameters, then the arrays that are derived from them, the last for the usual period."""
        parameters = {name: _numbers(self, name) for name in type(self).model_fields}
        derived = {name: np.asarray(value, dtype=np.float64) for name, value in self.computed().items()}
        for name in derived.keys() & parameters.keys():
            raise LawError(f"law {self.name!r}: derived() returns {name!r}, the name of a parameter: take another")
        return {**parameters, **derived}


def choice(choices: Any, name: str) -> float:
    """Return the number that ``step`` sees for a ``Literal`` parameter of this value; the order of the choices is free.

    Bind it to a constant of the module, as in ``RAMP = choice(Model, "ramp")`` with ``Model = Literal["constant",
    "ramp"]``, and compare ``parameters.model == RAMP``.

    Args:
        choices: the ``Literal``.
        name: one of its strings.

    Raises:
        UnknownNameError: it is none of them.
    """
    if name not in get_args(choices):
        raise UnknownNameError("choice", name, get_args(choices))
    return float(crc32(name.encode()))  # of the text alone


def _numbers(law: Law, name: str) -> Array:
    """Return a field's value as a float64 array, of no dimensions for a number; a ``Literal`` string as its number."""
    value, annotation = getattr(law, name), type(law).model_fields[name].annotation
    try:
        return np.array(choice(annotation, value) if isinstance(value, str) else value, dtype=np.float64)
    except (ValueError, TypeError, UnknownNameError):
        raise LawError(
            f"law {law.name!r}: a step cannot see the parameter {name} = {value!r}: "
            "it must be a number, a boolean, a Literal string, or a rectangular tuple of numbers"
        ) from None


def _check_names(names: Iterable[str], owner: str) -> None:
    """Refuse names that a NumPy record keeps for itself: interpreted, ``parameters.mean`` would be its method.

    Raises:
        LawError: there is one.
    """
    for name in names:
        if hasattr(np.record, name):
            raise LawError(f"{owner} cannot be called {name!r}: take another name")


@cache
def _state_layout(state: type[LawState], law: str) -> np.dtype[Any]:
    _check_names(state.model_fields, f"law {law!r}: a field of its state")
    try:
        initial = state()
        shapes = {name: np.array(getattr(initial, name), dtype=np.float64).shape for name in state.model_fields}
    except (WristError, ValueError, TypeError) as error:
        raise LawError(f"law {law!r}: its state needs initial values that are numbers or arrays: {error}") from None
    shapes = shapes or {"_": ()}  # never empty
    return np.dtype([(name, "f8", shape) for name, shape in shapes.items()])


def _components(law: type[Law]) -> Iterator[tuple[str, str]]:
    """Yield the name of each number of a law's state, and its field; a first dimension of three are the body axes."""
    layout = law.state_layout()
    for field in law.State.model_fields:
        shape = layout[field].shape
        axes = [("x", "y", "z") if n == 3 and k == 0 else tuple(map(str, range(n))) for k, n in enumerate(shape)]
        for indices in product(*axes):
            yield "_".join((field, *indices)), field


class ModelBasedLaw(Law):
    """A law that uses H and N, by default of half a control period ahead, because the torque is held for a period."""

    abstract: ClassVar[bool] = True

    prediction: bool = quantity(True, "", "take model and feed-forward half a period ahead")
