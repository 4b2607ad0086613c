"""Our own law: rewritten from its equations, against closed forms of what it leaves, and what it promises."""

import numpy as np
import pytest

from sampling import some
from spherical_wrist import Experiment, simulate
from spherical_wrist.actuation import Realistic as RealisticMotor
from spherical_wrist.control import FuzzyIntegralSliding, Law, ModelBasedLaw
from spherical_wrist.control.contract import COMMAND, SIGNAL
from spherical_wrist.control.kalman_observer import KalmanLaw
from spherical_wrist.control.mismatch_observer import Mismatch, foresee, observe, start
from spherical_wrist.control.past_commands import remember, samples_since
from spherical_wrist.experiment.description import with_changes
from spherical_wrist.experiment.presets import HARDWARE
from spherical_wrist.loop.engine import interpreted_step
from spherical_wrist.loop.outcome import Status
from spherical_wrist.prepare.cache import RunCache
from spherical_wrist.prepare.needed_torque import needed_variation
from spherical_wrist.sensing import Realistic as RealisticSensing

T = 1e-3


# --- the observer


def memory_of(surface=0.0, mismatch=0.0, growth=0.0, past=0.0):
    """A state of the observer with all that it knows on the first axis."""

    class Observing(Law):
        State = Mismatch

    memory = Observing().packed_state().view(Observing.state_layout()).view(np.recarray)[0]
    memory.surface[0], memory.mismatch[0], memory.growth[0], memory.past[0] = surface, mismatch, growth, past
    return memory


def follow(delta, asked, *, late=0.0, bandwidth=310.0, limit=1e9, known=None):
    """Runs the observer on the exact surface of Ṡ = δ + g − w, w acting ``late`` periods late; returns δ̂ over time."""
    memory = memory_of()
    fine = 100
    n = len(delta)
    g = np.zeros(n) if known is None else known
    surface, past, found = 0.0, [0.0] * 40, []
    for k in range(n):
        periods = samples_since(late, late) if k else 0
        if k:
            observe(memory, 0, surface, g[k - 1], periods, late, T, bandwidth, limit)
        else:
            start(memory, 0, surface)
        found.append(memory.mismatch[0])
        remember(memory, 0, asked[k])
        past.insert(0, asked[k])
        for step in range(fine):  # the plant over one period on the sample's own time, w late
            back = late - (step + 0.5) / fine
            acting = past[int(np.floor(back)) + 1]
            surface += T / fine * (delta[k] + g[k] - acting)
    return np.array(found)


@pytest.mark.parametrize("late", [0.0, 1.0, 2.5])
def test_a_ramp_of_mismatch_is_found_exactly_however_late_the_samples_are(late):
    """With w asked for at random: what it did to the surface is known, and not taken for a mismatch."""
    time = np.arange(200) * T
    delta = 5.0 + 100.0 * (time + 0.5 * T)
    asked = np.random.default_rng(0).normal(0.0, 20.0, 200)
    found = follow(delta, asked, late=late)
    np.testing.assert_allclose(found[150:], 5.0 + 100.0 * time[150:], atol=0.15 if late % 1 else 1e-6)


def test_the_observers_error_has_a_triple_pole():
    """Its transition with the correction in, as a matrix built column by column: all eigenvalues exp(−ω T)."""
    columns = []
    for unit in np.eye(3):
        memory = memory_of(*unit)
        observe(memory, 0, 0.0, 0.0, 1, 0.0, T, 310.0, 1e9)
        columns.append([memory.surface[0], memory.mismatch[0], memory.growth[0]])
    poles = np.linalg.eigvals(np.array(columns).T)
    np.testing.assert_allclose(poles, np.exp(-0.310), atol=2e-5)  # a triple root moves by the cube root of the rounding


def test_a_slow_mismatch_is_found_but_for_its_second_derivative():
    """δ − δ̂ = 3 δ̈ / ω² for δ = sin Ω t, Ω ≪ ω."""
    time = np.arange(3000) * T
    omega = 2.0 * np.pi
    found = follow(np.sin(omega * (time + 0.5 * T)), np.zeros(3000))
    left = np.sin(omega * time)[1000:] - found[1000:]
    assert np.abs(left).max() == pytest.approx(3.0 * omega**2 / 310.0**2, rel=0.2)


def test_the_estimate_stays_within_its_limit():
    found = follow(np.full(500, 100.0), np.zeros(500), limit=30.0)
    assert np.abs(found).max() == 30.0


def test_a_lost_sample_is_waited_for():
    assert [samples_since(1.5, late) for late in (1.5, 2.5)] == [1, 0]
    assert samples_since(3.5, 1.5) == 3
    memory = memory_of(1.0, 2.0, 3.0, np.arange(16.0))
    before = memory.copy()
    observe(memory, 0, 9.0, 1.0, 0, 2.5, T, 300.0, 100.0)
    assert memory.tobytes() == before.tobytes()


@pytest.mark.parametrize("late", [0.0, 0.4, 1.0, 2.7])
def test_what_is_foreseen_is_what_a_double_integrator_does(late):
    memory = memory_of(0.0, 7.0, 300.0, np.random.default_rng(1).normal(0.0, 30.0, 16))
    turned, gained, mismatch = foresee(memory, 0, 0.2, late, T)
    steps = 20000
    times = (np.arange(steps) + 0.5) / steps * late
    back = late - times  # before now, in periods
    acceleration = 7.0 + 300.0 * times * T - memory.past[0, np.floor(back).astype(int)]
    width = late * T / steps
    rates = 0.2 + np.concatenate([[0.0], np.cumsum(acceleration * width)])
    assert gained == pytest.approx(acceleration.sum() * width, abs=1e-5)
    assert turned == pytest.approx(rates[:-1].sum() * width, abs=1e-7)
    assert mismatch == pytest.approx(7.0 + 300.0 * (late + 0.5) * T)


# --- the law


def rewritten(law, signals):
    """The law in vectors, for samples in time: torque and surface."""
    axes = 3
    z, s, d, dd = (np.zeros(axes) for _ in range(4))
    before = None
    p = np.exp(-law.bandwidth * T)
    rules = np.array(law.rules)
    out = []
    for signal in signals:
        e, de = signal["error"], signal["rate_error"]
        size = np.sign(e) * np.log1p(np.abs(e) / law.error_floor) / np.log1p(law.error_scale / law.error_floor)
        rows = np.maximum(0.0, 1.0 - np.abs(np.clip(size, -1, 1)[:, None] * 3.0 - np.arange(-3, 4)))
        columns = np.maximum(
            0.0, 1.0 - np.abs(np.clip(de / np.array(law.rate_scale), -1, 1)[:, None] - np.arange(-1, 2))
        )
        slope = law.slope * np.einsum("ai,ij,aj->a", rows, rules, columns)
        zero = rows[:, 3]
        surface = slope * e + de + law.integral * z
        g = slope * de + law.integral * zero * e
        if before is None:
            s = surface.copy()
        else:
            s, d = s + T * (d + 0.5 * T * dd + g - before), d + T * dd
            r = surface - s
            s = s + (1 - p**3) * r
            d = d + 1.5 * (1 - p**2) * (1 - p) / T * r
            dd = dd + (1 - p) ** 3 / T**2 * r
            most = 2.0 * signal["torque_limit"] / np.diag(signal["H"])
            most = np.full(axes, law.mismatch_limit) if law.mismatch_limit else most
            held = np.abs(d) > most
            d, dd = np.clip(d, -most, most), np.where(held, 0.0, dd)
            share = 0.0015 * signal["torque_limit"] / np.diag(signal["H"]) / law.reaching
            limit = (law.integral_limit or share) / law.integral
        reaching = (1 - np.exp(-law.reaching * T)) / T
        before = g + reaching * np.array(law.phi) * np.tanh(s / np.array(law.phi)) + d + 0.5 * T * dd
        if out:
            z = np.clip(z + T * zero * e, -limit, limit)
        out.append((signal["N"] + signal["H"] @ (signal["feed_forward"] + before), surface))
    return map(np.array, zip(*out, strict=True))


@pytest.mark.parametrize("size", [1e-4, 1e-2, 0.5])
def test_the_law_is_its_equations(size):
    random = np.random.default_rng(2)
    signals = np.zeros(60, SIGNAL)
    signals["period"], signals["horizon"] = T, 0.5 * T
    smooth = np.cumsum(random.normal(size=(60, 3)), axis=0) / 5.0
    signals["error"], signals["rate_error"] = size * smooth, 10.0 * size * random.normal(size=(60, 3))
    signals["feed_forward"], signals["N"] = random.normal(size=(60, 3)), 0.01 * random.normal(size=(60, 3))
    signals["torque_limit"] = (0.01, 0.2, 0.3)
    signals["H"] = 1e-4 * np.array([[4.0, 0.3, 0.1], [0.3, 3.8, 0.2], [0.1, 0.2, 1.5]])
    uneven = random.uniform(0.5, 5.0, (7, 3)).tolist()
    for law in (
        FuzzyIntegralSliding(),
        FuzzyIntegralSliding(rules=uneven, phi=(0.1, 0.5, 2.0), mismatch_limit=20.0, integral_limit=0.003),
    ):
        state = law.packed_state()
        commands = np.full(60 * COMMAND.itemsize // 8, np.nan).view(COMMAND)
        step, packed = interpreted_step(law), law.packed()
        for signal, command in zip(signals.view(np.recarray), commands.view(np.recarray), strict=True):
            step(signal, packed, state, command)
        torque, surface = rewritten(law, signals)
        np.testing.assert_allclose(commands["torque"], torque, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(commands["surface"], surface, rtol=1e-9, atol=1e-12)


SIX = [(shape, mass) for shape in ("constant", "sinusoid") for mass in (0.75, 1.0, 1.25)]


@pytest.mark.parametrize(("shape", "mass"), SIX)
def test_six_ideal_cases_with_one_set_of_gains(shape, mass):
    """25 % of torque, constant or at 1 Hz: 1e-5 rad RMS and 4e-5 rad at most, without more chattering."""
    case = {"disturbance": {"name": shape, "level": 0.25}, "mass_scale": mass}
    ours = simulate(Experiment(law="fuzzy_integral_sliding", **case)).metrics
    plain = simulate(Experiment(law="computed_torque", **case)).metrics
    assert ours.rms_error_rad <= 1e-5
    assert ours.max_error_rad <= 4e-5
    assert ours.chattering_Nm_per_s <= 1.1 * plain.chattering_Nm_per_s


_sensors, _motors = RealisticSensing(), RealisticMotor()
FAULTS = {
    "attitude noise": {"sensing.attitude_noise": _sensors.attitude_noise},
    "attitude steps": {"sensing.attitude_quantum": _sensors.attitude_quantum},
    "rate noise": {"sensing.rate_noise": _sensors.rate_noise, "sensing.rate_bias": _sensors.rate_bias},
    "no gyroscope": {"sensing.rate": "estimated"},
    "1 ms": {"sensing.delay": 1e-3},
    "1.5 ms": {"sensing.delay": 1.5e-3},
    "lost samples": {"sensing.loss": 0.05},
    "slow motors": {"actuation.torque_quantum": _motors.torque_quantum, "actuation.lag": _motors.lag},
    "friction": {"friction": HARDWARE["realistic"]["friction"]},
    "cogging": {"actuation.cogging": _motors.cogging},
    "coils": {"actuation": "spherical_motor"},
    "failed coil": {"actuation": {"name": "spherical_motor", "failed": [0]}},
    "realistic": HARDWARE["realistic"],
    "on a heart": {**HARDWARE["realistic"], "reference": "beating_heart"},
    "on a suture": {**HARDWARE["realistic"], "reference": "suture"},
}
"""Faults of the hardware, each alone, and all of them, on three motions."""
OTHERS = [name for name, law in Law.members.items() if issubclass(law, ModelBasedLaw) and law.status != "ours"]
FILTERED = [name for name in OTHERS if issubclass(Law.members[name], KalmanLaw)]
RIVALS = [name for name in OTHERS if name not in FILTERED]


@pytest.mark.parametrize("fault", some(sorted(FAULTS), 3))
def test_with_hardware_that_is_not_ideal_no_rival_without_a_filter_is_better_by_more_than_a_fifth(fault):
    def error(law):
        run = simulate(Experiment(**with_changes({"law": law, "duration": 4.0}, FAULTS[fault])), keep_series=False)
        return run.metrics.rms_error_rad if run.outcome.status is Status.COMPLETED else np.inf

    assert error("fuzzy_integral_sliding") < 1.2 * min(map(error, RIVALS))


def test_attitude_and_rate_fused_by_a_kalman_filter_do_better_where_there_is_noise():
    """With realistic sensors the filtered rivals leave less than this law, at a fraction of the chattering."""
    found = {}
    for law in ("fuzzy_integral_sliding", *FILTERED):
        found[law] = simulate(Experiment(law=law, **HARDWARE["realistic"]), keep_series=False).metrics
    ours = found.pop("fuzzy_integral_sliding")
    assert all(metrics.rms_tip_error_mm < ours.rms_tip_error_mm for metrics in found.values())
    assert all(metrics.chattering_Nm_per_s < 0.3 * ours.chattering_Nm_per_s for metrics in found.values())


def test_a_sinusoidal_torque_leaves_what_the_derivation_says():
    """|e| = (3/κ + 1/ω) Ω² |d/H| / (ω² √(λ² + Ω²)) at rest, with gains far below the sampling rate."""
    law = FuzzyIntegralSliding(integral=1e-3, reaching=80.0, bandwidth=100.0)
    wave = {"name": "sinusoid", "frequency": 0.5, "amplitude": 0.004}
    run = simulate(Experiment(law=law, reference="hold", disturbance=wave, mass_scale=1, duration=6.0))
    omega, inertia = np.pi, 1.447e-4  # about z, in which gravity has no part
    left = 3.0 / law.reaching + 1.0 / law.bandwidth
    expected = left * omega**2 * 0.004 / inertia / (law.bandwidth**2 * np.hypot(law.slope, omega))
    assert np.abs(run.error[2000:, 2]).max() == pytest.approx(expected, rel=0.1)


def test_the_integral_takes_out_the_error_of_the_rate_sensor():
    """Without it e = b / λ stays."""
    sensing = {"name": "ideal", "rate_bias": 2e-3}
    still = {"reference": "hold", "disturbance": 0, "mass_scale": 1, "sensing": sensing, "duration": 8.0}
    without = simulate(Experiment(law={"name": "fuzzy_integral_sliding", "integral": 1e-6}, **still)).error[-1]
    np.testing.assert_allclose(np.abs(without), 2e-3 / FuzzyIntegralSliding().slope, rtol=0.1)
    assert np.abs(simulate(Experiment(law="fuzzy_integral_sliding", **still)).error[-1]).max() < 2e-6


def settled(law):
    """Return the time at which the error has come from 0.41 rad to below 10 mrad for good [s]."""
    run = simulate(Experiment(law=law, initial_error=(0.3, -0.2, 0.2), duration=2.0))
    return run.time[np.flatnonzero(np.linalg.norm(run.error, axis=1) > 1e-2)[-1]]


def test_the_rules_halve_the_time_of_a_return():
    flat = FuzzyIntegralSliding(rules=((1.0, 1.0, 1.0),) * 7)
    assert settled(FuzzyIntegralSliding()) < 0.6 * settled(flat)


@pytest.mark.parametrize("mass", [0.5, 1.0, 1.5])
def test_it_neither_diverges_nor_chatters_with_late_samples_and_slow_motors(mass):
    late = {"sensing": {"delay": 1.5e-3}, "actuation": {"lag": 1e-3}, "mass_scale": mass}
    ours = simulate(Experiment(law="fuzzy_integral_sliding", **late))
    assert ours.outcome.status is Status.COMPLETED
    assert ours.metrics.rms_error_rad < 1e-5
    assert ours.metrics.chattering_Nm_per_s < 1.1 * needed_variation(ours.experiment, RunCache())


@pytest.mark.parametrize("mass", [0.6, 1.4])
def test_it_does_not_chatter_with_a_delay_that_nobody_knows(mass):
    late = {"sensing": {"delay": 1e-3 * min(mass, 1.0), "timestamped": False}, "mass_scale": mass}
    ours = simulate(Experiment(law="fuzzy_integral_sliding", **late))
    assert ours.metrics.chattering_Nm_per_s < 1.1 * needed_variation(ours.experiment, RunCache())


def test_realistic_hardware_leaves_less_than_a_tenth_of_what_coronaries_need():
    run = simulate(Experiment(law="fuzzy_integral_sliding", **HARDWARE["realistic"]))
    assert run.metrics.rms_tip_error_mm < 0.01


def test_it_is_a_law_of_the_package():
    assert issubclass(FuzzyIntegralSliding, ModelBasedLaw)
    assert FuzzyIntegralSliding().boundary_layer == FuzzyIntegralSliding().phi
