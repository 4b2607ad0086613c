"""The difference of two series, against SciPy's rotations, plain loops and changes whose size is known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rigs import channel_names, random_channels
from spherical_wrist.channels import Condition
from spherical_wrist.inspection import difference
from spherical_wrist.inspection.difference import CommonRow
from spherical_wrist.measure.series import Series

ROWS = 400


def attitudes(rng, rows=ROWS):
    return Rotation.random(rows, rng=rng).as_quat(scalar_first=True)


def series(seed=0, rows=ROWS, period=1e-3, **changes):
    """A series of random numbers, the same for the same seed."""
    rng = np.random.default_rng(seed)
    arrays = random_channels(rng, rows, channel_names(Condition.SURFACE))
    arrays |= {"time": period * np.arange(rows), "slope": np.full((rows, 3), np.nan)}
    return Series(channels={**arrays, **changes})


def changed(base, name, row, component, value):
    array = getattr(base, name).copy()
    array[row, component] = value
    return base.replaced(**{name: array})


def of(found, name):
    return next(array for array in found.arrays if array.name == name)


def test_a_series_does_not_differ_from_itself():
    found = difference(series(), series())
    assert found.same
    assert found.first is None
    assert (found.common, found.rows, found.whole) == (ROWS, (ROWS, ROWS), True)
    assert [array.name for array in found.arrays] == list(series().channels)
    assert all(
        (array.largest, array.rms, array.first, array.undefined) == (0.0, 0.0, None, 0) for array in found.arrays
    )


def test_one_bit_is_found_where_it_is():
    a = series()
    value = a.torque[137, 1]
    found = difference(a, changed(a, "torque", 137, 1, np.nextafter(value, np.inf)))
    assert not found.same
    assert found.first == CommonRow(a.time[137], 137, 137)
    assert [array.name for array in found.arrays if not array.same] == ["torque"]
    torque = of(found, "torque")
    assert torque.unit == "N·m"
    assert torque.largest == np.nextafter(value, np.inf) - value
    assert torque.largest_at == torque.first == found.first
    assert torque.rms == pytest.approx(torque.largest / np.sqrt(ROWS))


def test_largest_and_rms_are_of_the_norm_and_need_not_be_where_it_begins():
    a = series()
    b = changed(changed(a, "tip", 5, 0, a.tip[5, 0] + 0.25), "tip", 9, slice(None), a.tip[9] + [2.0, 3.0, 6.0])
    tip = of(difference(a, b), "tip")
    assert (tip.first.row_a, tip.largest_at.row_a) == (5, 9)
    assert tip.largest == pytest.approx(7.0)
    assert tip.rms == pytest.approx(np.sqrt((0.25**2 + 7.0**2) / ROWS))


def test_within_a_tolerance_they_are_the_same_but_the_first_bit_is_still_told():
    a = series()
    b = changed(changed(a, "rate", 3, 2, a.rate[3, 2] + 1e-6), "rate", 8, 0, a.rate[8, 0] + 1e-4)
    for tolerance, beyond, same in ((0.0, 3, False), (1e-5, 8, False), (2e-4, None, True)):
        found = difference(a, b, tolerance)
        assert of(found, "rate").first.row_a == 3
        assert (found.first and found.first.row_a) == beyond
        assert found.same is same


def test_attitudes_differ_by_the_angle_between_them():
    rng = np.random.default_rng(4)
    a = series()
    turns = Rotation.from_rotvec(rng.normal(size=(ROWS, 3)) * np.geomspace(1e-12, 3.0, ROWS)[:, None])
    turned = (Rotation.from_quat(a.attitude, scalar_first=True) * turns).as_quat(scalar_first=True)
    sign = rng.choice([-1.0, 1.0], size=(ROWS, 1))
    attitude = of(difference(a, series(attitude=sign * turned)), "attitude")
    expected = turns.magnitude()
    assert attitude.unit == "rad"
    assert attitude.largest == pytest.approx(expected.max(), rel=1e-12)
    assert attitude.largest_at.row_a == expected.argmax()
    assert attitude.rms == pytest.approx(np.sqrt(np.mean(expected**2)), rel=1e-12)
    assert np.pi - 0.1 < expected.max()


def test_a_quaternion_and_its_negative_are_one_attitude():
    a = series()
    assert difference(a, series(attitude=-a.attitude)).same
    assert not difference(a, series(rate=-a.rate)).same


def test_a_thinned_series_is_compared_on_the_instants_that_it_has():
    a = series()
    thinned = a.rows(slice(None, None, 9))
    assert thinned.time[-1] < a.time[-1]
    found = difference(a, thinned)
    assert found.same
    assert difference(thinned, a).same
    assert (found.common, found.rows, found.whole) == (-(-ROWS // 9), (ROWS, -(-ROWS // 9)), True)
    b = changed(changed(a, "error", 26, 0, 9.0), "error", 27, 0, 9.0).rows(slice(None, None, 9))
    assert of(difference(a, b), "error").first == CommonRow(a.time[27], 27, 3)
    assert of(difference(b, a), "error").first == CommonRow(a.time[27], 3, 27)


def test_series_thinned_in_two_ways_share_few_instants():
    a = series()
    found = difference(a.rows(slice(None, None, 4)), a.rows(slice(None, None, 6)))
    assert found.same
    assert found.common == len(range(0, ROWS, 12))


def test_periods_that_rounding_parts_share_their_instants():
    """k · 0.0003 and 3k · 0.0001 are not always the same bits."""
    a, b = series(rows=399, period=0.0001), series(rows=133, period=0.0003)
    assert (a.time[::3] != b.time).any()
    found = difference(a, b, tolerance=1e3)
    assert found.common == 133
    assert 0.0 < of(found, "time").largest < 1e-15


@pytest.mark.parametrize("thinned", [1, 10])
def test_what_ends_earlier_is_the_same_in_part_only(thinned):
    a = series()
    found = difference(a, a.rows(slice(0, 300, thinned)))
    assert all(array.same for array in found.arrays)
    assert not found.whole
    assert not found.same
    assert found.common_span == (0.0, a.time[300 - thinned])
    late = difference(a.rows(slice(100, None)), a)
    assert not late.same
    assert late.common == 300


def test_without_common_instants_nothing_is_the_same():
    a = series()
    shifted = a.replaced(time=a.time + 0.0005)
    found = difference(a, shifted)
    assert (found.common, found.common_span, found.same) == (0, None, False)
    assert difference(Series.empty(), Series.empty()).same
    assert not difference(a, Series.empty()).same


def test_not_a_number_is_like_another_and_unlike_any_number():
    a = series()
    other = np.frombuffer(np.uint64(0xFFF8000000000001).tobytes())[0]
    assert np.isnan(other)
    assert difference(changed(a, "surface", 2, 0, np.nan), changed(a, "surface", 2, 0, other)).same
    surface = of(difference(a, changed(a, "surface", 2, 0, other), tolerance=1e9), "surface")
    assert surface.beyond.row_a == 2
    assert (surface.undefined, surface.largest, surface.rms) == (1, 0.0, 0.0)
    nothing = of(difference(a, series(surface=np.full((ROWS, 3), np.nan))), "surface")
    assert (nothing.undefined, nothing.largest, nothing.largest_at, nothing.rms) == (ROWS, None, None, None)


def test_infinite_numbers_and_zeros_with_a_sign():
    a = changed(changed(series(), "torque", 1, 0, np.inf), "torque", 4, 0, 0.0)
    assert difference(a, a).same
    assert of(difference(a, changed(a, "torque", 1, 0, -np.inf)), "torque").undefined == 1
    zero = of(difference(a, changed(a, "torque", 4, 0, -0.0)), "torque")
    assert (zero.first.row_a, zero.largest, zero.same) == (4, 0.0, False)
    assert difference(a, changed(a, "torque", 4, 0, -0.0), tolerance=1e-300).same


def test_arrays_that_one_lacks_or_that_have_other_components():
    a = series(law_state=np.zeros((ROWS, 3)), current=np.ones((ROWS, 24)))
    b = series(law_state=np.zeros((ROWS, 2)), measured_attitude=attitudes(np.random.default_rng(1)))
    found = difference(a, b, tolerance=1e9)
    different = {array.name: array.components for array in found.arrays if not array.same}
    assert different == {"law_state": (3, 2), "current": (24, 0), "measured_attitude": (0, 4)}
    assert not found.same
    assert found.first is None


@given(
    st.lists(st.tuples(st.integers(0, 29), st.integers(0, 2), st.floats(-2.0, 2.0)), max_size=6),
    st.sampled_from([0.0, 0.5, 2.0]),
)
def test_as_a_plain_loop_finds_it(changes, tolerance):
    a = series(rows=30)
    b = a
    for row, component, by in changes:
        b = changed(b, "error", row, component, b.error[row, component] + by)
    distances = [
        sum((x - y) ** 2 for x, y in zip(p, q, strict=True)) ** 0.5 for p, q in zip(a.error, b.error, strict=True)
    ]
    differ = [p.tobytes() != q.tobytes() for p, q in zip(a.error, b.error, strict=True)]
    over = [row for row in range(30) if differ[row] and (distances[row] > tolerance or not tolerance)]
    found = of(difference(a, b, tolerance), "error")
    assert (found.first and found.first.row_a) == (differ.index(True) if any(differ) else None)
    assert (found.beyond and found.beyond.row_a) == (over[0] if over else None)
    assert found.largest == pytest.approx(max(distances))
    assert found.rms == pytest.approx((sum(d * d for d in distances) / 30) ** 0.5)
