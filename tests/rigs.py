"""Tools of several test files: rigid-body mechanics from scratch, small wrists, one-line closed loops."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spherical_wrist import Experiment
from spherical_wrist.actuation import Actuation
from spherical_wrist.channels import CHANNELS, Condition
from spherical_wrist.compat.libmujoco import warnings_kept_in_data
from spherical_wrist.control import Law
from spherical_wrist.disturbance import Torque
from spherical_wrist.experiment.perturbation import Start
from spherical_wrist.experiment.timing import Timing
from spherical_wrist.loop.engine import Engine
from spherical_wrist.loop.outcome import Outcome
from spherical_wrist.loop.rollout import Rollout, run_chunk
from spherical_wrist.measure.logged import channels_of
from spherical_wrist.measure.metrics import MetricSettings
from spherical_wrist.measure.series import Series
from spherical_wrist.prepare.cache import Models, RunCache
from spherical_wrist.prepare.closed_loop import CHUNK, ClosedLoop
from spherical_wrist.reference import Lissajous, Reference
from spherical_wrist.sensing import Sensing
from spherical_wrist.simulation.metric_accumulator import MetricAccumulator
from spherical_wrist.wrist import Names, Wrist

GRAVITY = np.array([0.0, 0.0, -9.81])

MOTORS = '<motor joint="w" gear="1 0 0"/><motor joint="w" gear="0 1 0"/><motor joint="w" gear="0 0 1"/>'
TOOL = (
    '<body name="tool" pos="0.004 0 -0.05" euler="0.3 0.1 -0.2">'
    '<geom type="capsule" size="0.004 0.02" mass="0.05" pos="0.003 0 0.001"/>'
    '<site name="tip" pos="0.001 0 -0.05"/></body>'
)


def mjcf(body: str = TOOL, *, motors: str = MOTORS, joint: str = "", compiler: str = "", more: str = "") -> str:
    """A wrist without any symmetry: the ball off its body's origin, the tool turned and off the axis."""
    return f"""
    <mujoco>
      <compiler angle="radian" {compiler}/>
      <option integrator="RK4" timestep="0.001"/>
      <default><geom contype="0" conaffinity="0"/></default>
      <worldbody>
        <body name="rotor" pos="0.01 0.02 0.3">
          <joint name="w" type="ball" pos="0.002 -0.001 0.003" damping="2e-4" {joint}/>
          <geom type="ellipsoid" size="0.03 0.025 0.02" mass="0.4" pos="0.001 0.002 0"/>
          {body}
        </body>
      </worldbody>
      <actuator>{motors}</actuator>
      {more}
    </mujoco>"""


def mounted(text: str) -> str:
    """A wrist of :func:`mjcf` whose ball starts turned against the world."""
    return text.replace('<body name="rotor"', '<body name="rotor" euler="0.4 -1.1 0.7"')


def wrist_of(text: str, names: Names | None = None) -> Wrist:
    """The wrist that an MJCF text describes."""
    return Wrist.of(mujoco.MjSpec.from_string(text), names=names or Names())


@dataclass
class RigidBody:
    """A rigid body on a ball joint, in the body frame about the joint's centre."""

    mass: float
    moment: np.ndarray  # mass times centre of mass, from the joint's centre [kg·m]
    inertia: np.ndarray  # about the joint's centre [kg·m²]
    damping: float

    @classmethod
    def of(cls, wrist: Wrist) -> "RigidBody":
        """Adds up the bodies of a model at its start, where body and world frames are the same."""
        model, body = wrist.model, cls(0.0, np.zeros(3), np.zeros((3, 3)), 0.0)
        place, turn = {0: np.zeros(3)}, {0: Rotation.identity()}
        for i in range(1, model.nbody):
            parent = model.body_parentid[i]
            place[i] = place[parent] + turn[parent].apply(model.body_pos[i])
            turn[i] = turn[parent] * Rotation.from_quat(model.body_quat[i], scalar_first=True)
        jointed = model.jnt_bodyid[0]
        centre = place[jointed] + turn[jointed].apply(model.jnt_pos[0])
        carried = {jointed}
        for i in range(jointed, model.nbody):
            if i == jointed or model.body_parentid[i] in carried:
                carried.add(i)
                com = place[i] + turn[i].apply(model.body_ipos[i]) - centre
                axes = (turn[i] * Rotation.from_quat(model.body_iquat[i], scalar_first=True)).as_matrix()
                own = axes @ np.diag(model.body_inertia[i]) @ axes.T
                body.mass += model.body_mass[i]
                body.moment = body.moment + model.body_mass[i] * com
                body.inertia = body.inertia + own + model.body_mass[i] * (com @ com * np.eye(3) - np.outer(com, com))
        body.damping = float(np.ravel(model.dof_damping)[0])
        return body

    def gravity(self, attitude: Any) -> np.ndarray:
        """The torque that holds the body against gravity."""
        down = Rotation.from_quat(attitude, scalar_first=True).inv().apply(GRAVITY)
        return -np.cross(self.moment, down)

    def bias(self, attitude: Any, rate: Any) -> np.ndarray:
        """Coriolis, centrifugal, gravity and damping torque."""
        return np.cross(rate, self.inertia @ rate) + self.gravity(attitude) + self.damping * np.asarray(rate)


def states(count: int, seed: int = 0, speed: float = 10.0) -> list[tuple[np.ndarray, np.ndarray]]:
    """Random attitudes and rates."""
    random = np.random.default_rng(seed)
    attitudes = Rotation.random(count, rng=random).as_quat(scalar_first=True)
    return list(zip(attitudes, random.normal(0.0, speed, (count, 3)), strict=True))


def channel_names(*conditions: Condition) -> list[str]:
    """Channels that every run has, and those of runs that meet some conditions."""
    return [name for name, channel in CHANNELS.items() if channel.when in (Condition.ALWAYS, *conditions)]


OPTIONAL = tuple(name for name in CHANNELS if name not in channel_names(Condition.SURFACE, Condition.LOGGED))
"""Channels that depend on hardware, or on what a law keeps."""


def random_channels(rng: np.random.Generator, rows: int, names: Any, **widths: int) -> dict[str, np.ndarray]:
    """Random numbers in the shapes of channels, attitudes of unit length, and time in milliseconds."""
    arrays = {}
    for name in names:
        channel = CHANNELS[name]
        shape = channel.shape if channel.axes is not None else (widths.get(name, 24),)
        arrays[name] = rng.normal(size=(rows, *shape))
        if channel.is_attitude:
            arrays[name] /= np.linalg.norm(arrays[name], axis=1, keepdims=True)
    return arrays | ({"time": 1e-3 * np.arange(rows)} if "time" in arrays else {})


def bits(series: Series) -> dict[str, bytes]:
    """The bytes of every channel."""
    return {name: array.tobytes() for name, array in series.channels.items()}


def still(time: np.ndarray) -> np.ndarray:
    """No disturbance."""
    return np.zeros((len(time), 3))


class Running:
    """A closed loop that is advanced by hand."""

    def __init__(self, models: Models, law: Law, *parts: Any, **given: Any) -> None:
        self._loop = ClosedLoop(models, law, *parts, **given)
        self._cache = parts[-1]
        self._channels = channels_of(law, self._loop.sensing, self._loop.actuation)
        self._metrics = MetricAccumulator(
            MetricSettings(0.0, 1e-3, (0.0, 0.0, 0.1), law.boundary_layer), self._cache.engine
        )

    @property
    def sample(self) -> int:
        """Number of control periods that have been run."""
        return self._loop.sample

    @property
    def outcome(self) -> Outcome | None:
        """Outcome; None while it has not ended."""
        return self._loop.outcome

    def advance(self, samples: int | None = None) -> Series:
        """The series of so many more control periods."""
        loop, metrics = self._loop, self._metrics
        rollout = Rollout(loop.parts, loop.next_inputs(samples or CHUNK), metrics.settings, metrics.totals, loop.widths)
        count = len(rollout.inputs.time)
        with warnings_kept_in_data():
            chunk = run_chunk([rollout], self._cache.engine, self._cache.log(count))
        [progress] = chunk.progress
        loop.record_progress(*progress, chunk.faults.get(0))
        return chunk.logged.series(loop.wrist, self._channels)


def loop(
    law: Law,
    nominal: Wrist,
    engine: Engine,
    *,
    plant: Wrist | None = None,
    reference: Reference | None = None,
    disturbance: Torque = still,
    duration: float = 0.5,
    period: float = 1e-3,
    step: float = 1e-3,
    start: Start | None = None,
    sensing: Sensing | None = None,
    actuation: Actuation | None = None,
    seed: int = 0,
) -> Running:
    """A closed loop, by default of a perfect model that follows a Lissajous motion undisturbed."""
    timing, cache = Timing.of(duration, period, step), RunCache(engine)
    models = Models.of(plant or nominal, nominal, timing, engine)
    parts = {"start": start, "sensing": sensing, "actuation": actuation}
    given = {name: part for name, part in parts.items() if part is not None}
    return Running(models, law, reference or Lissajous(), disturbance, timing, cache, seed=seed, **given)


def finished(running: Running, samples: int = CHUNK) -> Series:
    """Runs a closed loop to its end, some samples at a time, and joins what it logged."""
    parts = []
    while running.outcome is None:
        parts.append(running.advance(samples))
    return Series.joined(parts)


def state_of(run: Any) -> Any:
    """The state of the law of a run by name, one record a row."""
    return named_state(run.law_state, run.experiment.law)


def named_state(rows: np.ndarray, law: Law) -> Any:
    """Rows of a law's state, by name."""
    return np.ascontiguousarray(rows).view(law.state_layout()).view(np.recarray)[..., 0]


def one_line(error: BaseException) -> str:
    """The message of an error, which must be a single line."""
    message = str(error)
    assert message
    assert "\n" not in message
    return message


def vectors(largest: float = 10.0) -> st.SearchStrategy[np.ndarray]:
    """Vectors of three numbers."""
    return st.tuples(*[st.floats(-largest, largest)] * 3).map(np.array)


def directions() -> st.SearchStrategy[np.ndarray]:
    """Unit vectors."""
    return vectors(1.0).filter(lambda v: np.linalg.norm(v) > 0.1).map(lambda v: v / np.linalg.norm(v))


def quaternions() -> st.SearchStrategy[np.ndarray]:
    """Unit quaternions, of either sign."""
    raw = st.tuples(*[st.floats(-1.0, 1.0)] * 4).map(np.array)
    return raw.filter(lambda q: np.linalg.norm(q) > 0.1).map(lambda q: q / np.linalg.norm(q))


def experiments() -> list[Experiment]:
    """Experiments that have little in common."""
    base = Experiment(duration=0.04, control_period=0.001)
    return [
        base,
        base.replaced(mass_scale=0.6, friction=2e-3),
        base.replaced(law="pd", disturbance={"name": "noise", "level": 0.3}, seed=3),
        base.replaced(law="pd", disturbance={"name": "noise", "level": 0.3}, seed=4),
        base.replaced(reference="step", disturbance={"amplitude": 0.01}, duration=0.09),
        base.replaced(reference={"name": "lissajous", "frequency": 0.9}, payload=0.02),
        base.replaced(sensing="realistic", actuation="realistic", seed=5),
        base.replaced(law="adaptive_fuzzy_sliding_computed_torque", control_period=0.002, initial_error=0.1),
        base.replaced(law={"name": "computed_torque", "Kp": 900}, physics_period=0.0005),
        base.replaced(initial_rate_error=(0.0, 900.0, 0.0), law={"name": "computed_torque", "Kv": 9000}),
        base.replaced(law="sliding_mode", actuation="spherical_motor", com_shift=(1e-3, 0.0, 0.0)),
    ]
