"""The Lyapunov monitor, eq. (34)–(43): the mismatch torque, the gain it requires, V and its decrease."""

import time
from dataclasses import replace
from math import isclose

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigs import RigidBody, mjcf, one_line, states
from spherical_wrist import Experiment, WristError, load_recording, record, simulate
from spherical_wrist.control import Law
from spherical_wrist.control.sliding_surface import SlidingSurfaceLaw
from spherical_wrist.loop.outcome import Status
from spherical_wrist.paper.lyapunov import monitor, reaching
from spherical_wrist.paper.lyapunov.motion import acceleration, error_derivative, inertia, surface_motion
from spherical_wrist.prepare.plant import plant_of
from spherical_wrist.reference import Lissajous

T = 1e-3
LAWS = ["sliding_mode", "sliding_computed_torque", "fuzzy_sliding_computed_torque"]
PERFECT = {"disturbance": 0, "mass_scale": 1}
ROUGH = {"mass_scale": 1.4, "payload": 0.02, "damping": 2e-3, "com_shift": (1e-3, -2e-3, 3e-3)}
FAR = {"initial_error": (0.3, -0.2, 0.4), "initial_rate_error": (1.0, 2.0, -3.0), "duration": 1.0}


def run_of(law="sliding_mode", switching="tanh", experiment=None, **changes):
    return simulate(Experiment(law={"name": law, "switching": switching, **changes}, **(experiment or {})))


# --- how the surface moves


def test_error_derivative_is_the_derivative_of_the_error():
    """d/dt log(q⁻¹ q_d), numerically, for small and large errors."""
    random, step = np.random.default_rng(0), 1e-6
    for size in (1e-9, 5e-4, 2e-3, 0.3, 1.5, 3.0):
        for _ in range(20):
            e = random.normal(size=3)
            e *= size / np.linalg.norm(e)
            w, w_d = random.normal(0.0, 2.0, (2, 3))
            turned = [
                Rotation.from_rotvec(-s * w) * Rotation.from_rotvec(e) * Rotation.from_rotvec(s * w_d)
                for s in (-step, step)
            ]
            slope = (turned[1].as_rotvec() - turned[0].as_rotvec()) / (2.0 * step)
            rate_error = Rotation.from_rotvec(e).apply(w_d) - w
            assert error_derivative(e[None], rate_error[None])[0] == pytest.approx(slope, abs=1e-7)


def test_error_derivative_is_one_function_on_both_sides_of_its_series():
    random = np.random.default_rng(2)
    for _ in range(10):
        e, rate_error = random.normal(size=(2, 3))
        e *= 1e-3 / np.linalg.norm(e)
        below, above = (error_derivative(s * e[None], rate_error[None])[0] for s in (1.0 - 1e-9, 1.0 + 1e-9))
        # the second-order term is 1e-7 of ė here
        assert below == pytest.approx(above, rel=0.0, abs=1e-11)
        far = np.cross(e, np.cross(e, rate_error))
        assert below - rate_error + 0.5 * np.cross(e, rate_error) == pytest.approx(far / 12.0, rel=1e-3, abs=1e-12)


def test_acceleration_is_that_of_the_rigid_body(nominal):
    body, torque = RigidBody.of(nominal), np.array([0.01, -0.02, 0.03])
    for attitude, rate in states(20):
        expected = np.linalg.solve(body.inertia, torque - body.bias(attitude, rate))
        found = acceleration(nominal, T, attitude[None], rate[None], torque[None])[0]
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-6)
    assert inertia(nominal) == pytest.approx(body.inertia, abs=1e-12)


def test_inertia_is_constant_and_the_coriolis_matrix_skew_equation_36(tmp_path):
    """Sᵀ (Ḣ − 2 N) S = 0 with N(ω) ω = ω × H ω, N(ω) = −[H ω]×: MuJoCo's own H and bias, without symmetry."""
    file = tmp_path / "skew.xml"
    file.write_text(mjcf())
    wrist, random = plant_of(Experiment(model=file)), np.random.default_rng(1)
    model, H = wrist.model, inertia(wrist)
    model.opt.gravity[:] = 0.0
    data, there = mujoco.MjData(model), np.empty((3, 3))
    for attitude, rate in states(10):
        data.qpos[:], data.qvel[:] = attitude, rate
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, there)
        assert there == pytest.approx(H, rel=1e-9, abs=1e-15)
        N = np.cross(np.eye(3), H @ rate).T  # columns −(H ω) × x̂_j
        assert N @ rate == pytest.approx(data.qfrc_bias, rel=1e-9, abs=1e-12)
        S = random.normal(size=3)
        assert abs(S @ (0.0 - 2.0 * N) @ S) < 1e-14


# --- V and its derivative

CASES = {
    "default": {},
    "perfect": {**PERFECT, **FAR},
    "rough": {**ROUGH, **FAR},
    "friction": {"friction": 3e-3, **FAR},
    "noise": {"disturbance": {"name": "noise"}, **FAR},
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("law", LAWS)
def test_rate_of_v_is_its_numerical_derivative_equations_37_and_39(law, case):
    """V̇ = Sᵀ (Δ − K sw(S)) against (V(t + T) − V(t)) / T over the way home; within 3 % of the largest V̇.

    Both ends of a period are averaged, so what is left is of second order in T.
    """
    seen = monitor(run_of(law, experiment=CASES[case], phi=1.0))
    assert seen.value == pytest.approx(
        0.5 * np.einsum("ki,ij,kj->k", seen.surface, inertia_from_bodies(CASES[case]), seen.surface)
    )
    scale = np.abs(seen.sampled_rate).max()
    assert np.abs(seen.mean_rate - seen.sampled_rate).max() < 0.03 * scale
    tail = slice(len(seen.time) // 2, None)
    assert np.abs((seen.mean_rate - seen.sampled_rate)[tail]).max() < 0.03 * scale


def inertia_from_bodies(experiment):
    return RigidBody.of(plant_of(Experiment(**experiment))).inertia


@pytest.mark.parametrize("law", LAWS[:2])
def test_the_two_rates_meet_with_the_square_of_the_period(law):
    """An error in any term of V̇ would not go away with the period."""
    gaps = []
    for period in (1e-3, 2.5e-4):
        experiment = {**ROUGH, **FAR, "control_period": period, "physics_period": period}
        seen = monitor(run_of(law, experiment=experiment))
        gaps.append(np.abs(seen.mean_rate - seen.sampled_rate).max())
    assert gaps[1] < gaps[0] / 10.0
    assert gaps[1] < 1e-3 * np.abs(seen.sampled_rate).max()


def test_a_slope_tuned_on_line_is_differentiated_too():
    """Of the fuzzy law, whose λ̇ e is no small part of Ṡ on the way home: Ṡ against the record's own difference."""
    changes = {"reference": {"name": "hold", "rotation": (0, 0, 0.2)}, "duration": 0.2, "initial_error": (0, 0, 0.04)}
    period = {"control_period": 2.5e-4, "physics_period": 2.5e-4}
    run = run_of("fuzzy_sliding_computed_torque", experiment={**PERFECT, **changes, **period})
    moved = surface_motion(run)
    change = np.diff(run.surface, axis=0) / 2.5e-4
    tuned = np.diff(run.slope[:, 2]) / 2.5e-4 * run.error[:-1, 2]
    scale = np.abs(change).max()
    assert np.abs(tuned).max() > 0.1 * scale
    assert 0.5 * (moved.after[:-1] + moved.before) == pytest.approx(change, abs=0.01 * scale)
    assert moved.after[:-1] == pytest.approx(change, abs=0.1 * scale)
    assert moved.before == pytest.approx(change, abs=0.1 * scale)


# --- the mismatch torque


@pytest.mark.parametrize("reference", ["hold", "lissajous"])
def test_no_mismatch_on_a_perfect_model_equations_38_and_39(reference):
    """Eq. (38) is then all that the plant needs: H̃ = 0, Ñ = 0, no disturbance; without looking ahead, to rounding."""
    run = run_of(prediction=False, experiment={**PERFECT, "reference": reference, "duration": 3.0})
    seen = monitor(run)
    assert np.abs(seen.mismatch).max() < 1e-9  # λ ė for d/dt (λ e) is of second order in the errors
    assert np.abs(seen.inertial).max() == 0.0
    assert seen.all_covered_fraction == 1.0


def test_looking_ahead_is_a_mismatch_of_half_a_period():
    """Supplied now is what will be needed then: ½ T dτ*/dt, with τ* the torque of the plant itself."""
    run = run_of(experiment=PERFECT)
    seen = monitor(run)
    change = np.gradient(run.torque, T, axis=0)
    assert seen.mismatch[10:-10] == pytest.approx(-0.5 * T * change[10:-10], abs=1e-6)
    assert np.abs(seen.mismatch).max() > 1e-5


@pytest.mark.parametrize("shape", ["constant", "sinusoid", "pulse", "noise"])
def test_a_disturbance_alone_is_the_mismatch(shape):
    """Δ = −d: what is pushed from outside need not be supplied."""
    disturbance = {"name": shape, "amplitude": 0.005}
    run = run_of(prediction=False, experiment={"disturbance": disturbance, "mass_scale": 1, "duration": 5.0})
    seen = monitor(run)
    assert np.abs(run.disturbance).max() >= 0.005
    assert seen.mismatch == pytest.approx(-run.disturbance, abs=2e-6)


def test_dry_friction_alone_is_the_mismatch():
    """Of a wrist that turns, friction is its torque against ω, on all three axes at once."""
    experiment = {**PERFECT, "friction": 2e-3, "reference": "lissajous", "duration": 5.0}
    run = run_of(prediction=False, experiment=experiment)
    turning = (np.abs(run.rate) > 0.2).all(axis=1)
    assert monitor(run).mismatch[turning] == pytest.approx(2e-3 * np.sign(run.rate[turning]), abs=1e-4)


def test_mismatch_of_a_wrong_model_is_its_error_equations_38_to_41():
    """H̃ a_r and Ñ from rigid-body mechanics written from scratch, with payload, damping and shifted masses."""
    experiment = Experiment(law={"name": "sliding_mode", "prediction": False}, duration=3.0, **ROUGH)
    run, eta = simulate(experiment), 1e-3
    seen = monitor(run, eta)
    believed, true = RigidBody.of(experiment.nominal()), RigidBody.of(plant_of(experiment))
    motion = Lissajous().motion(run.time)
    for k in range(0, len(run), 37):
        R = Rotation.from_quat(run.attitude[k], scalar_first=True).inv() * Rotation.from_quat(
            motion["attitude"][k], scalar_first=True
        )
        w, w_d = run.rate[k], R.apply(motion["rate"][k])
        wanted = R.apply(motion["acceleration"][k]) - np.cross(w, w_d) + 100.0 * (w_d - w)
        inertial = (true.inertia - believed.inertia) @ wanted
        rest = true.bias(run.attitude[k], w) - believed.bias(run.attitude[k], w) - run.disturbance[k]
        assert seen.inertial[k] == pytest.approx(inertial, abs=1e-6)
        assert seen.mismatch[k] == pytest.approx(inertial + rest, abs=1e-6)
        assert seen.required_gain[k] == pytest.approx(np.abs(inertial + rest) + eta, abs=1e-6)  # eq. (42)
        assert seen.sufficient_gain[k] == pytest.approx(np.abs(inertial) + np.abs(rest) + eta, abs=1e-6)  # eq. (41)


def test_pd_term_of_equation_34_counts_as_supplied():
    """Eq. (34)–(35) on a perfect model: Δ = −H (Kp e + Kv ė − λ ė), the PD term beyond the equivalent part."""
    experiment = {**PERFECT, "reference": {"name": "hold", "rotation": (0, 0, 0.2)}, "duration": 0.3}
    experiment["initial_error"] = (0.0, 0.0, 0.2)
    run = run_of("sliding_computed_torque", prediction=False, experiment=experiment)
    law = run.experiment.law
    beyond = np.array(law.Kp) * run.error + (np.array(law.Kv) - law.slope) * run.rate_error
    assert np.abs(beyond).max() > 10.0
    assert monitor(run).mismatch == pytest.approx(-beyond @ inertia_from_bodies(PERFECT).T, abs=1e-8)


@pytest.mark.parametrize("law", LAWS)
def test_sum_of_magnitudes_is_never_below_the_magnitude_of_the_sum_equation_40(law):
    seen = monitor(run_of(law, experiment={**ROUGH, "duration": 3.0}))
    assert (seen.sufficient_gain >= seen.required_gain - 1e-15).all()
    assert (seen.sufficient_gain > seen.required_gain + 1e-4).any()


# --- coverage and eq. (43)


def held_against(d, K, switching="sign", **changes):
    """A perfect model against a constant torque d on every axis."""
    experiment = {
        "disturbance": {"name": "constant", "amplitude": d},
        "mass_scale": 1,
        "reference": "hold",
        "duration": 1.0,
        "initial_error": (0.05, -0.05, 0.05),
        **changes,
    }
    return run_of(switching=switching, K=K, slope=30.0, experiment=experiment)


def test_gain_above_the_mismatch_covers_and_v_falls_equations_42_and_43():
    """With ``sign``, at every control instant, for every η up to the margin."""
    run = held_against(0.005, 0.02)
    margin = monitor(run).margin
    assert (margin > 0.005).all()
    seen = monitor(run, margin)
    assert seen.covered_fraction.tolist() == [1.0, 1.0, 1.0]
    assert seen.failing_fraction == 0.0
    assert seen.worst is None
    assert seen.first_failure is None
    beyond = monitor(run, margin + 1e-4)
    assert (beyond.covered_fraction < 1.0).all()
    assert (beyond.margin == margin).all()


def test_the_margin_itself_is_an_eta_that_holds_however_the_numbers_round():
    seen, random = monitor(held_against(0.005, 0.02)), np.random.default_rng(3)
    for _ in range(50):
        adverse = random.uniform(0.0, 0.01, 3) * np.sign(seen.surface)
        other = replace(seen, K=random.uniform(0.01, 0.05, 3), mismatch=adverse)
        pushed = other.mismatch - other.K * np.sign(other.surface)
        other = replace(other, eta=other.margin, rate=np.einsum("ki,ki->k", other.surface, pushed))
        assert other.all_covered_fraction == 1.0
        assert not other.fails.any()


def test_gain_below_the_mismatch_neither_covers_nor_makes_v_fall_equations_42_and_43():
    """K = 3 against 5 mN·m: where the torque pushes S away, V grows; V̇ = Σ (|Δ_i| − K_i) |S_i| there."""
    seen = monitor(held_against(0.005, 0.003, initial_error=(0.0, 0.0, 0.0)))
    assert seen.all_covered_fraction == 0.0
    assert (seen.margin < 0.0).all()
    assert seen.failing_fraction > 0.99
    assert seen.failing_fraction_outside == seen.failing_fraction
    start, end = seen.first_failure
    assert (start, end) == (seen.time[1], seen.time[-1])
    when, amount = seen.worst
    at = round(when / T)
    assert isclose(amount, seen.rate[at] - seen.allowed_rate[at])
    assert amount == pytest.approx(((np.abs(seen.mismatch[at]) - 0.003) * np.abs(seen.surface[at])).sum())
    assert amount == (seen.rate - seen.allowed_rate).max()


def test_one_axis_may_lack_the_gain():
    seen = monitor(held_against(0.005, (0.02, 0.003, 0.02)))
    assert seen.covered_fraction[0] == seen.covered_fraction[2] == 1.0
    assert seen.covered_fraction[1] < 0.1
    assert seen.all_covered_fraction == pytest.approx((seen.required_gain[:, 1] <= 0.003).mean())


def test_covered_instants_never_fail_with_sign_equation_43():
    """Eq. (42) at an instant implies (43) at it, whatever else: a wrong model, friction, a moving target."""
    for law in LAWS:
        seen = monitor(run_of(law, "sign", K=0.008, experiment={**ROUGH, "friction": 1e-3, "duration": 3.0}), 5e-4)
        covered = seen.covered.all(axis=1)
        assert 0.0 < covered.mean() < 1.0
        assert seen.fails.any()
        assert not (seen.fails & covered).any()


def test_sampled_sign_holds_equation_43_at_the_instants_but_not_between_them():
    """Held for a period, the torque overshoots S = 0: V grows over every other period."""
    seen = monitor(run_of(switching="sign"))
    assert seen.all_covered_fraction == 1.0
    assert seen.failing_fraction == 0.0
    assert 0.3 < seen.sampled_failing_fraction < 0.7


def test_first_failure_is_the_first_stretch_and_ends_where_v_falls_again():
    """A pulse above K, from 0.1 to 0.15 s: V̇ > 0 while it lasts, and the way home after it."""
    disturbance = {"name": "pulse", "amplitude": 0.04, "start": 0.1, "width": 0.05, "period": 0.25}
    experiment = {"disturbance": disturbance, "mass_scale": 1, "reference": "hold", "duration": 0.5}
    seen = monitor(run_of(switching="sign", K=0.03, experiment=experiment))
    assert seen.fails.any()
    times, stretch = list(seen.time), []
    for time_, failing in zip(times, seen.fails, strict=True):
        if failing:
            stretch.append(time_)
        elif stretch:
            break
    assert tuple(seen.first_failure) == (stretch[0], stretch[-1])
    assert seen.first_failure.start == pytest.approx(0.1, abs=2 * T)
    assert seen.first_failure.end == pytest.approx(0.149, abs=2 * T)
    assert seen.time[seen.fails][-1] > 0.3, "the second pulse is no part of it"


def test_outside_means_any_axis_outside_its_layer():
    run = held_against(0.005, 0.02, "saturation", initial_error=(0.0, 0.05, 0.0))
    seen, phi = monitor(run), np.array(run.experiment.law.phi)
    beyond = np.abs(run.surface) > phi
    assert beyond[:, 1].any()
    assert not beyond[:, [0, 2]].any()
    assert np.array_equal(seen.outside, beyond[:, 1])


@pytest.mark.parametrize("switching", ["tanh", "saturation"])
def test_within_the_boundary_layer_equation_43_fails_and_outside_it_does_not(switching):
    """K covers all the same: it is K sw(S/φ) that is smaller. At rest V̇ = 0, above −Σ η |S| for any η."""
    run = held_against(0.005, 0.02, switching, duration=2.0)
    seen = monitor(run, 1e-3)
    assert seen.all_covered_fraction == 1.0
    assert seen.fails[seen.time > 1.0].all()
    assert seen.failing_fraction_outside == 0.0
    assert seen.first_failure.start >= reaching(run).measured.min()
    assert seen.first_failure.end == seen.time[-1]
    assert seen.outside.any()


def test_a_motor_limit_that_cuts_the_torque_counts_as_mismatch():
    """No K covers what the motors do not deliver: V grows though K exceeds everything that the model misses."""
    disturbance = {"name": "pulse", "amplitude": 0.3, "start": 0.2, "width": 0.05, "period": 10.0}
    run = run_of(K=0.5, switching="sign", experiment={"disturbance": disturbance, "mass_scale": 1, "duration": 0.5})
    pushed = (run.time > 0.205) & (run.time < 0.25)
    seen = monitor(run)
    assert run.saturated[pushed].mean() > 0.9
    assert (np.abs(run.disturbance) < 0.5).all()
    assert seen.covered[pushed].all(axis=1).mean() < 0.1
    assert seen.fails[pushed].mean() > 0.9
    # H Ṡ from the record alone: the limits do not enter V̇ but through the torque delivered
    slope = np.diff(run.surface, axis=0)[pushed[:-1]] / T @ inertia_from_bodies(PERFECT).T
    switched = np.array(run.experiment.law.K) * np.sign(run.surface[:-1][pushed[:-1]])
    assert seen.mismatch[:-1][pushed[:-1]] == pytest.approx(slope + switched, abs=0.05)


# --- what is refused, and what is not


@pytest.mark.parametrize("law", ["pd", "computed_torque"])
@pytest.mark.parametrize("of", [monitor, reaching])
def test_a_law_without_a_surface_is_refused(law, of):
    with pytest.raises(WristError) as caught:
        of(simulate(Experiment(law=law, duration=0.1)))
    assert law in one_line(caught.value)
    assert "surface" in str(caught.value)


def test_a_law_without_a_switching_gain_is_refused():
    class Sheet(Law):
        has_surface = True

        @staticmethod
        def step(signal, parameters, state, command):
            for i in range(3):
                command.torque[i] = signal.N[i]
                command.slope[i] = 1.0
                command.surface[i] = signal.error[i] + signal.rate_error[i]

    with pytest.raises(WristError) as caught:
        monitor(simulate(Experiment(law=Sheet(), duration=0.1)))
    assert "K, phi, switching" in one_line(caught.value)


@pytest.mark.parametrize("options", [{"record_every": 10}, {"keep_series": False}])
def test_a_run_without_every_instant_is_refused(options):
    with pytest.raises(WristError) as caught:
        monitor(simulate(Experiment(duration=0.1), **options))
    assert "record_every=1" in one_line(caught.value)


@pytest.mark.parametrize("eta", [-1e-3, np.nan, np.inf, (1.0, 2.0), (1e-3, 1e-3, -1e-3)])
def test_a_wrong_eta_is_refused(eta):
    with pytest.raises(WristError) as caught:
        monitor(simulate(Experiment(duration=0.1)), eta)
    assert "eta" in one_line(caught.value)


@pytest.mark.parametrize("hardware", [{"sensing": {"rate_noise": 1e-3}}, {"actuation": {"lag": 1e-3}}])
def test_a_run_whose_true_surface_is_not_the_laws_is_refused(hardware):
    with pytest.raises(WristError) as caught:
        monitor(simulate(Experiment(duration=0.1, **hardware)))
    assert "ideal sensing and actuation" in one_line(caught.value)


@pytest.mark.parametrize("name", [name for name, law in Law.members.items() if issubclass(law, SlidingSurfaceLaw)])
def test_every_law_of_the_package_with_a_fixed_switching_gain_can_be_monitored(name):
    run = simulate(Experiment(law=name, duration=0.5))
    seen = monitor(run)
    assert seen.all_covered_fraction == 1.0
    assert np.isfinite(seen.rate).all()
    assert np.isfinite(reaching(run).measured).all()


def test_a_diverged_run_can_be_monitored():
    run = run_of(experiment={"disturbance": {"name": "constant", "amplitude": 5.0}, "duration": 0.5})
    assert run.outcome.status is Status.DIVERGED
    seen = monitor(run)
    assert np.isfinite(seen.rate).all()
    assert seen.fails[1:].all()


def test_a_recording_tells_the_same_as_its_run(tmp_path):
    run = simulate(Experiment(duration=0.2, friction=1e-3))
    record(run, tmp_path / "run.rrd")
    here, there = monitor(run, 1e-3), monitor(load_recording(tmp_path / "run.rrd"), 1e-3)
    for name in ("mismatch", "rate", "sampled_rate", "mean_rate", "required_gain"):
        assert np.array_equal(getattr(here, name), getattr(there, name)), name


def test_a_default_run_is_monitored_in_well_under_a_second():
    run = simulate(Experiment())
    began = time.perf_counter()
    monitor(run)
    assert time.perf_counter() - began < 1.0
