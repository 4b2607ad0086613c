"""The Denavit-Hartenberg chain, eq. (3) to (8), and its inverse against MuJoCo's site, SciPy and round trips."""

import mujoco
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rigs import directions, mjcf, one_line, wrist_of
from spherical_wrist.errors import ParameterError
from spherical_wrist.paper.denavit_hartenberg import Chain, Link, joint_rotation, twist_rotation
from spherical_wrist.paper.inverse_kinematics import (
    angles_of_direction,
    angles_of_rotation,
    angles_of_tip,
    families,
    rotation_towards,
)
from spherical_wrist.wrist import Wrist

BALL = '<geom type="sphere" size="0.01" mass="0.1"/>'
WRISTS = {
    "shipped": Wrist.load(),
    "asymmetric": wrist_of(mjcf()),
    "upwards": wrist_of(mjcf(f'{BALL}<site name="tip" pos="0.002 -0.001 0.1"/>')),
    "sideways": wrist_of(mjcf(f'{BALL}<site name="tip" pos="-0.05 0.03 0.003"/>')),
}
CHAINS = {name: Chain.of(wrist) for name, wrist in WRISTS.items()}
SHIPPED = CHAINS["shipped"]
each_wrist = pytest.mark.parametrize("name", WRISTS)
DVRK = np.deg2rad([[-80.0, 80.0], [-80.0, 80.0], [-260.0, 260.0]])
any_angles = st.tuples(*[st.floats(-10.0, 10.0)] * 3).map(np.array)


def turn_of(angles):
    return Rotation.from_euler("XYZ", angles)


def apart(matrix, angles):
    """Angle [rad] between a rotation and the one of the angles; below 1e-8, arccos would see nothing."""
    return np.linalg.norm((turn_of(angles).inv() * Rotation.from_matrix(matrix)).as_rotvec(), axis=-1)


def test_eq_5_and_6_are_scipys_turns_about_z_and_x():
    """Eq. (5): U about z. Eq. (6): V about x. One angle or many."""
    angles = np.random.default_rng(1).uniform(-7.0, 7.0, 30)
    np.testing.assert_allclose(
        joint_rotation(angles), Rotation.from_euler("z", angles[:, None]).as_matrix(), atol=1e-15
    )
    np.testing.assert_allclose(
        twist_rotation(angles), Rotation.from_euler("x", angles[:, None]).as_matrix(), atol=1e-15
    )
    np.testing.assert_allclose(joint_rotation(angles.reshape(5, 6))[2, 3], joint_rotation(angles[15]), atol=1e-15)


def test_eq_4_and_8_one_link_is_screwed_along_its_joint_and_then_along_its_x():
    """Eq. (4): R = U V. Eq. (8), one factor: the four moves of the convention one after the other."""
    link = Link(offset=0.3, d=0.05, a=0.02, twist=-0.8)
    for angle in (0.0, 1.2, -4.0):
        spin, tilt = Rotation.from_euler("z", angle + 0.3), Rotation.from_euler("x", -0.8)
        np.testing.assert_allclose(link.rotation(angle), (spin * tilt).as_matrix(), atol=1e-15)
        transform = link.transform(angle)
        np.testing.assert_array_equal(transform[3], [0.0, 0.0, 0.0, 1.0])
        point = np.array([0.1, -0.2, 0.3])
        moved = spin.apply(tilt.apply(point) + np.array([0.02, 0.0, 0.0])) + np.array([0.0, 0.0, 0.05])
        np.testing.assert_allclose((transform @ [*point, 1.0])[:3], moved, atol=1e-16)


def test_the_shipped_wrists_table():
    """Three axes through one point at right angles, then 115 mm of tool along −z of the last frame."""
    quarter = np.pi / 2
    assert SHIPPED.links[:2] == (Link(quarter, 0.0, 0.0, quarter), Link(quarter, 0.0, 0.0, quarter))
    np.testing.assert_allclose(SHIPPED.links[2], [0.0, -0.115, 0.0, 0.0], atol=1e-15)
    np.testing.assert_array_equal(SHIPPED.tool, np.eye(3))
    # the joint axes in the world at q = 0, which the angles turn about
    frames = [SHIPPED.base[:3, :3]]
    for link in SHIPPED.links[:2]:
        frames.append(frames[-1] @ link.rotation(np.array(0.0)))
    np.testing.assert_allclose([frame[:, 2] for frame in frames], np.eye(3), atol=1e-15)


@each_wrist
def test_eq_7_the_chain_turns_by_alpha_beta_gamma(name):
    """Eq. (7), with the constant turns at both ends, is Rx(α) Ry(β) Rz(γ): SciPy's "XYZ"."""
    angles = np.random.default_rng(2).uniform(-7.0, 7.0, (50, 3))
    chain = CHAINS[name]
    np.testing.assert_allclose(chain.rotation(angles), turn_of(angles).as_matrix(), atol=1e-14)
    product = np.eye(3)
    for link, angle in zip(chain.links, angles[0], strict=True):
        product = product @ joint_rotation(angle + link.offset) @ twist_rotation(np.array(link.twist))
    np.testing.assert_allclose(chain.rotation(angles[0]), chain.base[:3, :3] @ product @ chain.tool, atol=1e-15)


@each_wrist
def test_eq_8_is_mujocos_pose_of_the_tip(name):
    """Eq. (8), with the translation that the paper's form lacks, at random attitudes; and it is vectorised."""
    wrist, chain = WRISTS[name], CHAINS[name]
    data = mujoco.MjData(wrist.model)
    angles = np.random.default_rng(3).uniform(-np.pi, np.pi, (50, 3))
    poses, tips = chain.transform(angles), chain.tip(angles)
    for q, pose, tip in zip(angles, poses, tips, strict=True):
        data.qpos[:] = turn_of(q).as_quat(scalar_first=True)
        mujoco.mj_forward(wrist.model, data)
        np.testing.assert_allclose(tip, data.site("tip").xpos, atol=1e-15)
        np.testing.assert_allclose(pose[:3, :3], data.xmat[wrist.body].reshape(3, 3), atol=1e-14)
        np.testing.assert_allclose(pose[:3, 3], tip)
        np.testing.assert_array_equal(pose[3], [0.0, 0.0, 0.0, 1.0])
        np.testing.assert_allclose(chain.transform(q), pose, atol=1e-16)
    np.testing.assert_allclose(chain.transform(angles.reshape(5, 10, 3))[2, 3], poses[23], atol=1e-15)


@given(any_angles, directions(), st.floats(0.0, 3.0))
def test_eq_3_is_zero_where_the_angles_reach_the_attitude_and_else_says_how_far_it_is(angles, axis, angle):
    """Eq. (3): Ψ(X, q) is the turn from the chain's attitude to X."""
    reached = turn_of(angles)
    np.testing.assert_allclose(SHIPPED.residual(reached.as_matrix(), angles), np.zeros(3), atol=1e-14)
    beyond = (reached * Rotation.from_rotvec(angle * axis)).as_matrix()
    np.testing.assert_allclose(SHIPPED.residual(beyond, angles), angle * axis, atol=1e-13)
    many = SHIPPED.residual(np.stack([beyond, beyond]), np.stack([angles, angles]))
    np.testing.assert_allclose(many, [angle * axis] * 2, atol=1e-13)


@given(any_angles)
@example(np.zeros(3))
@example(np.array([np.pi, 0.3, -np.pi]))
@example(np.array([0.0, 4.59375, -1.0]))
def test_both_families_reach_the_attitude_and_one_of_them_is_where_it_came_from(angles):
    matrix = turn_of(angles).as_matrix()
    both = families(matrix)
    assert (apart(matrix, both) < 1e-11).all()
    assert abs(both[0, 1]) <= np.pi / 2
    assert abs(both[1, 1]) >= np.pi / 2 - 1e-15
    assert (np.abs(both) <= np.pi).all()
    partner = both[0] * [1.0, -1.0, 1.0] + np.pi
    np.testing.assert_allclose(np.exp(1j * both[1]), np.exp(1j * partner), atol=1e-14)
    if abs(np.cos(angles[1])) > 1e-3:
        off = np.abs(np.remainder(both - angles + np.pi, 2.0 * np.pi) - np.pi).max(axis=1)
        assert sorted(off)[0] < 1e-11


def test_families_of_many_are_those_of_each():
    matrices = Rotation.random(12, rng=np.random.default_rng(4)).as_matrix()
    many = families(matrices.reshape(3, 4, 3, 3))
    assert many.shape == (3, 4, 2, 3)
    for matrix, both in zip(matrices, many.reshape(12, 2, 3), strict=True):
        np.testing.assert_allclose(families(matrix), both, atol=1e-15)
        alone = angles_of_rotation(matrix)
        assert (alone.singular, alone.reason) == (False, "")
        np.testing.assert_allclose(sorted(alone.angles.tolist()), sorted(both.tolist()), atol=1e-15)


def counted(angles, limits):
    """By brute force: how often whole turns of the two families fall within the limits."""
    alpha, beta, gamma = angles
    total = 0
    for family in ([alpha, beta, gamma], [alpha + np.pi, np.pi - beta, gamma + np.pi]):
        turns = family + 2.0 * np.pi * np.arange(-9, 10)[:, None]
        total += np.prod(((turns >= limits[:, 0]) & (turns <= limits[:, 1])).sum(axis=0))
    return int(total)


@given(any_angles, any_angles, any_angles)
def test_within_limits_every_branch_is_found_and_nothing_else(angles, one, other):
    """All whole turns of both families that the limits allow, each once, each reaching the attitude."""
    limits = np.stack([np.minimum(one, other), np.maximum(one, other)], axis=1)
    matrix = turn_of(angles).as_matrix()
    if abs(np.cos(angles[1])) < 1e-3:
        return
    found = angles_of_rotation(matrix, limits)
    assert not found.singular
    for answer in found.angles:
        assert apart(matrix, answer) < 1e-11
        assert (answer >= limits[:, 0] - 1e-12).all()
        assert (answer <= limits[:, 1] + 1e-12).all()
    # limits a hair wider and narrower bracket what rounding can do to an angle on its limit
    hair = np.array([-1e-10, 1e-10])
    assert counted(angles, limits - hair) <= len(found.angles) <= counted(angles, limits + hair)
    assert len(np.unique(np.round(found.angles, 6), axis=0)) == len(found.angles)
    assert bool(found.reason) == (len(found.angles) == 0)
    norms = np.linalg.norm(found.angles, axis=1)
    assert (np.diff(norms) >= 0.0).all()


def test_a_wide_joint_has_an_answer_for_each_turn():
    """The dVRK's roll of ±260° reaches 150° also as −210°; its ±80° of pitch and yaw leave one family only."""
    found = angles_of_rotation(turn_of([0.2, -0.3, np.deg2rad(150.0)]).as_matrix(), DVRK)
    np.testing.assert_allclose(found.angles, [[0.2, -0.3, np.deg2rad(150.0)], [0.2, -0.3, np.deg2rad(-210.0)]])


def test_a_limit_itself_is_in_reach():
    for corner in (DVRK[:, 0], DVRK[:, 1]):
        found = angles_of_rotation(turn_of(corner).as_matrix(), DVRK)
        assert np.abs(found.angles - corner).max(axis=1).min() < 1e-12
        beyond = corner + np.array([0.0, 1e-9 * np.sign(corner[1]), 0.0])
        assert len(angles_of_rotation(turn_of(beyond).as_matrix(), DVRK).angles) == 0


def test_beyond_the_limits_the_answer_is_empty_and_says_why():
    found = angles_of_rotation(turn_of([0.2, 1.45, 0.1]).as_matrix(), DVRK)
    assert found.angles.shape == (0, 3)
    assert "\n" not in found.reason
    assert "(0.2, 1.45, 0.1) or (-2.94159, 1.69159, -3.04159)" in found.reason
    assert "β -1.39626 to 1.39626" in found.reason


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_at_the_singularity_each_answer_stands_for_a_line(side):
    """β = ±π/2: one answer without limits, one for each segment of the line within limits, the shortest of each."""
    matrix = turn_of([0.5, side * np.pi / 2, 0.2]).as_matrix()
    kept = 0.5 + side * 0.2
    found = angles_of_rotation(matrix)
    assert (found.singular, found.reason) == (True, "")
    np.testing.assert_allclose(found.angles, [[kept / 2, side * np.pi / 2, side * kept / 2]], atol=1e-15)
    for along in (-2.0, 0.0, 0.7):  # the line
        assert apart(matrix, found.angles[0] + along * np.array([1.0, 0.0, -side])) < 1e-14

    limits = np.array([[0.6, 0.9], [-2.0, 2.0], [-7.0, 7.0]])
    within = angles_of_rotation(matrix, limits)
    assert within.singular
    assert (apart(matrix, within.angles) < 1e-14).all()
    turns = kept + 2.0 * np.pi * np.array([0.0, 1.0, -1.0])
    alpha = np.clip(turns / 2, 0.6, 0.9)
    expected = np.stack([alpha, np.full(3, side * np.pi / 2), side * (turns - alpha)], axis=1)
    np.testing.assert_allclose(within.angles, expected, atol=1e-14)

    free = angles_of_rotation(matrix, np.array([[-2.0, 2.0]] * 3)).angles
    np.testing.assert_allclose(free, found.angles, atol=1e-15)

    out = angles_of_rotation(matrix, np.array([[0.6, 0.7], [-2.0, 2.0], [1.0, 1.1]]))
    assert len(out.angles) == 0
    assert f"α {'+' if side > 0 else '−'} γ = {kept:.6g}" in out.reason
    assert len(angles_of_rotation(matrix, DVRK).angles) == 0  # its β ends at 80°


@given(st.sampled_from([-1.0, 1.0]), any_angles, any_angles, any_angles)
def test_singular_answers_within_limits_are_complete(side, angles, one, other):
    """Scanned by brute force: some (α, γ) of the box is on the line if and only if there is an answer."""
    limits = np.stack([np.minimum(one, other), np.maximum(one, other)], axis=1)
    limits[1] = -8.0, 8.0
    kept = angles[0] + side * angles[2]
    matrix = turn_of([angles[0], side * np.pi / 2, angles[2]]).as_matrix()
    found = angles_of_rotation(matrix, limits)
    assert found.singular
    for answer in found.angles:
        assert apart(matrix, answer) < 1e-11
        assert (answer >= limits[:, 0] - 1e-11).all()
        assert (answer <= limits[:, 1] + 1e-11).all()
    lines = kept + 2.0 * np.pi * np.arange(-9, 10)
    bounds = [min(alpha + side * gamma for alpha in limits[0] for gamma in limits[2])]
    bounds.append(max(alpha + side * gamma for alpha in limits[0] for gamma in limits[2]))
    if np.abs(lines[:, None] - bounds).min() > 1e-9:
        segments = int(((lines > bounds[0]) & (lines < bounds[1])).sum())
        betas = np.isin(
            np.arange(-2, 3), [k for k in range(-2, 3) if abs(side * np.pi / 2 + 2 * np.pi * k) <= 8.0]
        ).sum()
        assert len(found.angles) == segments * betas


@given(directions(), st.floats(-7.0, 7.0), st.sampled_from(sorted(WRISTS)))
@example(np.array([1.0, 0.0, 0.0]), 0.4, "shipped")
@example(np.array([-1.0, 1e-14, 0.0]), 0.4, "shipped")
@example(np.array([0.0, 0.0, 1.0]), -2.0, "shipped")
@example(np.array([0.0, 0.0, -1.0]), 0.0, "asymmetric")
def test_the_tool_points_where_it_is_told_with_every_answer(direction, roll, name):
    chain = CHAINS[name]
    found = angles_of_direction(chain, direction, roll)
    assert len(found.angles) == (1 if found.singular else 2)
    length = np.linalg.norm(chain.lever)
    for answer in found.angles:
        np.testing.assert_allclose((chain.tip(answer) - chain.base[:3, 3]) / length, direction, atol=1e-11)
    if name == "shipped" and not found.singular:
        first = families(rotation_towards(chain, direction, roll))[0]
        assert np.sin(0.5 * (first[2] - roll)) == pytest.approx(0.0, abs=1e-9 / np.hypot(*direction[1:]))
    at = chain.base[:3, 3] + length * direction
    by_tip = angles_of_tip(chain, at, roll).angles
    np.testing.assert_allclose(chain.tip(by_tip), np.broadcast_to(at, by_tip.shape), atol=1e-12)
    if np.hypot(*direction[1:]) > 1e-3:  # nearer to world ±x, rounding alone turns where roll is counted from
        assert len(by_tip) == len(found.angles)
        assert (apart(chain.rotation(found.angles[0]), by_tip) < 1e-11).all()


@each_wrist
def test_roll_turns_the_tool_about_its_own_axis(name):
    """Two rolls differ by a turn about the lever; at home no roll is no turn."""
    chain = CHAINS[name]
    direction = np.array([0.6, -0.48, 0.64])
    none, some = (rotation_towards(chain, direction, roll) for roll in (0.0, 0.7))
    between = Rotation.from_matrix(some @ none.T).as_rotvec()
    # about −z of the tool, which is the direction itself, clockwise
    np.testing.assert_allclose(between, -0.7 * direction, atol=1e-14)
    if name == "shipped":
        np.testing.assert_array_equal(rotation_towards(chain, np.array([0.0, 0.0, -1.0])), np.eye(3))
        ahead = families(rotation_towards(chain, np.array([-1.0, 0.0, 0.0]), 0.3))[0]
        assert ahead[0] + ahead[2] == pytest.approx(0.3)  # towards world ±x roll counts from α = 0


def test_directions_and_rolls_of_many_are_those_of_each():
    many = np.random.default_rng(5).normal(size=(4, 3))
    many /= np.linalg.norm(many, axis=1, keepdims=True)
    rolls = np.array([[0.1], [0.2], [0.3]])
    turned = rotation_towards(SHIPPED, many, rolls)
    assert turned.shape == (3, 4, 3, 3)
    np.testing.assert_allclose(turned[2, 1], rotation_towards(SHIPPED, many[1], 0.3), atol=1e-15)


def test_only_the_sphere_of_the_lever_is_in_reach():
    for distance in (0.115 * (1.0 + 1e-8), 0.1, 0.2, 0.0):
        found = angles_of_tip(SHIPPED, np.array([0.0, distance, 0.0]))
        assert len(found.angles) == 0
        assert f"{distance:.9g} m from the centre" in found.reason
        assert "always at 0.115 m" in found.reason
    assert len(angles_of_tip(SHIPPED, np.array([0.0, 0.115, 0.0])).angles) == 2
    assert "the limits are α" in angles_of_tip(SHIPPED, np.array([0.0, 0.0, 0.115]), limits=DVRK).reason


SQUARE = np.diag([1.0, 1.0, -1.0])


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: angles_of_direction(SHIPPED, np.array([0.0, 0.0, -1.1])), "unit vectors"),
        (lambda: angles_of_direction(SHIPPED, np.zeros(3)), "unit vectors"),
        (lambda: angles_of_direction(SHIPPED, np.array([0.0, np.nan, -1.0])), "unit vectors"),
        (lambda: angles_of_direction(SHIPPED, np.array([0.0, 1.0])), "unit vectors"),
        (lambda: angles_of_direction(SHIPPED, np.array([0.0, 0.0, 1.0]), np.inf), "roll"),
        (lambda: angles_of_tip(SHIPPED, np.array([0.0, np.inf, 0.0])), "three finite numbers"),
        (lambda: angles_of_rotation(SQUARE), "not a rotation"),
        (lambda: angles_of_rotation(1.001 * np.eye(3)), "not a rotation"),
        (lambda: angles_of_rotation(np.full((3, 3), np.nan)), "not a rotation"),
        (lambda: families(np.eye(2)), r"shape \(2, 2\)"),
        (lambda: angles_of_rotation(np.stack([np.eye(3)] * 2)), "one matrix"),
        (lambda: angles_of_rotation(np.eye(3), DVRK.T), "three pairs"),
        (lambda: angles_of_rotation(np.eye(3), DVRK[:, ::-1]), "three pairs"),
        (lambda: angles_of_rotation(np.eye(3), np.full((3, 2), np.inf)), "three pairs"),
        (lambda: Chain.of(wrist_of(mjcf(f'{BALL}<site name="tip" pos="0.002 -0.001 0.003"/>'))), "needs length"),
    ],
)
def test_what_makes_no_sense_is_an_error_in_one_line(ask, message):
    with pytest.raises(ParameterError, match=message) as caught:
        ask()
    one_line(caught.value)
