"""The fuzzy inference against a naive implementation with 7 × 3 explicit triangles."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigs import vectors
from spherical_wrist.control.fuzzy_sliding_computed_torque import RULES
from spherical_wrist.fuzzy import ERROR_VALUES, RATE_VALUES, fuzzify, sugeno

inputs = st.one_of(st.floats(-3.0, 3.0), st.floats(-1e300, 1e300), st.sampled_from([1.0, -1.0, 0.0, -0.0, 5e-324]))
weights = st.lists(st.tuples(*[st.floats(0.01, 100.0)] * 3), min_size=7, max_size=7).map(np.array)

ERROR_PEAKS = np.array([-3, -2, -1, 0, 1, 2, 3]) / 3.0
RATE_PEAKS = np.array([-1.0, 0.0, 1.0])


def triangle(x, peak, width):
    return max(0.0, 1.0 - abs(x - peak) / width)


def naive(error, rate, theta):
    """Eq. (47) word for word: all 21 rules, product AND, weighted mean; beyond ±1 the outermost sets hold fully."""
    error, rate = np.clip(error, -1.0, 1.0), np.clip(rate, -1.0, 1.0)
    above = below = 0.0
    for row, error_peak in enumerate(ERROR_PEAKS):
        for column, rate_peak in enumerate(RATE_PEAKS):
            strength = triangle(error, error_peak, 1.0 / 3.0) * triangle(rate, rate_peak, 1.0)
            above += strength * theta[row, column]
            below += strength
    return above / below


@given(inputs, inputs, weights)
def test_agrees_with_the_naive_implementation(error, rate, theta):
    assert sugeno(error, rate, theta) == pytest.approx(naive(error, rate, theta), rel=1e-12)


@given(inputs, st.integers(2, 12))
def test_memberships_are_those_of_the_triangles(x, sets):
    """Every degree, so that they add up to one."""
    peaks = np.linspace(-1.0, 1.0, sets)
    degrees = np.zeros(sets)
    lower, upper = fuzzify(x, sets)
    degrees[lower : lower + 2] = 1.0 - upper, upper
    expected = [triangle(np.clip(x, -1.0, 1.0), peak, peaks[1] - peaks[0]) for peak in peaks]
    np.testing.assert_allclose(degrees, expected, atol=1e-13)
    assert degrees.sum() == pytest.approx(1.0, abs=1e-15)


@given(inputs, inputs, st.floats(0.01, 100.0))
def test_equal_weights_come_back_whatever_the_inputs(error, rate, theta):
    """The firing strengths of the 21 rules add up to one."""
    assert sugeno(error, rate, np.full((7, 3), theta)) == pytest.approx(theta, rel=1e-15)


@given(weights)
def test_each_rule_alone_rules_at_its_peak(theta):
    found = [[sugeno(e, r, theta) for r in RATE_PEAKS] for e in ERROR_PEAKS]
    np.testing.assert_allclose(found, theta, rtol=1e-12)


@given(inputs, inputs, weights)
def test_lies_between_the_smallest_and_the_largest_weight(error, rate, theta):
    alpha = sugeno(error, rate, theta)
    assert theta.min() * (1.0 - 1e-15) <= alpha <= theta.max() * (1.0 + 1e-15)
    assert alpha > 0.0


@given(vectors(1.5), st.floats(1e-9, 1e-3), weights)
def test_is_continuous(point, distance, theta):
    """A slope of at most the weights' spread per distance between the peaks: 3 per unit of e, 1 of ė."""
    error, rate, direction = point
    spread = theta.max() - theta.min()
    moved = sugeno(error + distance * np.cos(direction), rate + distance * np.sin(direction), theta)
    assert abs(moved - sugeno(error, rate, theta)) <= 4.0 * spread * distance + 1e-12 * theta.max()


@given(inputs, inputs, weights)
def test_turning_inputs_and_rules_around_changes_nothing(error, rate, theta):
    assert sugeno(-error, -rate, theta[::-1, ::-1]) == pytest.approx(sugeno(error, rate, theta), rel=1e-12)


@pytest.mark.parametrize("error", [-np.inf, -1e308, -1.0, 1.0, 1.0 + 1e-15, 1e308, np.inf])
@pytest.mark.parametrize("rate", [-np.inf, -1.0, 1.0, np.inf])
def test_beyond_the_scales_the_corner_rules_hold(error, rate):
    theta = np.arange(1.0, 22.0).reshape(7, 3)
    assert sugeno(error, rate, theta) == theta[-1 if error > 0 else 0, -1 if rate > 0 else 0]


def test_the_papers_linguistic_values():
    assert ERROR_VALUES == ("NB", "NM", "NS", "Z", "PS", "PM", "PB")
    assert RATE_VALUES == ("N", "Z", "P")


def test_the_rules_in_use_are_positive_symmetric_and_steepest_at_the_origin():
    """α > 0 keeps the surface stable; the law must not prefer one side; see FuzzySlidingComputedTorque."""
    rules = np.array(RULES)
    assert rules.shape == (7, 3)
    assert (rules > 0.0).all()
    assert np.array_equal(rules, rules[::-1, ::-1])
    assert rules.max() == rules[3, 1]
    assert (np.diff(rules[:4], axis=0) > 0.0).all()
