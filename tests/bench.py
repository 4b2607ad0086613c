"""What several test files share: rigid-body mechanics from scratch, small wrists to try, one-line closed loops."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spherical_wrist import Experiment
from spherical_wrist.control import Law
from spherical_wrist.disturbance import Torque
from spherical_wrist.reference import Lissajous, Reference
from spherical_wrist.simulation.closed_loop import ClosedLoop, Start
from spherical_wrist.simulation.engine import Engine
from spherical_wrist.simulation.series import Series
from spherical_wrist.simulation.timing import Timing
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


def still(time: np.ndarray) -> np.ndarray:
    """No disturbance."""
    return np.zeros((len(time), 3))


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
) -> ClosedLoop:
    """A closed loop, by default of a perfect model that follows a Lissajous motion undisturbed."""
    timing = Timing.of(duration, period, step)
    begin = start or Start()
    return ClosedLoop(plant or nominal, nominal, law, reference or Lissajous(), disturbance, timing, engine, begin)


def finished(running: ClosedLoop, samples: int | None = None) -> Series:
    """Runs a closed loop to its end, some samples at a time, and joins what it logged."""
    parts = []
    while running.outcome is None:
        parts.append(running.advance() if samples is None else running.advance(samples))
    return Series.joined(parts)


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
