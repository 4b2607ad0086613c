"""Metrics against closed forms on series made by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spherical_wrist.metrics import Measurement, Meter, measure
from spherical_wrist.simulation.series import COLUMNS, WIDTHS, Series

PERIOD, LEVER = 0.001, (0.0, 0.0, -0.1)


def series(count, **arrays):
    """A series at rest at the identity, but for the arrays given."""
    columns = {name: np.zeros((count, width) if width else count) for name, width in WIDTHS.items()}
    columns["time"] = np.arange(count) * PERIOD
    columns["attitude"][:, 0] = columns["desired_attitude"][:, 0] = 1.0
    assert set(arrays) <= set(COLUMNS)
    return Series(**columns | arrays)


def how(steady_from=0.0, layer=None):
    return Measurement(steady_from, PERIOD, LEVER, layer)


def test_errors_are_of_the_euclidean_norm():
    error = np.array([[3.0, 0.0, 4.0], [0.0, 0.0, 0.0], [0.0, 12.0, 5.0]])
    found = measure(series(3, error=error), how())
    assert found.rms_error_rad == pytest.approx(np.sqrt((25.0 + 169.0) / 3.0))
    assert found.max_error_rad == pytest.approx(13.0)


def test_tip_error_is_a_distance_in_millimetres():
    found = measure(series(2, tip=np.array([[0.003, 0.0, 0.004], [0.0, 0.0, 0.0]])), how())
    assert found.max_tip_error_mm == pytest.approx(5.0)
    assert found.rms_tip_error_mm == pytest.approx(5.0 / np.sqrt(2.0))


def test_chattering_is_total_variation_per_second_and_axis():
    """A torque switching between ±1 every period on one axis varies by 2 per period: 2/T/3."""
    torque = np.zeros((101, 3))
    torque[:, 1] = (-1.0) ** np.arange(101)
    assert measure(series(101, torque=torque), how()).chattering_Nm_per_s == pytest.approx(2.0 / PERIOD / 3.0)


def test_chattering_of_a_slow_sine_is_its_rise_and_fall():
    time = np.arange(4001) * PERIOD
    torque = np.stack([np.sin(2.0 * np.pi * time)] * 3, axis=1)
    assert measure(series(4001, torque=torque), how()).chattering_Nm_per_s == pytest.approx(4.0, rel=1e-4)


def test_torque_and_saturation():
    torque = np.array([[0.0, 0.3, 0.4], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    found = measure(series(4, torque=torque, saturated=np.array([1.0, 0.0, 0.0, 1.0])), how())
    assert (found.peak_torque_Nm, found.rms_torque_Nm) == pytest.approx((0.5, 0.25))
    assert found.saturated_fraction == 0.5


def test_only_the_steady_window_counts():
    error = np.zeros((100, 3))
    error[:50] = 9.0
    found = measure(series(100, error=error), how(steady_from=0.05))
    assert found.max_error_rad == 0.0
    error[50] = 1.0
    assert measure(series(100, error=error), how(steady_from=0.05)).max_error_rad == pytest.approx(np.sqrt(3.0))


def test_a_run_that_ends_before_the_window_has_no_figures():
    found = measure(series(10), how(steady_from=1.0))
    assert found.rms_error_rad is None
    assert found.chattering_Nm_per_s is None


def test_reaching_time_is_the_first_instant_within_the_layer_on_every_axis():
    surface = np.array([[3.0, 0.0, 0.0], [0.1, 2.0, 0.0], [0.9, -0.9, 0.4], [5.0, 0.0, 0.0]])
    assert measure(series(4, surface=surface), how(layer=(1.0, 1.0, 0.5))).reaching_time_s == pytest.approx(0.002)
    assert measure(series(4, surface=surface), how(layer=(1.0, 1.0, 0.1))).reaching_time_s is None
    assert measure(series(4, surface=surface), how()).reaching_time_s is None


def test_tilt_ignores_spin():
    half = 0.35
    turned = np.array([[np.cos(half), np.sin(half), 0.0, 0.0], [np.cos(1.0), 0.0, 0.0, np.sin(1.0)]])
    assert measure(series(2, attitude=turned), how()).max_tilt_rad == pytest.approx(2.0 * half)


@given(st.lists(st.integers(1, 40), min_size=1, max_size=8), st.integers(0, 60))
def test_pieces_give_what_the_whole_gives(lengths, start):
    random = np.random.default_rng(len(lengths) + start)
    count = sum(lengths)
    names = ("error", "torque", "surface", "tip", "desired_tip")
    whole = series(count, **{name: random.normal(size=(count, 3)) for name in names})
    setup = how(steady_from=start * PERIOD, layer=(0.5, 0.5, 0.5))
    meter, first = Meter(setup), 0
    for length in lengths:
        meter.add(whole.rows(slice(first, first + length)))
        first += length
    expected, found = vars(measure(whole, setup)), vars(meter.result())
    assert {name for name in found if found[name] is None} == {name for name in expected if expected[name] is None}
    for name in found:
        assert found[name] is None or found[name] == pytest.approx(expected[name], rel=1e-12)
