"""Linear response of a closed loop about a pose, measured on the compiled loop itself by finite differences.

The loop settles at a fixed attitude of its reference. From that state it runs on with a pulse of one control period,
small and of either sign, on one input; half the difference of the two runs over the size of the pulse is the derivative
of the loop: what every output does after a unit pulse, k periods later. A linear system of sampled data is its pulse
responses. All that the loop remembers takes part in them: wrist, law, delay lines, filters of sensors and motors.

The state is not differentiated itself, because not all of it is a smooth quantity: delay lines are rings with an index,
and laws count samples. Convolved with the pulse responses, an input gives the outputs; their Fourier transform is the
frequency response at the control instants, with the hold of the torque over a period in it.

What has no derivative is left out: noise, resolution and losses of sensors, resolution of motors, dry friction.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple, TypeVar

import mujoco
import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.compat.libmujoco import warnings_kept_in_data
from spherical_wrist.dynamics import MOTION
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.experiment.perturbation import Start
from spherical_wrist.loop.loop import RUNNING
from spherical_wrist.loop.outcome import StoppedError
from spherical_wrist.loop.rollout import Inputs, Rollout, run_chunk
from spherical_wrist.measure.metrics import no_totals
from spherical_wrist.prepare.cache import SLOTS, RunCache
from spherical_wrist.prepare.closed_loop import ClosedLoop
from spherical_wrist.sensing.measure import sensor_of
from spherical_wrist.sensing.samples import SAMPLE

Responses = TypeVar("Responses", "TorqueResponses", "SensorResponses")

SETTLING = 6.0
"""Longest time [s] that a loop is given to settle at the pose."""

KICK = 1e-3
"""Error about each axis [rad] from which a loop settles: an unstable one would stay at an exact equilibrium."""

SHORTEST, LONGEST = 1.0, 16.0
"""Shortest and longest pulse responses [s]."""

DECAYED, GROWING = 1e-4, 0.2
"""Share of the last quarter of a response in its l1 norm: that of one long enough, and of one that does not decay.

What is cut off changes a frequency response, and the largest effect of a bounded input, by about the former.
"""

WATCHED = 2.0
"""Time [s] for which a small torque is watched to tell whether it decays."""

RATE_CHANGE, ATTITUDE_CHANGE = 1e-4, 1e-6
"""Size of the pulses: change of the rate [rad/s] by a torque or on a sensor, and of the attitude [rad] on a sensor.

Rounding of 1e-16 rad is then 1e-9 of a response, and layers, limits and fuzzy sets of laws are far larger.
"""

MOVING = 0.01
"""Rate [rad/s] above which a wrist is not at rest."""

SMOOTH = 1e-2
"""Largest part of a response that may be even in the pulse, relative to the odd one. It is 0 of a linear loop."""


class NotLinearError(ParameterError):
    """A closed loop has no linear response: it does not settle at the pose, or its law switches there."""


class TorqueResponses(NamedTuple):
    """Responses to unit pulses of torque about each axis; row k after k control periods.

    Attributes:
        command: commanded torque [N·m] per N·m that is added to the command, (n, 3 outputs, 3 inputs).
        tip: displacement of the tool tip in the world [m] per N·m on the joint, (n, 3, 3).
    """

    command: Array
    tip: Array


class SensorResponses(NamedTuple):
    """Responses to unit pulses on a sensor about each axis; row k after k control periods.

    Attributes:
        measured: measured attitude [rad] or rate [rad/s], with the pulse in it, (n, 3 outputs, 3 inputs).
        tip: displacement of the tool tip in the world [m], (n, 3, 3).
    """

    measured: Array
    tip: Array


class SettledLoop:
    """Closed loop of an experiment that has settled at an attitude of its reference.

    Args:
        experiment: experiment; its disturbance is left out.
        cache: cache of this thread; its slot beyond the last one is used.
        at: time of the reference whose attitude is held [s].
        unknown_delay: age of the samples beyond that of the experiment, which the controller does not know [s].
        stop: polled a few times a second; returns True to stop.

    Raises:
        StoppedError: ``stop`` returned True.
        NotLinearError: the loop does not settle.
        WristError: see :func:`spherical_wrist.prepare.closed_loop.prepare`.
    """

    def __init__(
        self,
        experiment: Experiment,
        cache: RunCache,
        *,
        at: float = 0.0,
        unknown_delay: float = 0.0,
        stop: Callable[[], bool] = lambda: False,
    ) -> None:
        self._cache, self._law, self._stop = cache, experiment.law, stop
        wrist = cache.wrist(experiment.wrist_file)
        timing = experiment.timing(wrist)
        plant = experiment.perturbation._replace(friction=0.0)
        self._models = cache.models(experiment.wrist_file, plant, timing, SLOTS)
        self._pose = _still(experiment.drawn_reference.motion(np.array([at])))
        faults = {"attitude_noise": 0.0, "attitude_quantum": 0.0, "rate_noise": 0.0, "loss": 0.0}
        sensing = experiment.sensing.replaced(**faults)
        self._loop = ClosedLoop(
            self._models,
            experiment.law,
            _Pose(self._pose),
            lambda time: np.zeros((len(time), 3)),
            timing,
            cache,
            start=Start((KICK, KICK, KICK)),
            sensing=sensing,
            actuation=experiment.actuation.replaced(torque_quantum=0.0),
            seed=experiment.seed,
        )
        sensor = sensor_of(sensing.replaced(delay=sensing.delay + unknown_delay), timing.control_period)
        sensor.settings["ideal"] = 0.0  # the pulses are sensor faults, which ideal sensors would not let in
        self._loop.parts = self._loop.parts._replace(sensor=sensor)
        self._timing, self._age = timing, sensing.delay
        self._measured_rate = sensing.rate == "measured"
        self._measurement = experiment.measurement(wrist).packed()
        self._lever = wrist.lever
        # about the axis of largest inertia, so that no axis turns by more
        self._torque = RATE_CHANGE / timing.control_period * float(_inertia(self._models.plant, self._models.data))
        self._settle()
        self._rest = self._state()
        self._at_rest = lru_cache(maxsize=1)(self._run)

    @property
    def has_rate_sensor(self) -> bool:
        """False if the rate is estimated from attitudes."""
        return self._measured_rate

    def torque_responses(self) -> TorqueResponses:
        """Measure the responses to torques, long enough for them to decay.

        The pulse that is added to the command is filtered by the lag of the motors, and acts on the joint from then on.
        Coils are taken to give the torque that is commanded.

        Raises:
            NotLinearError: they do not decay, or are not linear in the pulse.
        """

        def measure(count: int) -> TorqueResponses:
            substeps = self._timing.substeps
            lagging, held = _lagging(self._loop.parts.drive, substeps, count), np.zeros(count * substeps)
            held[:substeps] = 1.0
            added = [self._odd(count, self._torque, disturbance=np.outer(lagging, unit)) for unit in np.eye(3)]
            on_joint = added
            if not np.array_equal(lagging, held):
                on_joint = [self._odd(count, self._torque, disturbance=np.outer(held, unit)) for unit in np.eye(3)]
            command, tip = [each.command for each in added], [each.tip for each in on_joint]
            return TorqueResponses(np.stack(command, axis=2), np.stack(tip, axis=2))

        return self._until_decayed(measure)

    def attitude_responses(self) -> SensorResponses:
        """Measure the responses to errors of the measured attitude [rad], as :meth:`torque_responses` does."""

        def measure(count: int) -> SensorResponses:
            outputs = [self._odd(count, ATTITUDE_CHANGE, attitude_noise=unit) for unit in np.eye(3)]
            seen, tip = [each.attitude for each in outputs], [each.tip for each in outputs]
            return SensorResponses(np.stack(seen, axis=2), np.stack(tip, axis=2))

        return self._until_decayed(measure)

    def rate_responses(self) -> SensorResponses:
        """Measure the responses to errors of the measured rate [rad/s], as :meth:`torque_responses` does.

        Only with a rate sensor; an estimated rate has no error of its own.
        """

        def measure(count: int) -> SensorResponses:
            outputs = [self._odd(count, RATE_CHANGE, rate_noise=unit) for unit in np.eye(3)]
            seen, tip = [each.rate for each in outputs], [each.tip for each in outputs]
            return SensorResponses(np.stack(seen, axis=2), np.stack(tip, axis=2))

        return self._until_decayed(measure)

    def is_stable(self) -> bool:
        """Return True if a small torque about all axes together leaves ever less of itself."""
        count = round(WATCHED / self._timing.control_period)
        pulse = np.zeros((count * self._timing.substeps, 3))
        pulse[: self._timing.substeps] = self._torque
        try:
            up, down = self._run(count, disturbance=pulse), self._run(count, disturbance=-pulse)
        except NotLinearError:
            return False
        for plus, minus in zip(up, down, strict=True):
            parts = [float(np.abs(part).sum()) for part in np.array_split(plus - minus, 4)]
            if parts[3] > max(parts[2], 1e-6 * sum(parts)):
                return False
        return True

    @property
    def _name(self) -> str:
        return f"law {self._law.name!r}"

    def _until_decayed(self, measure: Callable[[int], Responses]) -> Responses:
        seconds = SHORTEST
        while True:
            found = measure(round(seconds / self._timing.control_period))
            left = max(map(remainder, found))
            if left < DECAYED:
                return found
            if seconds >= LONGEST:
                if left > GROWING:
                    raise NotLinearError(f"{self._name}: a small disturbance does not decay within {LONGEST:g} s")
                return found
            seconds *= 2.0

    def _odd(self, count: int, size: float, **pulse: Array) -> "_Outputs":
        """Return the derivative of the outputs by a pulse: the odd part over its size."""
        rest = self._at_rest(count)
        up, down = (self._run(count, **{name: sign * size * each for name, each in pulse.items()}) for sign in (1, -1))
        found = []
        for plus, minus, zero in zip(up, down, rest, strict=True):
            odd, even = plus - minus, plus + minus - 2.0 * zero
            if np.abs(even).max() > SMOOTH * np.abs(odd).max() + 1e-12:
                raise NotLinearError(f"{self._name} switches at the pose: its loop has no derivative there")
            found.append(odd / (2.0 * size))
        return _Outputs(*found)

    def _run(self, count: int, **pulse: Array) -> "_Outputs":
        """Run the loop from rest with a pulse; return its outputs relative to the pose."""
        self._restore(self._rest)
        log = self._advance(count, **pulse)
        from scipy.spatial.transform import Rotation  # takes long to import, and few runs need it

        tip = Rotation.from_quat(log["attitude"], scalar_first=True).apply(self._lever)
        pose, measured = (
            Rotation.from_quat(each["attitude"], scalar_first=True)
            for each in (self._pose[0], {"attitude": log["measured_attitude"]})
        )
        turned = (pose.inv() * measured).as_rotvec()
        return _Outputs(log["commanded_torque"].copy(), tip, turned, log["measured_rate"].copy())

    def _settle(self) -> None:
        """Run until the command is at rest.

        Raises:
            NotLinearError: it does not come to rest.
        """
        chunk = max(2, round(0.5 / self._timing.control_period))
        limit, spreads, rate = float(np.abs(self._loop.wrist.upper).max()), [], 0.0
        for _ in range(round(SETTLING / 0.5)):
            log = self._advance(chunk)[chunk // 2 :]
            spreads.append(float(np.ptp(log["commanded_torque"], axis=0).max()))
            rate = float(np.abs(log["rate"]).max())
            if spreads[-1] < 1e-6 * limit and rate < RATE_CHANGE:
                return
        if rate > MOVING:
            raise NotLinearError(
                f"{self._name} does not settle at the pose: after {SETTLING:g} s the wrist still turns at "
                f"{rate:.2g} rad/s"
            )
        if spreads[-1] > 1e-4 * limit and spreads[-1] > 0.5 * spreads[-3]:
            raise NotLinearError(
                f"{self._name} does not settle at the pose: after {SETTLING:g} s its torque still swings by "
                f"{spreads[-1]:.2g} N·m"
            )

    def _advance(
        self,
        count: int,
        disturbance: Array | None = None,
        attitude_noise: Array | None = None,
        rate_noise: Array | None = None,
    ) -> Any:
        """Run ``count`` control periods; noise is that of the first sample. Return their log.

        Raises:
            NotLinearError: the run diverges.
        """
        if self._stop():
            raise StoppedError
        loop = self._loop
        first = int(loop.parts.settings["first"][0])
        samples = np.zeros(count, SAMPLE)
        samples["age"] = self._age
        if attitude_noise is not None:
            samples["attitude_noise"][0] = attitude_noise
        if rate_noise is not None:
            samples["rate_noise"][0] = rate_noise
        desired = np.repeat(self._pose, count)
        torque = np.zeros((count * self._timing.substeps, 3)) if disturbance is None else disturbance
        inputs = Inputs(self._timing.instants(first, first + count), desired, desired, desired, samples, torque)
        rollout = Rollout(loop.parts, inputs, self._measurement, no_totals(), loop.widths)
        with warnings_kept_in_data():
            chunk = run_chunk([rollout], self._cache.engine, self._cache.log(count))
        [progress] = chunk.progress
        if chunk.faults:
            loop.raise_law_error(f"raised {type(chunk.faults[0]).__name__}: {chunk.faults[0]}")
        if progress.status != RUNNING:
            raise NotLinearError(f"{self._name} does not settle at the pose: the run diverges")
        loop.parts.settings["first"] = first + count
        assert chunk.logged is not None
        return chunk.logged.log

    def _arrays(self) -> list[npt.NDArray[Any]]:
        """Return the arrays that hold the state of the loop, except for that of the plant."""
        parts = self._loop.parts
        sensor, drive = parts.sensor, parts.drive
        return [parts.state, sensor.settings, sensor.history, drive.wanted, drive.level, parts.settings]

    def _state(self) -> tuple[Array, list[npt.NDArray[Any]]]:
        plant = np.empty(mujoco.mj_stateSize(self._models.plant, PLANT_STATE))
        mujoco.mj_getState(self._models.plant, self._models.data, plant, PLANT_STATE)
        return plant, [array.copy() for array in self._arrays()]

    def _restore(self, state: tuple[Array, list[npt.NDArray[Any]]]) -> None:
        mujoco.mj_setState(self._models.plant, self._models.data, state[0], PLANT_STATE)
        for array, kept in zip(self._arrays(), state[1], strict=True):
            array[:] = kept


PLANT_STATE = mujoco.mjtState.mjSTATE_INTEGRATION


class _Outputs(NamedTuple):
    """Outputs of a run, each (n, 3): see :class:`PulseResponses`."""

    command: Array
    tip: Array
    attitude: Array
    rate: Array


class _Pose(NamedTuple):
    """Reference that stays at a pose, MOTION (1,)."""

    pose: npt.NDArray[Any]

    def motion(self, time: Array) -> npt.NDArray[Any]:
        """See :meth:`spherical_wrist.reference.base.Reference.motion`."""
        return np.repeat(self.pose, len(time))


def _still(motion: npt.NDArray[Any]) -> npt.NDArray[Any]:
    pose = np.zeros(1, MOTION)
    pose["attitude"] = motion["attitude"]
    return pose


def _inertia(model: Any, data: Any) -> float:
    mujoco.mj_forward(model, data)
    inertia = np.empty((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    return float(np.diag(inertia).max())


def _lagging(drive: Any, substeps: int, count: int) -> Array:
    """Return the torque of lagging motors on each physics step for a unit command held over the first period."""
    settings = drive.settings[0]
    decay, average = float(settings["decay"]), float(settings["average"])
    torque, level = np.empty(count * substeps), 0.0
    for step in range(len(torque)):
        wanted = 1.0 if step < substeps else 0.0
        torque[step] = wanted + average * (level - wanted)
        level = wanted + decay * (level - wanted)
    return torque


def remainder(response: Array) -> float:
    """Return the share of the last quarter of a response in its l1 norm."""
    size = np.abs(response)
    whole = size.sum()
    return float(size[-(len(size) // 4) :].sum() / whole) if whole > 0.0 else 0.0
