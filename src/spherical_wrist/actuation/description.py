"""Description of the motors: faults and their size, and the coils of a spherical motor.

The commanded torque of a law is cut by the limits of the model's motors, and then:

==================  ===================================================================================================
part                effect
==================  ===================================================================================================
torque_quantum Δ    every motor's torque is rounded to a multiple of Δ, before the limits
lag T               motor torques, or coil currents, follow theirs as T ẋ = x_wanted − x, exactly, also between samples
cogging A, n        a torque −∂U/∂θ on the joint, U = −(A/n) Σ cos(n θ_i), θ = log(q): n detents a turn about each axis
coils               see :mod:`spherical_wrist.actuation.coils`
==================  ===================================================================================================

A law with prediction takes its model ``lag`` further ahead: a lag is known from a motor's data sheet. Dry friction is
``friction`` of the experiment, a property of the plant's joint. Equations, sources and realistic values of all parts
are in ``models/README.md``.
"""

from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Self

from pydantic import BeforeValidator, Field, model_validator

from spherical_wrist.parameters import Member, NonNegative, Positive, inherited, quantity


def _several(given: Any) -> Any:
    """Turn one number into a list of it."""
    return (given,) if isinstance(given, int) and not isinstance(given, bool) else given


Tilt = Annotated[float, Field(ge=0, lt=1.5)]
Numbers = Annotated[tuple[Annotated[int, Field(ge=0)], ...], BeforeValidator(_several)]


class Actuation(Member):
    """Three torque motors, as the model has them."""

    kind: ClassVar[str] = "actuation"
    abstract: ClassVar[bool] = True

    torque_quantum: NonNegative = quantity(0.0, "N·m", "resolution of a motor's torque")
    lag: NonNegative = quantity(0.0, "s", "time constant of a motor's torque, or of a coil's current")
    cogging: NonNegative = quantity(0.0, "N·m", "amplitude of the cogging torque, per axis")
    detents: Annotated[int, Field(ge=1, le=10_000)] = quantity(
        8, "", "cogging periods in a turn about an axis", acts_with={"cogging": True}
    )

    @property
    def ideal(self) -> bool:
        """True if no motor fault is enabled: the joint gets the commanded torque within the limits, and no other."""
        return not self.acting


class Ideal(Actuation):
    """The model's three torque motors with their limits, and with the faults that are set."""


class SphericalMotor(Actuation):
    """A spherical motor: coils on a sphere around a rotor of magnetic poles, their currents allocated in least norm.

    The torque map, its condition number over the workspace and the least-norm currents are the subject of Yan, Chen,
    Lim, Yang and Lee, *Design, Modeling and Experiments of 3-DOF Electromagnetic Spherical Actuators*, Springer, 2011,
    chapter 3 (doi:10.1007/978-94-007-1646-9_3). The layout and all values here are assumptions. With eight poles and
    24 coils in rings at ±30° the map has a condition number of at most 3.8 for every spin and every tilt up to 1.4 rad,
    and 2 A make at least 0.05 N·m in any direction there. A single ring makes no torque across the tool at home.
    """

    coils: Annotated[int, Field(ge=3, le=256)] = quantity(24, "", "number of coils")
    layers: Annotated[int, Field(ge=1, le=16)] = quantity(2, "", "rings that the coils are spread over evenly")
    latitude: Tilt = quantity(0.5235988, "rad", "latitude of the outermost rings, seen from the ball's centre")
    poles: Annotated[int, Field(ge=4, le=64, multiple_of=2)] = quantity(8, "", "magnetic poles around the rotor")
    torque_constant: Positive = quantity(0.02, "N·m/A", "largest torque that one coil makes per ampere")
    current_limit: Positive = quantity(2.0, "A", "largest current of a coil; beyond it all currents are scaled down")
    resistance: Positive = quantity(2.5, "Ω", "of one coil")
    failed: Numbers = quantity((), "", "numbers of coils that make no torque")
    failure_known: bool = quantity(
        False, "", "the allocation does without the failed coils", acts_with={"failed": True}
    )
    strength_error: NonNegative = quantity(
        0.0, "", "relative standard deviation of the coils' strengths, not known", percent=True, random=True
    )

    @property
    def ideal(self) -> bool:
        """Always False: currents must be allocated to the coils."""
        return False

    @model_validator(mode="after")
    def _has_coils_that_work(self) -> Self:
        if self.coils % self.layers:
            raise ValueError(f"{self.coils} coils do not spread evenly over {self.layers} layers")
        wrong = [number for number in self.failed if number >= self.coils]
        if wrong:
            raise ValueError(f"there is no coil {wrong[0]}: failed must be numbers from 0 to {self.coils - 1}")
        if self.coils - len(set(self.failed)) < 3:
            raise ValueError("fewer than three coils are left, which cannot make every torque")
        return self


class Realistic(SphericalMotor):
    """The spherical motor with a lag, a torque resolution, cogging, and coils of uneven strength.

    Steps of 1.2·10⁻⁴ N·m are 12 bits over ±0.25 N·m. Strengths that scatter by 2 % come from magnets whose remanence
    their makers hold to ±5 % (Magnetic Materials Producers Association, by https://www.emetor.com/glossary). The lag of
    a current loop of about 300 Hz and cogging of about 1 % of the largest torque are assumptions; a stator without
    iron would have no cogging.
    """

    torque_quantum: NonNegative = inherited(SphericalMotor, "torque_quantum", 1.2e-4)
    lag: NonNegative = inherited(SphericalMotor, "lag", 5e-4)
    cogging: NonNegative = inherited(SphericalMotor, "cogging", 2e-3)
    strength_error: NonNegative = inherited(SphericalMotor, "strength_error", 0.02)


def spread(coils: int, layers: int, latitude: float) -> Sequence[tuple[float, float]]:
    """Return longitude and latitude [rad] of every coil.

    The rings lie evenly between ±latitude, every other turned by half a step; a single ring lies on the equator.
    """
    each = coils // layers
    turn = 6.283185307179586 / each
    heights = [0.0] if layers == 1 else [latitude * (2.0 * layer / (layers - 1) - 1.0) for layer in range(layers)]
    return [(turn * (k + 0.5 * (layer % 2)), height) for layer, height in enumerate(heights) for k in range(each)]
