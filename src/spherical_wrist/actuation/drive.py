"""Motor model: torque on the joint from the commanded torque of a law; compiled into the closed loop."""

from functools import lru_cache
from math import exp
from typing import Any, NamedTuple

import numpy as np

from spherical_wrist.actuation.cogging import cogging_torque
from spherical_wrist.actuation.coils import allocate, coil_torque, condition, fill_map, gram, largest_torques
from spherical_wrist.actuation.description import Actuation, SphericalMotor, spread
from spherical_wrist.arrays import Array
from spherical_wrist.so3 import Quaternion, Vector3, advance

DRIVE = np.dtype(
    [
        ("ideal", "f8"),
        ("motors", "f8", (3, 3)),
        ("controls", "f8", (3, 3)),
        ("lower", "f8", 3),
        ("upper", "f8", 3),
        ("quantum", "f8", 3),
        ("decay", "f8"),
        ("average", "f8"),
        ("ahead", "f8"),
        ("halfway", "f8"),
        ("cogging", "f8"),
        ("detents", "i8"),
        ("order", "i8"),
        ("limit", "f8"),
        ("condition", "f8"),
    ],
    align=True,
)
"""Parameters of the motors, then the condition number of the coils' torque map as the controller believes it."""

_NO_ACCELERATION = (0.0, 0.0, 0.0)
"""Acceleration [rad/s²] assumed for attitudes a period ahead, where it changes a torque by less than matters."""


class Drive(NamedTuple):
    """Motors in the form that the loop uses: three motor controls, or N coil currents.

    Attributes:
        settings: a DRIVE record, or an array of one.
        wanted: commanded motor controls or coil currents [A], (3,) or (N,).
        level: present ones.
        coils: directions of the coils in the world, (N, 3); N = 0 for three motors.
        strength: torque per ampere of each coil [N·m/A], (N,).
        believed: the same as the allocation believes it, (N,).
        K: torque map, (3, N), working memory.
    """

    settings: Any
    wanted: Array
    level: Array
    coils: Array
    strength: Array
    believed: Array
    K: Array


def drive_of(
    actuation: Actuation,
    motors: Array,
    lower: Array,
    upper: Array,
    control_period: float,
    physics_period: float,
    seed: int,
) -> Drive:
    """Return motors at rest.

    Args:
        actuation: their description.
        motors: body-frame torque [N·m] per control of the model's three motors, (3, 3).
        lower: smallest controls (3,).
        upper: largest controls (3,).
        control_period: time that currents are held for [s].
        physics_period: physics step [s].
        seed: random seed of the coils' uneven strengths.
    """
    settings = np.zeros(1, DRIVE)
    settings["ideal"] = actuation.ideal
    settings["motors"], settings["controls"] = motors, _inverse(motors.tobytes())
    settings["lower"], settings["upper"] = lower, upper
    settings["quantum"] = actuation.torque_quantum / np.linalg.norm(motors, axis=0)
    if actuation.lag > 0.0:
        ratio = physics_period / actuation.lag
        settings["decay"], settings["average"] = exp(-ratio), (1.0 - exp(-ratio)) / ratio
    settings["ahead"], settings["halfway"] = 0.5 * control_period + actuation.lag, 0.5 * physics_period
    settings["cogging"], settings["detents"] = actuation.cogging, actuation.detents
    settings["condition"] = np.nan
    if not isinstance(actuation, SphericalMotor):
        none = np.zeros(0)
        return Drive(settings, np.zeros(3), np.zeros(3), np.zeros((0, 3)), none, none.copy(), np.zeros((3, 0)))
    count = actuation.coils
    settings["order"], settings["limit"] = actuation.poles // 2, actuation.current_limit
    places = np.array(spread(count, actuation.layers, actuation.latitude))
    longitude, latitude = places.T
    flat = np.cos(latitude)
    coils = np.stack([flat * np.cos(longitude), flat * np.sin(longitude), np.sin(latitude)], axis=1)
    works = np.ones(count)
    works[list(actuation.failed)] = 0.0
    uneven = 1.0 + actuation.strength_error * np.random.default_rng([seed, 2]).standard_normal(count)
    believed = actuation.torque_constant * (works if actuation.failure_known else np.ones(count))
    strength = actuation.torque_constant * works * uneven
    return Drive(settings, np.zeros(count), np.zeros(count), coils, strength, believed, np.zeros((3, count)))


@lru_cache
def _inverse(motors: bytes) -> Array:
    """Return the inverse of a matrix (3, 3); cached, because all episodes of a campaign have the same."""
    return np.asarray(np.linalg.inv(np.frombuffer(motors).reshape(3, 3)), dtype=np.float64)


def aim(drive: Drive, seen: Quaternion, rate: Any, age: float, limit: Array) -> None:
    """Find the torque map of the coils for the next torque command, and the limits of the motors.

    Coils get the currents for the attitude in which they will act, that predicted for the middle of the period and the
    lag after it: they are held while the rotor turns on, and at 3 rad/s and 1 ms the field of eight poles has turned
    by 6 mrad of its phase until then, an error of as many parts of a coil's torque.

    Args:
        drive: the motors, whose torque map and its condition number are written.
        seen: measured attitude.
        rate: measured rate [rad/s], (3,).
        age: known age of that measurement [s].
        limit: largest torque about each body axis alone, in both directions [N·m], (3,), written.
    """
    now = drive.settings
    for i in range(3):
        limit[i] = np.inf
        for j in range(3):
            share = abs(now.controls[j, i])
            if share > 0.0:
                limit[i] = min(limit[i], max(0.0, min(now.upper[j], -now.lower[j])) / share)
    if len(drive.coils) == 0:
        return
    then = advance(seen, (rate[0], rate[1], rate[2]), _NO_ACCELERATION, age + now.ahead)
    fill_map(then.attitude, drive.coils, drive.believed, now.order, drive.K)
    entries = gram(drive.K)
    now.condition = condition(entries)
    most = largest_torques(drive.K, entries, now.limit)
    for i in range(3):
        limit[i] = min(limit[i], most[i])


def set_torque_command(drive: Drive, torque: Any, control: Array) -> float:
    """Set the torque command [N·m]: write ``drive.wanted``, and into ``control`` the motor controls for that torque.

    Args:
        drive: the motors, for which :func:`aim` has found the torque map.
        torque: commanded body-frame torque, (3,).
        control: motor controls within their limits (3,), written.

    Returns:
        1 if a limit cut the torque, else 0.
    """
    now, saturated = drive.settings, 0.0
    for i in range(3):
        wanted = 0.0
        for j in range(3):
            wanted += now.controls[i, j] * torque[j]
        if now.quantum[i] > 0.0:
            wanted = now.quantum[i] * np.floor(wanted / now.quantum[i] + 0.5)
        control[i] = wanted
        if wanted < now.lower[i]:
            control[i] = now.lower[i]
            saturated = 1.0
        elif wanted > now.upper[i]:
            control[i] = now.upper[i]
            saturated = 1.0
    if now.ideal > 0.5:
        return saturated
    if len(drive.coils) == 0:
        for i in range(3):
            drive.wanted[i] = control[i]
        return saturated
    cut = allocate(drive.K, gram(drive.K), motor_torque(now.motors, control), now.limit, drive.wanted)
    return 1.0 if cut else saturated


def step_motors(drive: Drive, attitude: Quaternion, rate: Any, control: Array, applied: Array) -> None:
    """Step the motors over one physics step: write the mean of the controls they reach, add cogging to ``applied``.

    Torques that depend on the attitude are those halfway through the step: with those of its beginning the rotor would
    gain energy from detents, and feel its coils half a step early.

    Args:
        drive: the motors; not ideal ones, whose controls are those of :func:`set_torque_command`.
        attitude: true attitude at the beginning of the step.
        rate: true rate there [rad/s], (3,).
        control: motor controls (3,), written.
        applied: torque on the joint (3,) [N·m], added to.
    """
    now = drive.settings
    halfway = advance(attitude, (rate[0], rate[1], rate[2]), _NO_ACCELERATION, now.halfway).attitude
    x, y, z = 0.0, 0.0, 0.0
    for j in range(len(drive.level)):
        missing = drive.level[j] - drive.wanted[j]
        mean = drive.wanted[j] + now.average * missing
        drive.level[j] = drive.wanted[j] + now.decay * missing
        if len(drive.coils) > 0:
            t = coil_torque(halfway, (drive.coils[j, 0], drive.coils[j, 1], drive.coils[j, 2]), now.order)
            mean *= drive.strength[j]
        else:
            t = (now.motors[0, j], now.motors[1, j], now.motors[2, j])
        x, y, z = x + mean * t[0], y + mean * t[1], z + mean * t[2]
    for i in range(3):
        reached = now.controls[i, 0] * x + now.controls[i, 1] * y + now.controls[i, 2] * z
        control[i] = min(now.upper[i], max(now.lower[i], reached))  # as MuJoCo will cut it
    if now.cogging > 0.0:
        cog = cogging_torque(halfway, now.cogging, now.detents)
        for i in range(3):
            applied[i] += cog[i]


def motor_torque(motors: Array, control: Any) -> Vector3:
    """Return the body-frame torque [N·m] of the model's three motors at their controls."""
    u, v, w = control[0], control[1], control[2]
    return (
        motors[0, 0] * u + motors[0, 1] * v + motors[0, 2] * w,
        motors[1, 0] * u + motors[1, 1] * v + motors[1, 2] * w,
        motors[2, 0] * u + motors[2, 1] * v + motors[2, 2] * w,
    )
