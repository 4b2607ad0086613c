"""Closed loop of the fuzzy law in plain Python, NumPy and MuJoCo's bindings.

Independent implementation of the whole path from error to torque, directly from the equations. It takes only the
parameters of an experiment from the package. The benchmark times it, and the tests compare its trajectory with that of
the package.
"""

import mujoco
import numpy as np

from spherical_wrist import Experiment
from spherical_wrist.prepare.plant import plant_of


def product(p, q):
    """Compute the quaternion product p ⊗ q."""
    return np.concatenate([[p[0] * q[0] - p[1:] @ q[1:]], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])])


def matrix(q):
    """Compute the rotation matrix R(q)."""
    x = np.array([[0.0, -q[3], q[2]], [q[3], 0.0, -q[1]], [-q[2], q[1], 0.0]])
    return np.eye(3) + 2.0 * q[0] * x + 2.0 * x @ x


def exp(v):
    """Compute the quaternion of a rotation vector."""
    angle = np.linalg.norm(v)
    return np.concatenate([[np.cos(angle / 2)], np.sinc(angle / (2 * np.pi)) * v / 2])


def log(q):
    """Compute the shortest rotation vector of a quaternion."""
    q = q if q[0] >= 0.0 else -q
    sine = np.linalg.norm(q[1:])
    return 2.0 * q[1:] if sine < 1e-12 else 2.0 * np.arctan2(sine, q[0]) * q[1:] / sine


def errors(q, w, desired):
    """Compute the error log(q⁻¹ q_d), the rate error R_e ω_d − ω and the feed-forward R_e ω̇_d − ω × R_e ω_d."""
    relative = product(q * [1.0, -1.0, -1.0, -1.0], desired["attitude"])
    R = matrix(relative)
    rate = R @ desired["rate"]
    return log(relative), rate - w, R @ desired["acceleration"] - np.cross(w, rate)


def triangles(x, count):
    """Compute the membership of x in ``count`` triangular sets with peaks evenly spaced over [−1, 1]."""
    peaks = np.linspace(-1.0, 1.0, count)
    return np.maximum(0.0, 1.0 - np.abs(np.clip(x, -1.0, 1.0) - peaks) / (peaks[1] - peaks[0]))


def fuzzy_torque(law, e, de, ff, H, N):
    """Compute the torque of eq. (44)–(48) with tanh switching."""
    acceleration = ff + np.array(law.Kv) * de + np.array(law.Kp) * e
    rules = np.array(law.rules)
    alpha = np.empty(3)
    for i in range(3):
        strength = np.outer(triangles(e[i] / law.error_scale[i], 7), triangles(de[i] / law.rate_scale[i], 3))
        alpha[i] = (strength * rules).sum() / strength.sum()
    surface = law.slope * alpha * e + de
    return H @ acceleration + N + np.array(law.K) * np.tanh(surface / np.array(law.phi))


def simulate_plainly(experiment: Experiment, torque_on_joint: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Simulate an experiment with one physics step per control period; return attitudes (n, 4) and torques (n, 3).

    Args:
        experiment: experiment with the fuzzy law, ``tanh`` switching and prediction.
        torque_on_joint: constant disturbance [N·m], (3,).
    """
    law, period = experiment.law, experiment.control_period
    plant, nominal = plant_of(experiment).model, experiment.nominal().model
    data, believed = mujoco.MjData(plant), mujoco.MjData(nominal)
    count = round(experiment.duration / period)
    time = np.arange(count) * period
    desired = experiment.reference.motion(time)
    ahead = experiment.reference.motion(time + 0.5 * period)
    data.qpos[:], data.qvel[:] = desired["attitude"][0], desired["rate"][0]
    data.qfrc_applied[:] = torque_on_joint
    attitudes, torques, H = np.empty((count, 4)), np.empty((count, 3)), np.empty((3, 3))
    limits = plant.actuator_ctrlrange
    for k in range(count):
        q, w = data.qpos.copy(), data.qvel.copy()
        e, de, ff = errors(q, w, desired[k])
        q_ahead, w_ahead = product(q, exp(0.5 * period * (w + 0.25 * period * ff))), w + 0.5 * period * ff
        believed.qpos[:], believed.qvel[:] = q_ahead, w_ahead
        mujoco.mj_forward(nominal, believed)
        mujoco.mj_fullM(nominal, believed, H)
        _, _, ff_ahead = errors(q_ahead, w_ahead, ahead[k])
        torque = fuzzy_torque(law, e, de, ff_ahead, H, believed.qfrc_bias - believed.qfrc_passive)
        data.ctrl[:] = np.clip(torque, limits[:, 0], limits[:, 1])
        attitudes[k], torques[k] = q, data.ctrl
        mujoco.mj_step(plant, data)
    return attitudes, torques
