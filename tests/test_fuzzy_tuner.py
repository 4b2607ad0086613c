"""The law's α(e, ė) with every inference: table against direct inference, compiled against interpreted, positive."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigs import one_line
from sampling import count, some
from spherical_wrist import Experiment, simulate
from spherical_wrist.control import FuzzySlidingComputedTorque, Law
from spherical_wrist.control.contract import COMMAND
from spherical_wrist.control.fuzzy_sliding_computed_torque import RULES, TILTS
from spherical_wrist.errors import LawError, ParameterError
from spherical_wrist.fuzzy import ERROR_VALUES, RATE_VALUES, report, sugeno, table_error, tabulate
from spherical_wrist.fuzzy.table import GRID
from test_laws import alpha, compiled_steps, signals, steps

SHAPES, CONJUNCTIONS = ("triangular", "trapezoidal", "bell", "gaussian"), ("product", "min")
METHODS = [
    {"inference": "sugeno"},
    {"inference": "sugeno_first_order", "rate_tilts": [[0.5, 0.0, -0.5]] * 7},
    *(
        {"inference": "mamdani", "aggregation": aggregation, "defuzzification": defuzzification}
        for aggregation, defuzzification in itertools.product(("max_min", "sum_min"), ("coa", "cog"))
    ),
]
EVERY = [
    {**method, "membership": shape, "conjunction": conjunction}
    for method, shape, conjunction in itertools.product(METHODS, SHAPES, CONJUNCTIONS)
]


def label(options):
    return "-".join(value for value in options.values() if isinstance(value, str))


every_combination = pytest.mark.parametrize("options", some(EVERY, 3), ids=label)
few = pytest.mark.parametrize(
    "options",
    [
        {"inference": "mamdani"},
        {"inference": "mamdani", "conjunction": "min", "membership": "trapezoidal"},
        {"inference": "sugeno_first_order", "membership": "gaussian"},
        {"conjunction": "min"},
    ],
    ids=label,
)


def read(law, error, rate):
    """α as the law reads it, of scaled inputs."""
    table = law.derived()["table"]
    return np.array([sugeno(e, r, table) for e, r in zip(error, rate, strict=True)])


def scattered(points, seed=0, size=1.1):
    return np.random.default_rng(seed).uniform(-size, size, (2, points))


# --- every combination


@every_combination
def test_compiled_equals_interpreted(options):
    """To rounding, and with the α of the direct inference, eq. (46)–(47), within the stated error of the table."""
    law, given = FuzzySlidingComputedTorque(**options), signals(60, seed=3)
    (plain, _), (machine, _) = steps(law, given), compiled_steps(law, given)
    for name in COMMAND.names:
        np.testing.assert_allclose(machine[name], plain[name], rtol=1e-12, atol=1e-15)
    direct = law.tuner.system()(given["error"] / law.error_scale, given["rate_error"] / law.rate_scale)
    np.testing.assert_allclose(machine["slope"] / law.slope, direct, atol=0.15)
    assert (machine["slope"] > 0.0).all()


@every_combination
def test_the_stated_error_of_a_table_holds(options):
    """On a coarse grid, where the error is large: at scattered points, off the lattice it is computed on."""
    system = FuzzySlidingComputedTorque(**options).tuner.system()
    table = tabulate(system, (49, 25))
    error, rate = scattered(8_000)
    found = max(abs(float(z) - sugeno(e, r, table)) for e, r, z in zip(error, rate, system(error, rate), strict=True))
    stated = table_error(system, table)
    assert found <= stated + 1e-12
    assert stated <= 6.0 * found + 1e-12


@few
def test_the_laws_own_stated_error_holds_and_is_small(options):
    law = FuzzySlidingComputedTorque(**options)
    error, rate = scattered(count(5_000, 20_000), seed=1)
    found = np.abs(law.tuner.system()(error, rate) - read(law, error, rate)).max()
    assert 0.0 < found <= law.table_error
    assert law.table_error < 0.02 * np.max(RULES)
    assert law.derived()["table"].shape == GRID


@every_combination
def test_rules_that_are_symmetric_make_a_symmetric_positive_slope_within_the_weights(options):
    law = FuzzySlidingComputedTorque(**options)
    table = law.derived()["table"]
    np.testing.assert_allclose(table, table[::-1, ::-1], rtol=1e-9)
    assert table.min() >= (1.0 if options["inference"] == "sugeno" else 0.5)
    assert table.max() <= 6.5
    found = report(law.tuner.system(), 61)
    assert found.positive
    assert found.gap_share == 0.0


@pytest.mark.parametrize("conjunction", CONJUNCTIONS)
@pytest.mark.parametrize("method", METHODS, ids=label)
def test_at_its_peak_a_rule_alone_says_its_weight(method, conjunction):
    """Neighbouring sets end here. Tilts are about the peak, output sets symmetric about the weight."""
    law = FuzzySlidingComputedTorque(**method, conjunction=conjunction)
    e, rate = np.meshgrid(np.linspace(-1, 1, len(ERROR_VALUES)), np.linspace(-1, 1, len(RATE_VALUES)), indexing="ij")
    np.testing.assert_allclose(law.tuner.system()(e, rate), RULES, rtol=1e-9)
    np.testing.assert_allclose(read(law, e.ravel(), rate.ravel()), np.ravel(RULES), rtol=1e-9)


# --- the default stays what it was


def test_the_default_is_the_exact_inference_of_equation_47():
    law = FuzzySlidingComputedTorque()
    assert np.array_equal(law.derived()["table"], np.array(RULES))
    assert law.table_error == 0.0
    assert law.tuner.exact
    error, rate = scattered(500, size=1.5)
    np.testing.assert_allclose(read(law, error, rate), law.tuner.system()(error, rate), rtol=1e-13)
    scaled = error[:3] * law.error_scale, rate[:3] * law.rate_scale
    np.testing.assert_allclose(read(law, error[:3], rate[:3]), alpha(law, *scaled), rtol=1e-12)


def test_cog_and_sum_min_are_one_and_max_min_coa_is_another():
    """Difference between eq. (32) and eq. (33); see spherical_wrist.fuzzy.mamdani."""
    tables = {
        (a, d): FuzzySlidingComputedTorque(inference="mamdani", aggregation=a, defuzzification=d).derived()["table"]
        for a, d in itertools.product(("max_min", "sum_min"), ("coa", "cog"))
    }
    assert np.array_equal(tables["max_min", "cog"], tables["sum_min", "cog"])
    assert np.array_equal(tables["sum_min", "cog"], tables["sum_min", "coa"])
    assert np.abs(tables["max_min", "coa"] - tables["sum_min", "coa"]).max() > 0.1


def test_without_tilts_first_order_is_order_zero():
    flat = FuzzySlidingComputedTorque(inference="sugeno_first_order", error_tilts=[[0.0] * 3] * 7)
    error, rate = scattered(500)
    np.testing.assert_allclose(read(flat, error, rate), read(FuzzySlidingComputedTorque(), error, rate), rtol=1e-12)


def test_the_tilts_in_use_keep_the_slope_monotone_and_round_off_its_creases():
    """As with order zero, α falls with the error on either side; at the rows of the rules it turns less sharply."""
    assert np.array_equal(np.array(TILTS), -np.array(TILTS)[::-1])
    law = FuzzySlidingComputedTorque(inference="sugeno_first_order")
    found = report(law.tuner.system())
    assert (found.trend(1), found.trend(-1)) == ("falls", "falls")
    middle = law.tuner.system()(np.linspace(-1, 1, 601), 0.0)
    exact = FuzzySlidingComputedTorque().tuner.system()(np.linspace(-1, 1, 601), 0.0)
    assert np.abs(np.diff(middle, 2)).max() < 0.6 * np.abs(np.diff(exact, 2)).max()


# --- positive


weights = st.lists(st.tuples(*[st.floats(0.6, 8.0)] * 3), min_size=7, max_size=7)


@settings(max_examples=count(4, 12))
@given(weights, st.sampled_from([o for o in EVERY if o["inference"] != "sugeno_first_order"]))
def test_positive_rules_make_a_positive_slope(rules, options):
    law = FuzzySlidingComputedTorque(rules=rules, **options)
    assert law.derived()["table"].min() > 0.0
    assert (read(law, *scattered(50, size=2.0)) > 0.0).all()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            {"inference": "sugeno_first_order", "error_tilts": [[-18.0] * 3, [18.0] * 3] + [[0.0] * 3] * 5},
            "α > 0 is needed",
        ),
        ({"inference": "mamdani", "output_width": 1.0}, "less than the smallest rule weight, 1, is needed"),
        ({"inference": "mamdani", "output_width": 1e-3}, "at least 0.051 is needed"),
        ({"inference": "mamdami"}, "'sugeno', 'sugeno_first_order' or 'mamdani'"),
        ({"membership": "square"}, "membership = 'square'"),
        ({"error_tilts": 1.0}, "error_tilts"),
    ],
)
def test_what_would_make_the_slope_unsafe_is_refused_in_one_line(options, said):
    with pytest.raises(ParameterError) as caught:
        FuzzySlidingComputedTorque(**options)
    assert said in one_line(caught.value)
    with pytest.raises(ParameterError):
        Experiment(law={"name": "fuzzy_sliding_computed_torque", **options})


def test_what_an_inference_does_not_use_does_not_matter_to_it():
    """Rule weights below the output width are no concern of Sugeno's."""
    law = FuzzySlidingComputedTorque(rules=[[0.1] * 3] * 7, output_width=5.0, error_tilts=[[99.0] * 3] * 7)
    assert law.derived()["table"].max() == 0.1


# --- in the closed loop


@few
def test_every_inference_holds_the_disturbance_in_the_closed_loop(options):
    """The default run, but shorter: 25 % torque, +25 % mass. The slope near the origin is about the same for all."""
    law = {"name": "fuzzy_sliding_computed_torque", **options}
    default = simulate(Experiment(duration=3.0)).metrics
    found = simulate(Experiment(duration=3.0, law=law)).metrics
    assert found.rms_error_rad == pytest.approx(default.rms_error_rad, rel=0.25)
    assert found.rms_error_rad != default.rms_error_rad


# --- derived arrays, for any law


class Tabled(Law):
    """A law with a table of its own."""

    steps: int = 5

    def derived(self):
        return {"table": np.arange(self.steps)}

    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            command.torque[i] = parameters.table[parameters.table.shape[0] - 1 - i]


@pytest.mark.parametrize("count", [5, 9])
def test_a_laws_derived_arrays_reach_its_step(count):
    law, given = Tabled(steps=count), signals(2)
    expected = [[count - 1.0, count - 2.0, count - 3.0]] * 2
    assert steps(law, given)[0]["torque"].tolist() == expected
    assert compiled_steps(law, given)[0]["torque"].tolist() == expected
    assert law.layout().names[:2] == ("steps", "table")


def test_a_derived_array_must_not_take_a_parameters_name():
    class Twice(Tabled):
        def derived(self):
            return {"steps": np.ones(3)}

    with pytest.raises(LawError, match=r"derived\(\) returns 'steps'") as caught:
        Twice().packed()
    one_line(caught.value)
