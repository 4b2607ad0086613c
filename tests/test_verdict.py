"""Verdict on a run: its words, its bound, and the summaries that begin with it."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spherical_wrist import Experiment, load_recording, record, simulate
from spherical_wrist.assertions import WristGrid, assert_tracks
from spherical_wrist.inspection.consistency import inspect
from spherical_wrist.loop.outcome import Outcome, Status
from spherical_wrist.measure.bound import ATTITUDE_BOUND, BOUND, SOURCE
from spherical_wrist.measure.metrics import METRICS, MetricSettings
from spherical_wrist.recording.layout import TIP_PLOT
from spherical_wrist.recording.metrics_text import bound_of, metrics_text
from spherical_wrist.recording.plots import PEAKS, ranges
from spherical_wrist.recording.runs import properties_of
from spherical_wrist.simulation.verdict import Judgement, verdict
from spherical_wrist.wrist import Wrist

OLD = sorted((Path(__file__).parent / "recordings").glob("format*/*.rrd"))
COMPLETED = Outcome(Status.COMPLETED, 10.0)
FIGURES = {
    "rms_tip_error_mm": 0.02680, "max_tip_error_mm": 0.03985, "max_tip_error_at_s": 3.21, "settling_time_s": 0.0,
    "motor_use_fraction": 0.1149, "saturated_fraction": 0.0, "max_error_rad": 1e-3,
}  # fmt: skip

SAID = "0.027 mm RMS, 0.040 mm largest, motors at 11 %"


def judged(outcome=COMPLETED, bound=BOUND, warnings=(), **changes):
    metrics = dict.fromkeys(METRICS) | FIGURES | changes
    return verdict(outcome, metrics, MetricSettings(2.0, 0.001, (0.0, 0.0, -0.1), None, bound=bound), warnings)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({}, f"within 0.1 mm: {SAID}"),
        ({"settling_time_s": 0.3124}, f"within 0.1 mm from 0.312 s on: {SAID}"),
        (
            {"saturated_fraction": 0.032, "motor_use_fraction": 1.0},
            "within 0.1 mm: 0.027 mm RMS, 0.040 mm largest, motors at their limits 3.2 % of the time",
        ),
        (
            {"max_tip_error_mm": 0.54, "settling_time_s": None},
            "exceeds 0.1 mm: 0.027 mm RMS, 0.54 mm largest at 3.21 s, motors at 11 %",
        ),
        ({"max_error_rad": 1.8}, f"within 0.1 mm but turned by up to 1.8 rad: {SAID}"),
        ({"warnings": ("a",)}, f"within 0.1 mm, with 1 warning: {SAID}"),
        (
            {"warnings": ("a", "b"), "max_tip_error_mm": 32.3},
            "exceeds 0.1 mm: 0.027 mm RMS, 32 mm largest at 3.21 s, motors at 11 % (2 warnings)",
        ),
        ({"motor_use_fraction": None}, "within 0.1 mm: 0.027 mm RMS, 0.040 mm largest"),
        ({"bound": 0.03}, "exceeds 0.03 mm: 0.027 mm RMS, 0.040 mm largest at 3.21 s, motors at 11 %"),
        (
            {"outcome": Outcome(Status.DIVERGED, 0.412, "the wrist turns at 1234 rad/s")},
            "diverged at 0.412 s: the wrist turns at 1234 rad/s",
        ),
        (
            {"outcome": Outcome(Status.INTERRUPTED, 4.1, "stopped on request")},
            f"interrupted at 4.1 s: stopped on request; until then within 0.1 mm: {SAID}",
        ),
        (
            {"rms_tip_error_mm": None, "max_tip_error_mm": None},
            "not judged: no sample is in the steady window, t ≥ 2 s",
        ),
    ],
)  # fmt: skip
def test_its_words(changes, text):
    assert judged(**changes).text == text


@given(st.floats(1e-9, 1e6), st.floats(1e-9, 1e6), st.floats(0.999, 1.001))
def test_a_figure_is_written_on_the_side_of_the_bound_where_it_is(bound, error, near):
    for largest in (error, bound * near):
        found = judged(bound=bound, rms_tip_error_mm=largest, max_tip_error_mm=largest)
        assert found.within == (largest <= bound)
        written = found.text.partition(" mm largest")[0].rpartition(" ")[2]
        assert float(written) == pytest.approx(largest, rel=0.051)
        assert (float(written) <= bound) == found.within


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_an_error_that_is_no_number_is_not_within(value):
    assert judged(max_tip_error_mm=value).judgement is Judgement.EXCEEDS
    assert "turned" in judged(max_error_rad=value).text


def test_a_bound_is_kept_by_the_run_and_moves_nothing_else():
    usual, own = (simulate(Experiment(duration=0.3, **given)) for given in ({}, {"bound": 1e-4}))
    assert (usual.verdict.within, own.verdict.within) == (True, False)
    assert usual.measurement.bound == BOUND
    assert own.verdict.text.startswith("exceeds 0.0001 mm: ")
    assert {name: usual.metrics[name] for name in METRICS if name != "settling_time_s"} == {
        name: own.metrics[name] for name in METRICS if name != "settling_time_s"
    }
    assert all(usual.channels[name].tobytes() == own.channels[name].tobytes() for name in usual.channels)


def test_every_summary_of_a_run_has_the_verdict(wrist):
    code, out, err = wrist("run", "--duration", "0.3", "--bound", "0.01", "--disturbance", "8")
    run = load_recording("wrist.rrd")
    said = run.verdict.text
    assert (code, run.measurement.bound, run.description["bound"]) == (0, 0.01, 0.01)
    assert said.startswith("exceeds 0.01 mm: ")
    for command in (["inspect", "wrist.rrd"], ["replay", "wrist.rrd"], ["diff", "wrist.rrd", "wrist.rrd"]):
        code, text, err = wrist(*command)
        assert code == 0
        assert " ".join(said.split()) in " ".join(text.split())
        assert err.count("wrist: warning: ") == len(run.warnings) * (1 + (command[0] == "diff"))
    assert " ".join(out.split()).startswith(" ".join(said.split()))
    for command in (["inspect", "wrist.rrd", "--json"], ["replay", "wrist.rrd", "--json"]):
        told = json.loads(wrist(*command)[1])
        assert (told["verdict"], told["bound_mm"], told["within_bound"]) == (said, 0.01, False)
    text = metrics_text(properties_of(run), len(run), 1)
    assert text.startswith("#### exceeds 0.01 mm: ")
    assert wrist("inspect", "wrist.rrd", "--plot", "a.svg")[0] == 0
    assert "exceeds 0.01 mm" in Path("a.svg").read_text()


def test_what_the_bound_is_stands_below_the_figures(wrist):
    out = wrist("run", "--duration", "0.05", "--no-recording")[1]
    assert f"{BOUND:g} mm: {SOURCE}" in " ".join(out.split())
    out = wrist("run", "--duration", "0.05", "--no-recording", "--bound", "0.2")[1]
    assert "0.2 mm: the bound of this run" in " ".join(out.split())


@pytest.mark.parametrize("bound", ["0", "-1", "nan", "inf", "x"])
def test_no_bound_at_all_is_refused(wrist, bound):
    code, _, err = wrist("run", "--duration", "0.05", "--no-recording", "--bound", bound)
    assert (code, err.count("\n")) == (2, 1)
    assert "bound" in err


@pytest.mark.parametrize("path", OLD, ids=lambda path: path.stem)
def test_recordings_of_older_formats_are_judged_too(path):
    found = inspect(path)
    error = 1e3 * np.linalg.norm(found.run.tip - found.run.desired_tip, axis=1)
    window = error[found.run.measurement.in_window(found.run.time)]
    bound = found.run.measurement.bound
    assert bound == found.run.description["bound"]
    assert bound == BOUND or path.parent.name not in ("format1", "format2")  # which have no bound of their own
    assert found.verdict.within == (not found.run.outcome.status.lost and window.max() <= bound)
    if found.verdict.judgement is Judgement.EXCEEDS and found.run.every == 1:
        at = found.run.time[found.run.measurement.in_window(found.run.time)][window.argmax()]
        assert f"largest at {at:.4g} s" in found.verdict.text


def test_the_shares_of_the_motors_limits_are_those_of_their_controls():
    """Also of motors across the axes, with limits that differ by direction."""
    base = Wrist.load()
    turned = np.array([[1.0, 0.2, 0.0], [0.0, 0.5, 0.1], [0.3, 0.0, 2.0]])
    wrist = Wrist(
        base.spec, base.model, base.names, base.body, turned, np.array([-0.1, -np.inf, 0.0]), np.array([0.2, 0.3, 0.4]),
        base.anchor, base.mount, base.lever,
    )  # fmt: skip
    for torque in np.random.default_rng(1).normal(size=(20, 3)):
        u, v, w = np.linalg.solve(turned, torque)
        expected = max(0.0, u / 0.2, -u / 0.1, v / 0.3, w / 0.4)
        assert max(0.0, *(np.array(wrist.limit_shares) @ torque)) == pytest.approx(expected, rel=1e-12)


def test_the_viewer_draws_the_tip_error_with_its_bound_in_sight_unless_far_above():
    run = simulate(Experiment(duration=1.0))
    [plot] = [plot for plot in run.plots() if plot.name == TIP_PLOT]
    np.testing.assert_array_equal(plot.curves[:, 0], 1e3 * np.linalg.norm(run.tip - run.desired_tip, axis=1))
    largest = plot.curves.max()
    assert ranges(run, 2.0 * largest)[TIP_PLOT][1] > 2.0 * largest
    assert ranges(run, 100.0 * largest)[TIP_PLOT][1] < 3.0 * largest
    assert len(run) > PEAKS


def test_a_bound_that_is_asserted_is_that_of_the_message():
    family = WristGrid(mass_scale=(1.25,), disturbance=(0.25,), com_shift=(0.0,), shape=("constant",))
    with pytest.raises(AssertionError) as caught:
        assert_tracks("pd", family=family, experiment={"duration": 0.3}, max_tip_error_mm=0.02)
    assert "exceeds 0.02 mm: " in str(caught.value)
    assert "--bound 0.02" in str(caught.value)


@pytest.mark.parametrize("said", [{}, {"measurement": {"bound": "x"}}, {"measurement": {"bound": -1.0}}])
def test_a_recording_without_a_bound_has_the_usual_one(said):
    assert bound_of(said) == BOUND
    assert ATTITUDE_BOUND < 0.5


def test_it_is_recorded_and_comes_back(tmp_path):
    run = simulate(Experiment(duration=0.05, bound=0.25, actuation="spherical_motor"))
    record(run, tmp_path / "a.rrd")
    again = load_recording(tmp_path / "a.rrd")
    assert again.measurement == run.measurement
    assert again.verdict == run.verdict
