"""Margins: known systems, python-control's own example, and the nonlinear loop itself."""

import json
import sys

import numpy as np
import pytest
from control import disk_margins, ss

from rigs import one_line
from sampling import some
from spherical_wrist import Experiment, simulate
from spherical_wrist.cli import main
from spherical_wrist.control import PD
from spherical_wrist.errors import ParameterError, WristError
from spherical_wrist.picture_style import WIDTHS
from spherical_wrist.prepare.cache import RunCache
from spherical_wrist.prepare.pulse_responses import SettledLoop
from spherical_wrist.stability import margins
from spherical_wrist.stability.frequency_response import frequencies, frequency_response, loop_gain
from spherical_wrist.stability.loop_margins import crossings, disk_margin, loop_margins
from spherical_wrist.stability.picture import margins_picture
from spherical_wrist.stability.report import HEADLINE, to_dict
from spherical_wrist.stability.stable_range import DEVIATIONS, stable_up_to
from test_pulse_responses import HELD, LinearPD


@pytest.fixture(scope="module")
def cache():
    return RunCache()


# --- systems whose margins are known


@pytest.mark.parametrize("skew", [0.0, 1.0, -1.0])
def test_disk_margin_of_the_spinning_satellite_is_that_of_python_control(skew):
    """The example of ``control.disk_margins``: its own L, and S = (I + L)⁻¹ computed here."""
    plant = ss([[0.0, 10.0], [-10.0, 0.0]], np.eye(2), [[1.0, 10.0], [-10.0, 1.0]], np.zeros((2, 2)))
    gains = np.array([[1.0, -2.0], [0.0, 1.0]])
    omega = np.logspace(-1, 3, 1001)
    expected, _, _ = disk_margins(plant * ss([], [], [], gains), omega, skew=skew)
    a, c = np.array([[0.0, 10.0], [-10.0, 0.0]]), np.array([[1.0, 10.0], [-10.0, 1.0]])
    loops = [np.linalg.inv(1j * w * np.eye(2) - a + gains @ c) for w in omega]
    found = disk_margin(np.array([np.eye(2) - c @ loop @ gains for loop in loops]), skew)
    assert found == pytest.approx(expected, rel=1e-3)


def test_crossings_of_an_integrator_with_delay_are_those_of_theory():
    """L = a exp(−j ω τ) / (j ω): gain margin π / (2 a τ), phase margin 90° − a τ, delay margin π / (2 a) − τ."""
    a, tau = 20.0, 0.02
    frequency = np.geomspace(0.1, 50.0, 400)
    omega = 2.0 * np.pi * frequency
    found = crossings(a * np.exp(-1j * omega * tau) / (1j * omega), np.array([1.0 + 0j, -0.125 + 0j]), frequency)
    assert 8.0 in found.gains  # at the end, where the gain is real
    assert min(found.gains, key=lambda gain: abs(np.log(gain))) == pytest.approx(np.pi / (2.0 * a * tau), rel=1e-4)
    assert found.phases == [pytest.approx(90.0 - np.rad2deg(a * tau), rel=1e-4)]
    assert found.delays == [pytest.approx(np.pi / (2.0 * a) - tau, rel=1e-4)]


@pytest.mark.parametrize("delay", [0, 4])
def test_the_loop_is_unstable_just_beyond_its_gain_margin_and_not_before(nominal, delay):
    """PD of the linearised wrist, its gain multiplied: the response to a pulse decays or grows."""
    linear = LinearPD(nominal, delay)
    pulse = np.stack([linear.run(2000, command=unit)[0] for unit in np.eye(3)], axis=2)
    pulse[0] += np.eye(3)
    found = loop_margins(pulse, 1e-3, frequencies(1e-3))
    assert found.gain_reduction_margin_db is None or found.gain_reduction_margin_db > 20.0
    own = linear.gains.copy()
    for step, grows in ((0.98, False), (1.02, True)):
        linear.gains = own * step * 10.0 ** (found.gain_margin_db / 20.0)
        tip = np.abs(linear.run(3000, torque=np.ones(3))[1]).max(axis=1)
        assert (tip[2000:].max() > tip[1000:2000].max()) == grows
    linear.gains = own
    linear.delay = delay + int(found.delay_margin_s / 1e-3) + 1
    tip = np.abs(linear.run(3000, torque=np.ones(3))[1]).max(axis=1)
    assert tip[2000:].max() > tip[1000:2000].max()
    linear.delay -= 1
    tip = np.abs(linear.run(3000, torque=np.ones(3))[1]).max(axis=1)
    assert tip[2000:].max() < tip[1000:2000].max()


# --- the nonlinear loop


@pytest.mark.parametrize("law", some(["fuzzy_integral_sliding", "slotine_li"], 2))
def test_a_sine_in_the_nonlinear_loop_follows_the_sensitivity(cache, law):
    """Torque on the joint and command together, in amplitude and phase, within 2 % from 1 to 200 Hz."""
    base = Experiment(law=law, reference=HELD["reference"], duration=4.0)
    pulse = SettledLoop(base, cache).torque_responses().command.copy()
    pulse[0] += np.eye(3)
    for frequency in (1.0, 4.0, 12.0, 20.0, 50.0, 120.0, 200.0):
        sine = {"name": "sinusoid", "frequency": frequency, "amplitude": 1e-3}
        run = simulate(base.replaced(disturbance=sine))
        rows = slice(2000, 4000)  # whole periods, after the transients
        carrier = np.exp(-2j * np.pi * frequency * run.time[rows]) / 1000.0
        added, total = (
            (each[rows] * carrier[:, None]).sum(axis=0) for each in (run.disturbance, run.disturbance + run.torque)
        )
        expected = frequency_response(pulse, 1e-3, np.array([frequency]))[0] @ added
        assert np.linalg.norm(total - expected) < 0.02 * np.linalg.norm(expected)


def test_margins_agree_with_the_masses_and_delays_at_which_the_loop_becomes_unstable(cache):
    """More mass is less gain, of all axes alike; a delay that nobody knows is a delay in the loop."""
    experiment = Experiment(law="slotine_li")
    pulse = SettledLoop(experiment, cache).torque_responses().command.copy()
    pulse[0] += np.eye(3)
    found = loop_margins(pulse, 1e-3, frequencies(1e-3))
    by_name = {each.name: each for each in DEVIATIONS}
    delay, heavy = (
        stable_up_to(by_name[name], experiment, cache, 0.0, lambda: False)
        for name in ("largest_unknown_delay_s", "largest_mass_scale")
    )
    assert delay == pytest.approx(found.delay_margin_s, rel=0.05)
    assert heavy == pytest.approx(1.25 * 10.0 ** (found.gain_reduction_margin_db / 20.0), rel=0.05)


# --- the command and the API


@pytest.fixture(scope="module")
def table():
    laws = {"pd": PD(), "far": PD(P=500.0, D=0.0)}
    return to_dict(margins(laws, {}, {"duration": 1.0}, ranges=False), 0.0, 0.0)


def test_a_law_has_all_its_margins_and_one_without_a_linear_loop_says_why(table):
    stable, other = table["laws"]
    assert stable["stable"]
    assert not other["stable"]
    assert "does not settle" in other["reason"]
    assert {*HEADLINE, "bandwidth_hz", "worst_tip_error_mm"} <= set(stable) == set(other)
    assert all(other[name] is None for name in (*HEADLINE, "bandwidth_hz", "worst_tip_error_mm", "cuts"))
    assert set(stable["cuts"]) == {"plant_input", "attitude_sensor", "rate_sensor"}
    assert stable["max_sensitivity"] == stable["cuts"]["plant_input"]["max_sensitivity"] >= 1.0
    worst = stable["worst"]["gain_mm_per_Nm"] * table["disturbance"]["size_Nm"]
    assert stable["worst_tip_error_mm"] == pytest.approx(worst, rel=1e-12)
    response = stable["response"]
    assert max(response["sensitivity"]) == pytest.approx(stable["max_sensitivity"], rel=1e-3)
    for cut in stable["cuts"].values():
        for axis in cut["axes"]:  # no axis alone is nearer to instability than all that is looked at
            assert axis["max_sensitivity"] <= cut["max_sensitivity"] + 1e-9
            assert axis["disk_margin"] >= cut["disk_margin"] - 1e-9
            assert all(cut[name] <= axis[name] + 1e-9 for name in HEADLINE[1:5] if axis[name] is not None)
    json.dumps(table, allow_nan=False)


def test_disk_margins_allow_at_least_the_gain_and_phase_that_theory_says(table):
    """A disk margin α allows gains up to (2 + α) / (2 − α), and phases up to 2 atan(α / 2), of every axis."""
    for cut in table["laws"][0]["cuts"].values():
        alpha = cut["disk_margin"]
        if alpha < 2.0 and cut["gain_margin_db"] is not None:
            assert cut["gain_margin_db"] > 20.0 * np.log10((2.0 + alpha) / (2.0 - alpha)) - 0.01
        if cut["phase_margin_deg"] is not None:
            assert cut["phase_margin_deg"] > np.rad2deg(2.0 * np.arctan(alpha / 2.0)) - 0.1
        assert alpha <= 1.0 / max(0.5, cut["max_sensitivity"] - 0.5) + 1e-9 or cut["max_sensitivity"] < 1.5


def test_a_single_sensor_has_no_rate_to_cut():
    estimated = {"sensing": {"rate": "estimated"}}
    [found] = margins({"pd": PD()}, estimated, {}, ranges=False)
    assert set(found.linear.margins) == {"plant_input", "attitude_sensor"}


def test_the_command_prints_a_table_and_writes_what_it_says(tmp_path, capsys):
    folder = tmp_path / "out"
    options = ["--law", "pd", "--law", "pd P=500 D=0", "--duration", "0.5", "--no-ranges"]
    sys.argv = ["wrist", "margins", *options, "-o", str(folder)]
    with pytest.raises(SystemExit) as ended:
        main()
    assert not ended.value.code
    printed = capsys.readouterr().out
    assert "worst tip" in printed
    assert "pd P=500 D=0: no margins" in printed
    assert {path.name for path in folder.iterdir()} == {
        f"margins.{end}" for end in ("json", "md", "pdf", "png", "svg", "tex")
    }
    kept = json.loads((folder / "margins.json").read_text(encoding="utf-8"))
    assert [law["law"] for law in kept["laws"]] == ["pd", "pd P=500 D=0"]


def test_the_picture_has_a_line_for_every_law_with_a_linear_loop(table):
    for width in WIDTHS.values():
        sensitivity, tip, worst, *_ = margins_picture(table, width).axes
        assert len(tip.lines) == 1
        assert len(sensitivity.lines) == 2  # and the line at Ms = 2
        assert [label.get_text() for label in worst.get_yticklabels()] == ["pd"]
        [stem, mark] = worst.lines
        end = 1e3 * table["laws"][0]["worst_tip_error_mm"]
        assert mark.get_xdata()[0] == stem.get_xdata()[-1] == pytest.approx(end)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"reference": {"name": "hold", "rotation": (0.0, 0.0, 0.0)}}, "disturbance.amplitude"),
        ({"control_period": 0.0007}, "multiple"),
        ({"sensing": {"dely": 1.0}}, "delay"),
    ],
)
def test_a_wrong_experiment_is_one_line(changes, said):
    with pytest.raises(WristError) as error:
        margins({"pd": PD()}, changes, {}, ranges=False)
    assert said in one_line(error.value)
    with pytest.raises(WristError, match="at = nan s"):
        margins({"pd": PD()}, at=float("nan"))


def test_the_libraries_that_are_needed_are_named_where_they_are_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "control", None)
    monkeypatch.delitem(sys.modules, "spherical_wrist.stability.loop_margins")
    with pytest.raises(ParameterError, match=r"pip install 'spherical-wrist\[margins\]'"):
        __import__("spherical_wrist.stability.loop_margins")


def test_a_frequency_response_is_the_sum_that_defines_it():
    random = np.random.default_rng(3)
    pulse, frequency = random.normal(size=(157, 3, 3)), np.array([0.0, 0.3, 77.7, 500.0])
    expected = [sum(h * np.exp(-2j * np.pi * f * 1e-3 * k) for k, h in enumerate(pulse)) for f in frequency]
    np.testing.assert_allclose(frequency_response(pulse, 1e-3, frequency), expected, atol=1e-11)


def test_the_loop_gain_is_that_of_the_sensitivity():
    random = np.random.default_rng(2)
    gain = random.normal(size=(5, 3, 3)) + 1j * random.normal(size=(5, 3, 3))
    np.testing.assert_allclose(loop_gain(np.linalg.inv(np.eye(3) + gain)), gain, atol=1e-10)


def test_a_narrow_peak_is_not_lost_between_the_frequencies():
    """An oscillator at 7.1 Hz, damped by ζ = 0.05: its largest gain is 1 / (2 ζ √(1 − ζ²)), plus 1 for the sum."""
    k, (zeta, omega) = np.arange(4_000) * 1e-3, (0.05, 2.0 * np.pi * 7.1)
    damped = omega * np.sqrt(1.0 - zeta**2)
    pulse = omega**2 / damped * np.exp(-zeta * omega * k) * np.sin(damped * k) * 1e-3
    responses = np.zeros((len(k), 3, 3))
    responses[:, 0, 0] = responses[:, 1, 1] = responses[:, 2, 2] = pulse
    responses[0] += np.eye(3)
    found = loop_margins(responses, 1e-3, frequencies(1e-3))
    assert found.max_complementary == pytest.approx(0.5 / zeta, rel=2e-3)
