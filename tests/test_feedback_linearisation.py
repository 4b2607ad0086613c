"""Feedback linearisation, eq. (9)–(14), against MuJoCo's accelerations."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigs import states
from spherical_wrist.control import ComputedTorque
from spherical_wrist.control.contract import COMMAND, SIGNAL
from spherical_wrist.loop.engine import interpreted_step
from spherical_wrist.so3 import attitude_error, feed_forward, rate_error


def acceleration(model, q, w, torque):
    """MuJoCo's ω̇ under a torque."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.qfrc_applied[:] = q, w, torque
    mujoco.mj_forward(model, data)
    H = np.empty((3, 3))
    mujoco.mj_fullM(model, data, H)
    return data.qacc.copy(), H, data.qfrc_bias - data.qfrc_passive


@pytest.mark.parametrize(("q", "w"), states(5))
def test_equations_10_to_13_input_and_torque_are_inverse_to_each_other(nominal, q, w):
    """For any torque, q̈_d − ω̇ is the U of eq. (12), and eq. (13) gives that torque back."""
    random = np.random.default_rng(1)
    torque, desired = random.normal(0.0, 0.1, 3), random.normal(0.0, 5.0, 3)
    actual, H, N = acceleration(nominal.model, q, w, torque)
    U = desired + np.linalg.solve(H, N - torque)
    assert desired - actual == pytest.approx(U, abs=1e-8)
    assert H @ (desired - U) + N == pytest.approx(torque, abs=1e-12)


@pytest.mark.parametrize(("q", "w"), states(5, speed=2.0))
def test_equations_9_and_14_the_law_makes_the_plant_a_double_integrator(nominal, q, w):
    """With τ of eq. (14) MuJoCo's acceleration leaves q̈_d − ω̇ = −Kv ė − Kp e, e being the log of eq. (9) on SO(3)."""
    random = np.random.default_rng(2)
    target = (Rotation.from_quat(q, scalar_first=True) * Rotation.from_rotvec([0.2, -0.1, 0.3])).as_quat(
        scalar_first=True
    )
    rate, demand = random.normal(size=3), random.normal(size=3)
    e, de = attitude_error(q, target), rate_error(q, w, target, rate)
    assert e == pytest.approx([0.2, -0.1, 0.3])
    ff = feed_forward(q, w, target, rate, demand)
    _, H, N = acceleration(nominal.model, q, w, np.zeros(3))
    signal, command = np.zeros(1, SIGNAL), np.zeros(1, COMMAND)
    for name, value in {"error": e, "rate_error": de, "feed_forward": ff, "H": H, "N": N}.items():
        signal[name] = value
    law = ComputedTorque()
    views = (array.view(np.recarray)[0] for array in (signal, command))
    interpreted_step(law)(next(views), law.packed(), np.zeros(1), next(views))
    actual, _, _ = acceleration(nominal.model, q, w, command["torque"][0])
    assert ff - actual == pytest.approx(-40.0 * np.array(de) - 400.0 * np.array(e), abs=1e-8)
