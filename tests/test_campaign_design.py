"""Designs and distributions of campaigns, against SciPy's own, and episodes made of them."""

import json
import tomllib
from itertools import product
from math import log
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from scipy.stats import qmc

from rigs import one_line
from spherical_wrist import Experiment
from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.design import draw, episode_seed
from spherical_wrist.campaign.distribution import FORMS, distribution
from spherical_wrist.campaign.episode import changed
from spherical_wrist.campaign.validation import validate
from spherical_wrist.errors import ParameterError, UnknownNameError, WristError

UNIT = {"u": distribution("u", {"uniform": [0.0, 1.0]}), "v": distribution("v", {"uniform": [0.0, 1.0]})}
MIXED = {
    "mass_scale": distribution("mass_scale", {"loguniform": [0.5, 2.0]}),
    "com_shift.x": distribution("com_shift.x", {"normal": [0.0, 1e-3]}),
    "payload": distribution("payload", [0.0, 0.01, 0.02]),
}


@pytest.mark.parametrize(
    ("table", "same"),
    [
        ({"uniform": [-1.0, 3.0]}, stats.uniform(-1.0, 4.0)),
        ({"loguniform": [1e-3, 10.0]}, stats.loguniform(1e-3, 10.0)),
        ({"normal": [2.0, 0.5]}, stats.norm(2.0, 0.5)),
        ({"truncated_normal": [1.0, 0.5, 0.0, 1.2]}, stats.truncnorm(-2.0, 0.4, 1.0, 0.5)),
        ({"truncated_normal": [0.0, 1.0, 8.0, 9.0]}, stats.truncnorm(8.0, 9.0)),
        ({"truncated_normal": [0.0, 1.0, -9.0, -8.0]}, stats.truncnorm(-9.0, -8.0)),
    ],
)
@given(u=st.floats(1e-6, 1.0 - 1e-6))
def test_continuous_distributions_are_scipys(table, same, u):
    assert distribution("x", table).value(u) == pytest.approx(same.ppf(u), rel=1e-9, abs=1e-12)


@given(u=st.floats(0.0, 1.0))
def test_bounded_distributions_keep_their_bounds_and_all_are_finite(u):
    for name, (low, high) in {"uniform": (0.1, 0.3), "loguniform": (0.1, 0.3), "normal": (-100.0, 100.0)}.items():
        arguments = [low, high] if name != "normal" else [0.0, 1.0]
        assert low <= distribution("x", {name: arguments}).value(u) <= high
    assert 0.1 <= distribution("x", {"truncated_normal": [5.0, 1.0, 0.1, 0.3]}).value(u) <= 0.3


def test_countable_distributions_give_each_value_its_share():
    def values(table, count):
        return [distribution("x", table).value((k + 0.5) / count) for k in range(count)]

    assert values({"integers": [-1, 2]}, 8) == [-1, -1, 0, 0, 1, 1, 2, 2]
    assert values([True, "a", 3.5], 3) == [True, "a", 3.5]
    assert values({"linear": [1.0, 2.0, 5]}, 5) == [1.0, 1.25, 1.5, 1.75, 2.0]
    assert values({"logarithmic": [1e-3, 10.0, 5]}, 5) == pytest.approx([1e-3, 1e-2, 0.1, 1.0, 10.0])
    assert values({"constant": [1, 2]}, 2) == [[1, 2], [1, 2]]
    assert values(0.25, 2) == [0.25, 0.25]


@pytest.mark.parametrize(
    ("table", "kind"),
    [([1, 2], "integer"), ([1, 2.0], "number"), ([True], "boolean"), (["a"], "text"), ([[1], "a"], "table")],
)
def test_a_choice_knows_what_its_values_are(table, kind):
    assert distribution("x", table).kind == kind


@pytest.mark.parametrize(
    "table",
    [
        {"uniform": [1.0, 1.0]},
        {"uniform": [0.0, 1.0, 2.0]},
        {"uniform": 3},
        {"uniform": ["a", "b"]},
        {"uniform": [0.0, float("nan")]},
        {"uniform": [False, True]},
        {"loguniform": [0.0, 1.0]},
        {"normal": [0.0, -1.0]},
        {"truncated_normal": [0.0, 1.0, 2.0, 1.0]},
        {"truncated_normal": [0.0, 1.0, 50.0, 60.0]},
        {"integers": [2, 1]},
        {"integers": [0.5, 1]},
        {"linear": [0.0, 1.0, 1]},
        {"linear": [0.0, 1.0, 2.5]},
        {"logarithmic": [-1.0, 1.0, 3]},
        {"choice": []},
        {"uniform": [0, 1], "normal": [0, 1]},
        {},
    ],
)
def test_what_is_no_distribution_is_refused(table):
    with pytest.raises(ParameterError) as error:
        distribution("mass_scale", table)
    assert "mass_scale" in one_line(error.value)


def test_the_nearest_distribution_is_named():
    with pytest.raises(UnknownNameError, match="did you mean 'uniform'"):
        distribution("x", {"unifrom": [0, 1]})
    assert set(FORMS) == {
        *("uniform", "loguniform", "normal", "truncated_normal", "integers", "choice", "constant", "linear"),
        "logarithmic",
    }


@pytest.mark.parametrize("design", ["sobol", "latin_hypercube", "random"])
@given(first=st.integers(0, 60), count=st.integers(1, 40))
def test_any_part_of_a_design_is_that_part_of_the_whole(design, first, count):
    whole = draw(design, MIXED, 100, 3, 0, 100)
    assert draw(design, MIXED, 100, 3, first, first + count) == whole[first : first + count]
    assert draw(design, MIXED, 100, 4, first, first + count) != whole[first : first + count]


def test_a_latin_hypercube_has_one_value_in_every_slice():
    points = draw("latin_hypercube", UNIT, 50, 1, 0, 50)
    for name in UNIT:
        assert sorted(int(point[name] * 50) for point in points) == list(range(50))


def test_a_sobol_sequence_is_as_even_as_scipys_and_a_random_design_is_not():
    def unevenness(design):
        return qmc.discrepancy([list(point.values()) for point in draw(design, UNIT, 256, 1, 0, 256)])

    theirs = qmc.discrepancy(qmc.Sobol(2, rng=np.random.default_rng(0)).random(256))
    assert unevenness("sobol") == pytest.approx(theirs, rel=0.5)
    assert unevenness("random") > 10.0 * unevenness("sobol")
    boxes = {(int(16 * p["u"]), int(16 * p["v"])) for p in draw("sobol", UNIT, 256, 1, 0, 256)}
    assert len(boxes) == 256  # a (0, m, 2)-net: one point in each of the boxes


def test_a_random_design_is_independent_and_uniform():
    points = np.array([list(point.values()) for point in draw("random", UNIT, 4000, 1, 0, 4000)])
    assert abs(np.corrcoef(points.T)[0, 1]) < 0.05
    assert all(stats.kstest(column, "uniform").pvalue > 1e-3 for column in points.T)


def test_a_grid_is_every_combination_in_order():
    vary = {"a": distribution("a", [1, 2]), "b": distribution("b", {"integers": [0, 2]})}
    points = draw("grid", vary, 6, 0, 0, 6)
    assert [tuple(point.values()) for point in points] == list(product([1, 2], range(3)))
    assert draw("grid", vary, 6, 0, 4, 5) == points[4:5]


def test_seeds_differ_from_sample_to_sample_and_fit_into_64_bits():
    seeds = {episode_seed(seed, sample) for seed in range(3) for sample in range(1000)}
    assert len(seeds) == 3000
    assert all(0 <= seed < 2**63 for seed in seeds)
    assert max(seeds) > 2**62


def campaign(**changes):
    given = {"laws": ["pd", "computed_torque"], "samples": 4, "vary": {"mass_scale": {"uniform": [0.5, 1.5]}}}
    return Campaign(**{**given, **changes})


def test_ids_are_positions_in_the_design_and_laws_share_samples():
    made = campaign()
    episodes = list(made.episodes(0, made.size))
    assert [episode.id for episode in episodes] == list(range(8))
    assert [episode.sample for episode in episodes] == [0, 0, 1, 1, 2, 2, 3, 3]
    assert [episode.law for episode in episodes] == ["pd", "computed_torque"] * 4
    for one, other in zip(episodes[::2], episodes[1::2], strict=True):
        assert (one.seed, one.values) == (other.seed, other.values)
        assert one.experiment().replaced(law="computed_torque") == other.experiment()
    assert [e.experiment() for e in made.episodes(3, 6)] == [e.experiment() for e in episodes[3:6]]


def test_a_design_of_a_billion_is_not_held_in_memory():
    made = campaign(samples=10**9)
    (episode,) = made.episodes(10**9, 10**9 + 1)
    assert (episode.id, episode.sample) == (10**9, 5 * 10**8)


def test_the_campaigns_seed_decides_everything():
    one, same, other = campaign(seed=1), campaign(seed=1), campaign(seed=2)
    assert [e.experiment() for e in one.episodes(0, 8)] == [e.experiment() for e in same.episodes(0, 8)]
    a, b = next(one.episodes(0, 1)), next(other.episodes(0, 1))
    assert a.seed != b.seed
    assert a.values != b.values


def test_every_kind_of_parameter_can_be_changed():
    base = Experiment(law="computed_torque")
    values = {
        "mass_scale": 0.7,
        "com_shift.y": 1e-3,
        "disturbance.level": 0.1,
        "reference.amplitude": 0.2,
        "reference.phase.z": 0.3,
        "law.Kp.x": 100,
        "law.Kv": 30,
        "sensing.delay": 1e-3,
    }
    made = changed(base, values)
    assert (made.mass_scale, made.com_shift) == (0.7, (0.0, 1e-3, 0.0))
    assert (made.disturbance.name, made.disturbance.level) == ("constant", 0.1)
    assert (made.reference.amplitude, made.reference.phase) == ((0.2, 0.2, 0.2), (0.0, 0.0, 0.3))
    assert (made.law.Kp, made.law.Kv) == ((100.0, 400.0, 400.0), (30.0, 30.0, 30.0))
    assert made.sensing.delay == 1e-3
    untouched = {"damping", "friction", "duration", "actuation", "initial_error"}
    assert all(getattr(made, name) == getattr(base, name) for name in untouched)


@given(order=st.permutations(["disturbance.name", "disturbance.level", "disturbance.bandwidth", "reference"]))
def test_names_are_changed_before_what_belongs_to_them(order):
    values = {
        "disturbance.name": "noise",
        "disturbance.level": 0.4,
        "disturbance.bandwidth": 5.0,
        "reference": {"name": "sinusoid", "frequency": 2.0},
    }
    made = changed(Experiment(), {name: values[name] for name in order})
    told = made.disturbance
    assert (told.name, told.level, told.bandwidth, made.reference.frequency) == ("noise", 0.4, 5.0, 2.0)


def test_a_changed_name_keeps_the_size_of_the_disturbance_only():
    base = Experiment(disturbance={"name": "sinusoid", "level": 0.4, "frequency": 7.0})
    assert changed(base, {"disturbance.name": "noise"}).disturbance.level == 0.4
    same = changed(base, {"disturbance.name": "sinusoid"}).disturbance
    assert (same.level, same.frequency) == (0.4, 7.0)


def test_the_documented_campaign_file_is_valid_and_means_what_it_says():
    text = Campaign.from_toml.__globals__["__doc__"].split("::\n", 1)[1].split("\n\nDistributions are", 1)[0]
    made = Campaign(**tomllib.loads(text))
    assert made.size == 3000
    validate(made)
    assert list(made.bases) == ["pd", "fuzzy_sliding_computed_torque", "computed_torque Kp=10000 Kv=200"]
    assert made.bases["computed_torque Kp=10000 Kv=200"].law.Kp == (1e4, 1e4, 1e4)
    episodes = [episode.experiment() for episode in made.episodes(0, 300)]
    assert {e.sensing.name for e in episodes} == {"realistic"}
    assert {e.payload for e in episodes} == {0.0, 0.01, 0.02}
    assert all(0.0 <= e.disturbance.level <= 0.5 and e.disturbance.name == "noise" for e in episodes)
    assert all(len(set(e.reference.amplitude)) == 1 and len(set(e.initial_error)) == 3 for e in episodes)
    assert all(e.com_shift[0] != 0.0 == e.com_shift[1] for e in episodes)


def test_the_example_is_valid():
    validate(Campaign.from_toml(Path(__file__).parents[1] / "scripts" / "campaign.toml"))


def test_a_campaign_survives_json_and_resolving(tmp_path, monkeypatch):
    (tmp_path / "law.py").write_text(
        "from spherical_wrist.control import Law\n\nclass Mine(Law):\n    gain: float = 1.0\n\n"
        "    @staticmethod\n    def step(signal, parameters, state, command):\n"
        "        for i in range(3):\n            command.torque[i] = parameters.gain * signal.error[i]\n"
    )
    monkeypatch.chdir(tmp_path)
    made = campaign(laws={"a": "law.py:Mine", "b": {"name": "law.py:Mine", "gain": 2.0}}).resolved()
    monkeypatch.chdir("/")
    again = Campaign.from_json(made.to_json())
    assert again == made == made.resolved()
    assert [e.experiment() for e in again.episodes(0, 8)] == [e.experiment() for e in made.episodes(0, 8)]
    assert [e.experiment().law.gain for e in again.episodes(0, 2)] == [1.0, 2.0]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"vary": {"mass_scal": [1]}}, "did you mean 'mass_scale'"),
        ({"vary": {"law.K": [1]}}, "law pd: unknown parameter 'K'"),
        ({"vary": {"disturbance.levle": [1]}}, "did you mean 'level'"),
        ({"vary": {"com_shift.w": [1]}}, "unknown axis of com_shift 'w'"),
        ({"vary": {"mass_scale.x": [1]}}, "no axes"),
        ({"vary": {"law": ["pd"]}}, "give laws"),
        ({"vary": {"mass_scale": {"unifrm": [0, 1]}}}, "unknown distribution"),
        ({"vary": {"mass_scale": ["heavy"]}}, "vary mass_scale"),
        ({"vary": {"com_shift.*": [0.0], "com_shift.x": [0.1]}}, "varied twice"),
        ({"laws": ["pd", "pd"]}, "twice"),
        ({"laws": ["pid"]}, "did you mean 'pd'"),
        ({"laws": []}, "laws"),
        ({"laws": "pd"}, "laws"),
        ({"laws": ["pd"], "experiment": {"law": "pd"}}, "give one of them"),
        ({"experiment": {"duratoin": 1.0}}, "experiment: unknown parameter 'duratoin'"),
        ({"design": "sobel"}, "design"),
        ({"design": "grid"}, "a grid needs values"),
        ({"design": "grid", "vary": {"mass_scale": [0.5, 1.0]}}, "2 points"),
        ({"samples": None}, "samples"),
        ({"samples": 0}, "samples"),
        ({"samples": 2**33}, "Sobol"),
        ({"sampels": 3}, "did you mean 'samples'"),
        ({"hardware": "perfect"}, "unknown hardware"),
        ({"seed": -1}, "seed"),
    ],
)
def test_what_is_no_campaign_gets_one_clear_line(changes, said):
    with pytest.raises(WristError) as error:
        campaign(**changes)
    assert said in one_line(error.value)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"vary": {"mass_scale": {"uniform": [-0.5, 1.0]}}}, "mass_scale = -0."),
        ({"vary": {"payload": {"normal": [0.01, 0.01]}}, "samples": 1000}, "truncated_normal"),
        ({"vary": {"payload": [0.0, -0.01]}}, "payload = -0.01"),
        ({"vary": {"duration": {"uniform": [1.0, 2.0]}}}, "multiple"),
        ({"vary": {"control_period": {"linear": [0.001, 0.002, 3]}}}, "control_period = 0.0015"),
        ({"experiment": {"disturbance": {"amplitude": 0.1}}, "vary": {"disturbance.level": [0.1]}}, "no effect"),
        ({"experiment": {"model": "none.xml"}}, "none.xml"),
    ],
)
def test_what_cannot_be_run_is_found_before_the_first_episode(changes, said):
    with pytest.raises(WristError) as error:
        validate(campaign(**changes))
    assert said in one_line(error.value)


def test_a_tail_beyond_what_is_expected_is_no_fault_of_the_design():
    validate(campaign(samples=20, vary={"payload": {"normal": [0.03, 0.01]}}))


def test_values_are_json_and_the_logarithm_is_even():
    points = draw("latin_hypercube", {"x": distribution("x", {"loguniform": [1e-4, 1.0]})}, 100, 0, 0, 100)
    assert json.loads(json.dumps(points)) == points
    slices = sorted(int(100 * (log(point["x"]) - log(1e-4)) / -log(1e-4)) for point in points)
    assert slices == list(range(100))
