"""Closed loop of one run, prepared from an experiment: models, law, sensors and motors, and source of the inputs."""

from collections.abc import Callable
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from spherical_wrist.actuation import Actuation
from spherical_wrist.actuation import Ideal as IdealActuation
from spherical_wrist.actuation.drive import Drive, aim, drive_of
from spherical_wrist.arrays import Array
from spherical_wrist.compat.libmujoco import drop_step_timer
from spherical_wrist.control.contract import COMMAND, SIGNAL, Law
from spherical_wrist.disturbance import Torque
from spherical_wrist.errors import LawError, WristError, one_line
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.experiment.perturbation import Start
from spherical_wrist.experiment.timing import Timing
from spherical_wrist.loop import loop
from spherical_wrist.loop.engine import interpreted_engine
from spherical_wrist.loop.instant import write_errors, write_model
from spherical_wrist.loop.outcome import Outcome, Status
from spherical_wrist.loop.rollout import Inputs, LoopArguments
from spherical_wrist.prepare.acting_constraints import constraint_warnings, constraints_of
from spherical_wrist.prepare.cache import Models, RunCache
from spherical_wrist.prepare.inputs import HasMotion, InputSource
from spherical_wrist.prepare.joint_range import JointRange
from spherical_wrist.prepare.motor_reach import reach_warnings
from spherical_wrist.prepare.nominal import NominalModel
from spherical_wrist.prepare.user_part_checks import check_step, checked_motion, checked_torque, checked_warnings
from spherical_wrist.sensing import Ideal as IdealSensing
from spherical_wrist.sensing import Sensing
from spherical_wrist.sensing.measure import sensor_of
from spherical_wrist.sensing.samples import Samples
from spherical_wrist.so3 import quaternion_exp, quaternion_product, relative_attitude, rotate
from spherical_wrist.wrist import Wrist

RATE_LIMIT = 1000.0
"""Rate [rad/s] above which a run has diverged: one radian per millisecond, far beyond any wrist."""

CHUNK = 8192
"""Control periods per chunk. Chunks bound the memory of a run of any duration."""

NO_TORQUE_ADVICE = "look for divisions by zero, and for roots and logarithms of negative numbers"

NO_ERROR, IDEAL_SENSING, IDEAL_ACTUATION = Start(), IdealSensing(), IdealActuation()

MAX_STEPS = 16 * CHUNK
"""Most physics steps per chunk: bounds the time between two checks of ``stop``, and the memory of the disturbance."""


class ClosedLoop:
    """Closed loop of one run, created at the initial state.

    Args:
        models: plant and nominal model.
        law: control law.
        reference: desired motion.
        disturbance: torque on the plant's joint.
        timing: control and physics periods.
        cache: cache of the thread, which also gives the engine.
        start: initial errors.
        sensing: sensors.
        actuation: motors.
        seed: seed of the random faults of sensors and motors.

    Attributes:
        parts: arguments of the loop, with the present state.
        sensing: sensors.
        actuation: motors.
        widths: size of the law's state, and number of coil currents.
        sample: number of control instants simulated so far.
        outcome: outcome of the run; None while it runs.
        warnings: sentences about what makes the run doubtful, of the model to begin with. Whoever prepares the run or
            sees it end may append more; see :mod:`spherical_wrist.measure.warnings`.
        reach_warnings: function that returns sentences about a reference beyond the limits of the motors, which takes
            time: it is called for runs in which a limit cut the torque, or that were lost.

    Raises:
        LawError: the law raises, writes no torque, or cannot be compiled.
    """

    def __init__(
        self,
        models: Models,
        law: Law,
        reference: HasMotion,
        disturbance: Torque,
        timing: Timing,
        cache: RunCache,
        *,
        start: Start = NO_ERROR,
        sensing: Sensing = IDEAL_SENSING,
        actuation: Actuation = IDEAL_ACTUATION,
        seed: int = 0,
    ) -> None:
        drop_step_timer()
        self.sample = 0
        self.outcome: Outcome | None = None
        self.warnings: list[str] = list(models.wrist.warnings)
        self.reach_warnings: Callable[[], tuple[str, ...]] = tuple
        self._models, self._law, self._timing, self._reference = models, law, timing, reference
        self.sensing, self.actuation = sensing, actuation
        engine, wrist, data = cache.engine, models.wrist, models.data
        self._range = JointRange.of(models.plant)
        settings = _settings(law, timing, actuation)
        samples = Samples(sensing, timing.control_period, seed)
        aged = sensing.timestamped and not sensing.ideal
        self._source = InputSource(timing, reference, disturbance, samples, aged, float(settings["ahead"][0]))
        periods = timing.control_period, timing.physics_period
        drive = drive_of(actuation, wrist.motors, wrist.lower, wrist.upper, *periods, seed)
        plant = loop.Plant(
            engine.handle(models.plant),
            engine.handle(data),
            *(data.qpos, data.qvel, data.ctrl, data.qfrc_applied, data.warning.number),
        )
        data.qpos[:], data.qvel[:] = _initial_state(reference, start)
        state, signal, command = law.packed_state(), np.zeros(1, SIGNAL), np.zeros(1, COMMAND)
        if type(law) not in cache.checked_laws:
            self._check_law(state, signal, settings, drive)
            cache.checked_laws.add(type(law))
        prepared = cache.law(law, timing.control_period)
        self.parts = LoopArguments(
            *(prepared.step, prepared.packed, state, plant, constraints_of(models.plant, data), models.nominal.handles),
            *(sensor_of(sensing, timing.control_period), drive, settings, signal, command),
        )
        self.widths = law.state_size, len(drive.coils)

    def measured_warnings(self) -> tuple[str, ...]:
        """Return sentences on constraints that acted on the plant, and on a reference beyond the joint's range."""
        constraints, period = self.parts.constraints, self._timing.control_period
        acted = constraint_warnings(self._models.plant, constraints, period, self.sample)
        return (*(self._range.warnings() if self._range else ()), *acted)

    def next_inputs(self, samples: int = CHUNK, steps: int = MAX_STEPS) -> Inputs:
        """Sample the inputs of the next control periods: at most ``samples``, and at most ``steps`` physics steps."""
        samples = min(samples, max(1, steps // self._timing.substeps))
        last = min(self.sample + samples, self._timing.samples) if self.outcome is None else self.sample
        self.parts.settings["first"] = self.sample
        return self.draw(self.sample, last)

    def draw(self, first: int, last: int) -> Inputs:
        """Sample the inputs of control instants ``first`` to ``last`` − 1. Calls must be in order, without gaps."""
        inputs = self._source.draw(first, last)
        if self._range is not None:
            self._range.add(inputs.desired["attitude"])
        return inputs

    def record_progress(self, logged: int, status: int, fault: Exception | None = None) -> None:
        """Add the control periods of one call of the loop, and set ``outcome`` if the run has ended.

        Args:
            logged: number of control periods.
            status: status of the loop.
            fault: exception that the law raised.

        Raises:
            LawError: the law raised, or wrote a torque that is not finite, at the first instant.
        """
        self.sample += logged
        time = self.sample * self._timing.control_period
        if status in (loop.NO_TORQUE, loop.RAISED):
            advice = f"; {NO_TORQUE_ADVICE}" if status == loop.NO_TORQUE else ""
            try:
                self.raise_law_error("wrote a torque that is not finite" if fault is None else _raised(fault))
            except WristError as error:
                self.fail(error, advice)
            return
        if status == loop.TOO_FAST:
            speed = float(np.linalg.norm(self.parts.plant.qvel))
            reason = f"the wrist turns at {speed:.4g} rad/s, beyond {RATE_LIMIT:g} rad/s"
            self.outcome = Outcome(Status.DIVERGED, time, reason)
        elif status == loop.UNSTABLE:
            self.outcome = Outcome(Status.DIVERGED, time, "the physics became unstable (state not finite or huge)")
        elif self.sample == self._timing.samples:
            self.outcome = Outcome(Status.COMPLETED, time)

    def fail(self, error: Exception, advice: str = "") -> None:
        """End the run at the present instant because of an error; the series before it is kept.

        Args:
            error: the error.
            advice: addition to its text.

        Raises:
            Exception: the error, if nothing has been simulated.
        """
        if self.sample == 0:
            raise error
        self.outcome = Outcome(Status.FAILED, self.sample * self._timing.control_period, f"{error}{advice}")

    def raise_law_error(self, fault: str) -> NoReturn:
        """Raise the error of the law at the present instant, as one interpreted step shows it if it can.

        Raises:
            LawError: always.
        """
        check_step(self._law, self.parts.signal, self.parts.state)
        time = float(self.parts.signal["time"][0])
        raise LawError(f"law {self._law.name!r} at t = {time:.6g} s {fault}")

    @property
    def wrist(self) -> Wrist:
        """Nominal wrist, whose motors and tool the plant shares."""
        return self._models.wrist

    def _check_law(self, state: Array, signal: npt.NDArray[Any], settings: npt.NDArray[Any], drive: Drive) -> None:
        """Run one control instant in plain Python, which raises errors that compiled code would miss."""
        engine, data = interpreted_engine(), self._models.data
        desired = engine.records(self._reference.motion(np.zeros(1)))
        q, w = tuple(map(float, data.qpos)), tuple(map(float, data.qvel))
        trial = self._models.nominal.interpreted()
        record, scale = engine.record(signal), float(settings["rate_scale"][0])
        write_errors(record, engine.record(settings), 0, q, w, desired[0], 0.0)
        write_model(record, scale, trial, q, w, desired[0], desired[0], 0.0)
        aim(
            drive._replace(settings=engine.record(drive.settings)),
            (q[0], q[1], q[2], q[3]),
            w,
            0.0,
            record.torque_limit,
        )
        check_step(self._law, signal, state)


def _raised(error: Exception) -> str:
    return f"raised {type(error).__name__}: {one_line(error)}"


def _initial_state(reference: HasMotion, start: Start) -> tuple[tuple[float, ...], Array]:
    """Return the attitude and rate that give the errors of ``start``."""
    desired = reference.motion(np.zeros(1))[0]
    w, x, y, z = map(float, desired["attitude"])
    a, b, c = map(float, desired["rate"])
    q_d, w_d = (w, x, y, z), (a, b, c)
    back = (-start.error[0], -start.error[1], -start.error[2])
    q = quaternion_product(q_d, quaternion_exp(back))
    carried = rotate(relative_attitude(q, q_d), w_d)
    return q, np.subtract(carried, start.rate_error)


def _settings(law: Law, timing: Timing, actuation: Actuation) -> npt.NDArray[Any]:
    settings = np.zeros(1, loop.SETTINGS)
    settings["period"] = timing.control_period
    settings["substeps"] = timing.substeps
    settings["ahead"] = 0.5 * timing.control_period + actuation.lag if law.looks_ahead else 0.0
    settings["rate_scale"] = 0.0 if law.gravity_only else 1.0
    settings["rate_limit"] = RATE_LIMIT
    return settings


def prepare(
    experiment: Experiment,
    cache: RunCache,
    *,
    stop: Callable[[], bool] = lambda: False,
    slot: int = 0,
    models: Models | None = None,
) -> ClosedLoop:
    """Prepare the closed loop that an experiment describes.

    Args:
        experiment: experiment to run.
        cache: cache of this thread.
        stop: polled while the disturbance is sized; returns True to stop.
        slot: slot of the cache, which determines the plant that is used.
        models: plant and nominal model; by default those of the cache.

    Raises:
        StoppedError: ``stop`` returned True.
        ParameterError: the periods are no multiples of each other, or the disturbance has no size.
        ModelError: the MJCF file is not a wrist.
        LawError: the law raises, writes no torque, or cannot be compiled.
    """
    timing = experiment.timing(cache.wrist(experiment.wrist_file) if models is None else models.wrist)
    if models is None:
        models = cache.models(experiment.wrist_file, experiment.perturbation, timing, slot)
    drawn = checked_motion(experiment.reference, experiment.generator_of_reference, experiment.duration)
    state = experiment.reference.state()
    reference, load, seed = cache.motion(drawn, state), experiment.disturbance, experiment.seed
    peak = peak_torque(experiment, drawn, models.nominal, timing, cache, stop)

    def worst() -> Torque:
        from spherical_wrist.prepare.worst_torque import cached_worst_torque  # which prepares a loop of its own

        return cached_worst_torque(experiment, cache, stop)

    torque = checked_torque(load, peak, np.random.default_rng(seed), worst)
    loop = (experiment, state) if load.built_for_loop else None
    prepared = ClosedLoop(
        models,
        experiment.law,
        reference,
        cache.sampled(("torque", load, peak, seed, loop), torque),
        timing,
        cache,
        start=experiment.start,
        sensing=experiment.sensing,
        actuation=experiment.actuation,
        seed=seed,
    )
    key = ("reach", experiment.wrist_file, drawn, state, timing, experiment.actuation)
    prepared.reach_warnings = lambda: cache.value(
        key, lambda: reach_warnings(models.nominal, reference, timing, prepared.parts.drive)
    )
    timestep = float(models.wrist.model.opt.timestep)
    if experiment.physics_period is None and timing.differs_from(timestep):
        prepared.warnings.append(
            f"the physics steps are {timing.physics_period:g} s: the model's timestep of {timestep:g} s does not "
            f"divide the control period of {timing.control_period:g} s; give physics_period, or the model a timestep "
            "that does"
        )
    prepared.warnings += checked_warnings(experiment.reference, experiment.duration)
    return prepared


def peak_torque(
    experiment: Experiment,
    drawn: HasMotion,
    nominal: NominalModel,
    timing: Timing,
    cache: RunCache,
    stop: Callable[[], bool] = lambda: False,
) -> float:
    """Compute the torque [N·m] that the size of a relative disturbance is a fraction of; 0 for an absolute one.

    Args:
        experiment: the experiment.
        drawn: its reference with everything random drawn.
        nominal: its nominal model.
        timing: its timing.
        cache: cache of this thread.
        stop: polled a few times a second; returns True to stop.

    Raises:
        StoppedError: ``stop`` returned True.
    """
    load, state = experiment.disturbance, experiment.reference.state()
    if load.amplitude is not None or load.level == 0.0:
        return 0.0
    sizing = experiment.reference.sizing()
    sized = cache.motion(drawn if sizing is experiment.reference else sizing, state)
    key = ("peak", experiment.wrist_file, drawn, state, timing)
    return cache.value(key, lambda: nominal.peak_torque(sized, timing, stop))
