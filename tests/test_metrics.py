"""Metrics: values against independent NumPy and SciPy, the contract of every registered metric, and a new one."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console
from scipy.spatial.transform import Rotation

from rigs import channel_names
from spherical_wrist import Experiment, assert_tracks, load_recording, record, simulate
from spherical_wrist.assertions import WristGrid
from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.folder import Folder, campaign_lock
from spherical_wrist.campaign.store import encode_rows
from spherical_wrist.channels import CHANNELS, Condition
from spherical_wrist.cli import list as list_command
from spherical_wrist.cli.output import metric_figure, metrics_table
from spherical_wrist.cli.run import _summary as run_summary
from spherical_wrist.comparison.report import as_csv
from spherical_wrist.errors import ParameterError, RecordingError, UnknownNameError
from spherical_wrist.guides import read_guide
from spherical_wrist.inspection.consistency import inspect
from spherical_wrist.loop.engine import compiled_engine, interpreted_engine
from spherical_wrist.measure.logged import channels_of
from spherical_wrist.measure.metrics import (
    COILS,
    EVENTS,
    MEAN,
    METRICS,
    QUANTITIES,
    SURFACE,
    Metric,
    Metrics,
    MetricSettings,
)
from spherical_wrist.measure.series import Series
from spherical_wrist.prepare.cache import RunCache
from spherical_wrist.recording.layout import FORMAT
from spherical_wrist.recording.metrics_text import metrics_text
from spherical_wrist.recording.runs import properties_of
from spherical_wrist.simulation.metric_accumulator import MetricAccumulator, compute_metrics
from spherical_wrist.simulation.rollouts import roll_out

PERIOD, LEVER = 0.001, (0.0, 0.0, -0.1)
WITH_ALL = Experiment(
    actuation="spherical_motor", sensing="realistic", duration=0.6, steady_from=0.02, initial_error=0.8, bound=100.0
)
"""Experiment with a sliding surface, coils, and sensors and motors that are not ideal."""


@pytest.fixture(scope="module")
def whole():
    """A run that has every metric."""
    return simulate(WITH_ALL)


# --- values ----------------------------------------------------------------------------------------------------------


def truth(run):
    """Compute the metrics of a run once more, by NumPy and SciPy from its recorded arrays."""
    experiment, settings = run.experiment, run.measurement
    steady = run.time >= settings.steady_from - 1e-9
    length = [
        np.linalg.norm(array[steady], axis=1) for array in (run.error, 1e3 * (run.tip - run.desired_tip), run.torque)
    ]
    error, tip_error, torque = length
    lever = np.array(settings.lever)
    away = 1e3 * np.linalg.norm(run.tip - run.desired_tip, axis=1)
    tool = Rotation.from_quat(run.attitude[steady], scalar_first=True).apply(lever)
    cosine = tool @ lever / np.linalg.norm(tool, axis=1) / np.linalg.norm(lever)
    command, motors = run.command[steady], experiment.nominal()
    inside = (np.abs(run.surface) <= settings.boundary_layer).all(axis=1)
    current, condition = run.current[steady], run.condition[steady]
    return {
        "rms_error_rad": np.sqrt(np.mean(error**2)),
        "max_error_rad": error.max(),
        "rms_tip_error_mm": np.sqrt(np.mean(tip_error**2)),
        "max_tip_error_mm": tip_error.max(),
        "max_tip_error_at_s": run.time[steady][tip_error.argmax()],
        "settling_time_s": run.time[np.flatnonzero(away > settings.bound)[-1] + 1],
        "motor_use_fraction": max(
            (command @ np.linalg.inv(motors.motors).T / motors.upper).max(),
            (command @ np.linalg.inv(motors.motors).T / motors.lower).max(),
            np.abs(current).max() / experiment.actuation.current_limit,
        ),
        "chattering_Nm_per_s": np.abs(np.diff(command, axis=0)).mean() / experiment.control_period,
        "peak_torque_Nm": torque.max(),
        "rms_torque_Nm": np.sqrt(np.mean(torque**2)),
        "saturated_fraction": run.saturated[steady].mean(),
        "reaching_time_s": run.time[np.flatnonzero(~inside)[-1] + 1],
        "max_tilt_rad": np.arccos(cosine).max(),
        "copper_loss_W": experiment.actuation.resistance * np.mean(np.sum(current**2, axis=1)),
        "peak_current_A": np.abs(current).max(),
        "max_condition_number": condition.max(),
    }


def test_every_metric_is_that_of_numpy_and_scipy(whole):
    expected = truth(whole)
    assert whole.metrics.saturated_fraction > 0.0
    assert whole.metrics.reaching_time_s > 0.0
    assert {name: whole.metrics[name] for name in expected} == pytest.approx(expected, rel=1e-9)


def series(count, **arrays):
    """A series at rest at the identity, but for the arrays given."""
    columns = {name: np.zeros((count, *CHANNELS[name].shape)) for name in channel_names(Condition.SURFACE)}
    columns["time"] = np.arange(count) * PERIOD
    columns["attitude"][:, 0] = columns["desired_attitude"][:, 0] = 1.0
    assert set(arrays) <= set(columns)
    return Series(channels=columns | arrays)


def settings(steady_from=0.0, layer=None):
    return MetricSettings(steady_from, PERIOD, LEVER, layer)


def turned(*vectors):
    """Attitudes (w, x, y, z) of rotation vectors."""
    return Rotation.from_rotvec(vectors).as_quat(scalar_first=True)


def test_errors_are_of_the_euclidean_norm():
    error = np.array([[3.0, 0.0, 4.0], [0.0, 0.0, 0.0], [0.0, 12.0, 5.0]])
    found = compute_metrics(series(3, error=error), settings())
    assert found.rms_error_rad == pytest.approx(np.sqrt((25.0 + 169.0) / 3.0))
    assert found.max_error_rad == pytest.approx(13.0)


def test_tip_error_is_a_distance_in_millimetres():
    """A lever of 0.1 m turned by 60° moves its end by 0.1 m."""
    attitude = turned([np.pi / 3.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    found = compute_metrics(series(2, attitude=attitude), settings())
    assert found.max_tip_error_mm == pytest.approx(100.0)
    assert found.rms_tip_error_mm == pytest.approx(100.0 / np.sqrt(2.0))


def test_chattering_is_total_variation_per_second_and_axis():
    """A torque switching between ±1 every period on one axis varies by 2 per period: 2/T/3."""
    torque = np.zeros((101, 3))
    torque[:, 1] = (-1.0) ** np.arange(101)
    found = compute_metrics(series(101, torque=torque), settings())
    assert found.chattering_Nm_per_s == pytest.approx(2.0 / PERIOD / 3.0)


def test_chattering_of_a_slow_sine_is_its_rise_and_fall():
    time = np.arange(4001) * PERIOD
    torque = np.stack([np.sin(2.0 * np.pi * time)] * 3, axis=1)
    found = compute_metrics(series(4001, torque=torque), settings())
    assert found.chattering_Nm_per_s == pytest.approx(4.0, rel=1e-4)


def test_torque_and_saturation():
    torque = np.array([[0.0, 0.3, 0.4], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    found = compute_metrics(series(4, torque=torque, saturated=np.array([1.0, 0.0, 0.0, 1.0])), settings())
    assert (found.peak_torque_Nm, found.rms_torque_Nm) == pytest.approx((0.5, 0.25))
    assert found.saturated_fraction == 0.5
    assert metric_figure("saturated_fraction", found.saturated_fraction) == "50"


def test_only_the_steady_window_counts():
    error = np.zeros((100, 3))
    error[:50] = 9.0
    found = compute_metrics(series(100, error=error), settings(steady_from=0.05))
    assert found.max_error_rad == 0.0
    error[50] = 1.0
    found = compute_metrics(series(100, error=error), settings(steady_from=0.05))
    assert found.max_error_rad == pytest.approx(np.sqrt(3.0))


def test_a_run_that_ends_before_the_window_has_no_figures_but_times_of_the_whole_run():
    found = compute_metrics(series(10), settings(steady_from=1.0, layer=(1.0, 1.0, 1.0)))
    assert {name for name, value in found.items() if value is not None} == {"reaching_time_s", "settling_time_s"}
    assert compute_metrics(series(1), settings()).chattering_Nm_per_s is None


@pytest.mark.parametrize("stays", [True, False])
def test_reaching_time_is_the_instant_from_which_the_run_stays_within_the_layer_on_every_axis(stays):
    surface = np.array([[3.0, 0.0, 0.0], [0.1, 2.0, 0.0], [0.9, -0.9, 0.4], [5.0, 0.0, 0.0], [0.0, 0.0, 0.0]])

    def reached(layer, rows=5):
        given = settings(layer=layer)._replace(surface_stays=stays)
        return compute_metrics(series(rows, surface=surface[:rows]), given).reaching_time_s

    assert reached((1.0, 1.0, 0.5)) == pytest.approx(0.004 if stays else 0.002)
    assert reached((1.0, 1.0, 0.5), 3) == pytest.approx(0.002)
    assert reached((1.0, 1.0, 0.5), 4) == (None if stays else pytest.approx(0.002))
    assert reached((1.0, 1.0, 0.1), 4) is None
    assert reached((9.0, 9.0, 9.0)) == 0.0
    assert reached(None) is None


def test_tilt_ignores_spin():
    attitude = turned([0.7, 0.0, 0.0], [0.0, 0.0, 2.0])
    assert compute_metrics(series(2, attitude=attitude), settings()).max_tilt_rad == pytest.approx(0.7)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 1.2, 3.0, np.pi - 1e-7])
def test_tilt_is_precise_at_tiny_angles_and_next_to_a_half_turn(angle):
    """An arccosine would lose half the digits there."""
    found = compute_metrics(series(1, attitude=turned([angle, 0.0, 0.0])), settings()).max_tilt_rad
    assert found == pytest.approx(angle, rel=1e-9, abs=1e-15)


def test_an_infinite_condition_number_is_none():
    condition = np.array([2.0, np.inf])
    found = compute_metrics(
        series(2).replaced(condition=condition, current=np.ones((2, 5))), settings()._replace(resistance=2.0)
    )
    assert found.max_condition_number is None
    assert (found.copper_loss_W, found.peak_current_A) == (10.0, 1.0)


# --- one arithmetic --------------------------------------------------------------------------------------------------


@given(st.lists(st.integers(1, 40), min_size=1, max_size=8), st.integers(0, 60))
def test_pieces_give_what_the_whole_gives(lengths, start):
    random = np.random.default_rng(len(lengths) + start)
    count = sum(lengths)
    whole = series(count, **{name: random.normal(size=(count, 3)) for name in ("error", "torque", "surface")})
    how = settings(steady_from=start * PERIOD, layer=(0.5, 0.5, 0.5))
    expected = compute_metrics(whole, how)
    with pytest.MonkeyPatch.context() as patch:
        for length in lengths:
            patch.setattr("spherical_wrist.simulation.metric_accumulator.PIECE", length)
            assert compute_metrics(whole, how) == expected


@pytest.mark.parametrize("law", ["pd", "fuzzy_sliding_computed_torque"])
def test_compiled_and_interpreted_agree_to_the_last_bit(law):
    experiment, logged = WITH_ALL.replaced(law=law, duration=0.15, steady_from=0.01), []
    measurement = experiment.measurement(experiment.nominal())
    compiled, interpreted = (MetricAccumulator(measurement, make()) for make in (compiled_engine, interpreted_engine))

    def keep(loop, piece):
        for each in (compiled, interpreted):
            each.add(piece)
        logged.append(piece.series(loop.wrist, channels_of(experiment.law, loop.sensing, loop.actuation)))

    [found] = roll_out([lambda: experiment], RunCache(compiled_engine()), keep=keep)
    assert compiled.totals.tobytes() == interpreted.totals.tobytes()
    assert compiled.result() == interpreted.result() == found.metrics
    assert compute_metrics(Series.joined(logged), measurement) == found.metrics, "of the series as of the log"
    assert all(value is not None for value in found.metrics.available.values())


# --- what a run has --------------------------------------------------------------------------------------------------


def test_a_run_has_the_metrics_that_its_settings_say():
    plain = simulate(Experiment(law="pd", duration=0.05)).metrics
    assert list(plain) == list(METRICS)
    lacking = {name for name, metric in METRICS.items() if metric.needs in (SURFACE, COILS)}
    assert {name for name in plain if name not in plain.available} == lacking
    assert all(plain[name] is None for name in lacking)
    with pytest.raises(AttributeError, match="rms_eror"):
        plain.rms_eror  # noqa: B018
    with pytest.raises(KeyError):
        plain["rms_eror"]
    with pytest.raises(AttributeError):
        plain.rms_error_rad = 1.0


def test_a_recording_that_lacks_a_metric_that_it_must_have_is_refused(tmp_path, whole):
    lacking = {name: value for name, value in whole.metrics.available.items() if name != "max_tilt_rad"}
    record(replace(whole, metrics=Metrics(lacking)), tmp_path / "run.rrd")
    with pytest.raises(RecordingError, match="max_tilt_rad"):
        inspect(tmp_path / "run.rrd")


def test_a_recording_whose_tips_are_not_those_of_its_attitudes_contradicts_itself(tmp_path, whole):
    tip = whole.tip.copy()
    tip[7, 0] += 1e-9
    record(whole.replaced(tip=tip), tmp_path / "run.rrd")
    with pytest.raises(RecordingError, match="tips"):
        inspect(tmp_path / "run.rrd").check()


def test_a_thinned_recording_is_checked_for_extremes(tmp_path):
    run = simulate(WITH_ALL, record_every=3)
    record(run, tmp_path / "run.rrd")
    inspect(tmp_path / "run.rrd").check()
    extremes = tuple(name for name, metric in METRICS.items() if metric.extreme)
    small = {name: 0.5 * value if name in extremes else value for name, value in run.metrics.items()}
    record(replace(run, metrics=Metrics(small)), tmp_path / "small.rrd")
    assert inspect(tmp_path / "small.rrd").mismatches == extremes
    unbounded = {name: None for name, metric in METRICS.items() if metric.unbounded}
    record(replace(run, metrics=Metrics({**run.metrics, **unbounded})), tmp_path / "infinite.rrd")
    assert inspect(tmp_path / "infinite.rrd").mismatches == ()


# --- the contract of every metric ------------------------------------------------------------------------------------


def printed(table):
    console = Console(file=io.StringIO(), width=100)
    console.print(table)
    return console.file.getvalue()


def suffix(unit):
    """Return the ending that a name has for a unit."""
    return f"_{unit.replace('·', '').replace('/', '_per_')}" if unit else ""


@pytest.mark.parametrize("name", METRICS)
def test_its_entry_is_complete(name):
    metric = METRICS[name]
    assert metric.name == name
    assert name.isidentifier()
    assert name.endswith(suffix(metric.unit))
    assert metric.label
    assert len(metric.meaning.split()) > 2
    assert not metric.meaning.endswith(".")
    assert metric.quantity in (*QUANTITIES, *EVENTS)
    assert metric.digits >= 3
    assert metric.since >= 1
    assert metric.needs.runs


ONE = WristGrid(mass_scale=(1.25,), disturbance=(0.25,), com_shift=(0.0,), shape=("constant",))
"""A family of one wrist."""


def check_everywhere(name, run, capsys):
    """Check that a metric is in whatever shows a run's metrics."""
    metric, value = METRICS[name], run.metrics[name]
    assert value is not None
    shown = f"{metric.shown_value(value):.{metric.digits}g}"
    lines = printed(metrics_table({"": run.metrics}, 100)).splitlines()
    [row] = [line for line in lines if line.startswith(f"{metric.label}  ")]
    assert metric_figure(name, value) in row
    assert metric.shown_unit in row
    entry = f"| {metric.label} | {f'**{shown}** {metric.shown_unit}'.rstrip()} | {metric.note} |"
    assert entry in metrics_text(properties_of(run), len(run), 1)
    assert run_summary(run, None)["metrics"][name] == value
    keys = ("law", "case", "seed", "outcome", "ended_at_s", "ratio", "chattering_ratio", "command", "rank", "winner")
    cell = {**dict.fromkeys(keys), "metrics": dict(run.metrics)}
    [row] = csv.DictReader(io.StringIO(as_csv({"cells": [cell], "standings": [cell], "cases": [cell]})))
    assert row[name] == str(value)
    list_command.command("metrics")
    assert name in capsys.readouterr().out
    with pytest.raises(AssertionError, match=f"misses {name} ≤ 1e-12 on 1 of 1"):
        assert_tracks(run.experiment.law, family=ONE, experiment=WITH_ALL, **{name: 1e-12})


@pytest.mark.parametrize("name", METRICS)
def test_it_appears_everywhere(name, whole, capsys):
    check_everywhere(name, whole, capsys)


def test_the_guide_has_the_table_of_the_registry():
    text = read_guide("conventions").text
    for name, metric in METRICS.items():
        assert f"| {metric.label} | `{name}` | {metric.unit} |" in text


# --- a new metric ----------------------------------------------------------------------------------------------------

NEW = Metric(
    *("mean_tilt_rad", "tilt, mean", "rad", "tilt", MEAN),
    "mean angle between the tool and its direction at the identity",
    shown=(1e3, "mrad"),
    since=FORMAT + 1,
)


@pytest.fixture
def register(monkeypatch):
    """Register a metric for this test."""
    return lambda metric=NEW: monkeypatch.setitem(METRICS, metric.name, metric)


def test_a_new_metric_appears_everywhere(register, capsys):
    register()
    run = simulate(WITH_ALL)
    lever = np.array(run.measurement.lever)
    tool = Rotation.from_quat(run.attitude[run.time >= 0.02 - 1e-9], scalar_first=True).apply(lever)
    assert run.metrics.mean_tilt_rad == pytest.approx(np.arccos(tool @ lever / (lever @ lever)).mean())
    check_everywhere("mean_tilt_rad", run, capsys)


def test_an_older_recording_lacks_a_new_metric_without_complaint(register, tmp_path, whole):
    record(whole, tmp_path / "old.rrd")
    register()
    found = inspect(tmp_path / "old.rrd")
    assert found.mismatches == ()
    assert "mean_tilt_rad" not in found.run.metrics.available
    assert found.run.metrics.mean_tilt_rad is None
    assert found.recomputed.mean_tilt_rad > 0.0
    assert "tilt, mean" not in printed(metrics_table({"": found.run.metrics}, 100))
    record(simulate(WITH_ALL), tmp_path / "new.rrd")
    assert load_recording(tmp_path / "new.rrd").metrics.mean_tilt_rad == found.recomputed.mean_tilt_rad
    inspect(tmp_path / "new.rrd").check()


CAMPAIGN = """
design = "sobol"
samples = 8
seed = 1
batch = 4
[[laws]]
name = "pd"
[vary]
mass_scale = { uniform = [0.8, 1.2] }
"""


def store(folder, number, values):
    """Store a batch of a campaign whose episodes never ran."""
    batch = folder.files.batch(number)
    rows = [
        {"id": each.id, "sample": each.sample, "law": each.law, "seed": each.seed, **each.values}
        | {"outcome": "completed", "ended_at_s": 0.1, "reason": "", **dict.fromkeys(METRICS, 0.25), **values}
        for each in folder.campaign.episodes(batch.first, batch.last)
    ]
    folder.files.path(batch).write_bytes(encode_rows(folder.campaign, folder.digest, folder.versions, rows))


def test_a_campaign_goes_on_with_other_metrics_than_it_began_with(monkeypatch, tmp_path):
    file = tmp_path / "campaign.toml"
    file.write_text(CAMPAIGN)
    with campaign_lock(tmp_path / "campaign"):
        folder = Folder.create(tmp_path / "campaign", file, Campaign.from_toml(file))
    asked = "SELECT mean_tilt_rad AS new, max_tilt_rad AS old FROM episodes ORDER BY id"
    store(folder, 0, {})
    monkeypatch.setitem(METRICS, NEW.name, NEW)
    assert [tuple(row.values()) for row in folder.episodes(pytest.fail).rows(asked)] == [(None, 0.25)] * 4
    assert NEW.name not in folder.files.row(1)
    store(folder, 1, {NEW.name: 0.5})
    assert folder.files.row(5)[NEW.name] == 0.5
    monkeypatch.delitem(METRICS, NEW.name)
    found = [tuple(row.values()) for row in folder.episodes(pytest.fail).rows(asked)]
    assert found == [(None, 0.25)] * 4 + [(0.5, 0.25)] * 4
    monkeypatch.delitem(METRICS, "max_tilt_rad")
    monkeypatch.setitem(METRICS, NEW.name, NEW)
    assert [tuple(row.values()) for row in folder.episodes(pytest.fail).rows(asked)] == found


# --- bounds ----------------------------------------------------------------------------------------------------------


def test_a_bound_names_a_metric_that_the_runs_have():
    with pytest.raises(UnknownNameError, match="unknown metric 'max_eror_rad'; did you mean 'max_error_rad'"):
        assert_tracks("pd", max_eror_rad=1.0)
    with pytest.raises(ParameterError, match=r"copper_loss_W: .* spherical motors"):
        assert_tracks("pd", copper_loss_W=1.0, family=ONE, experiment={"duration": 0.05})
    with pytest.raises(ParameterError, match="greater than 0"):
        assert_tracks("pd", rms_error_rad="small")
