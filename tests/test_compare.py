"""Comparisons: ranking, cases, laws, commands that replay, files, and what `wrist compare` prints."""

import csv
import json
import re
import shlex
import signal
import subprocess
import sys
import time
from itertools import chain, product
from math import inf
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from matplotlib.image import imread
from scipy.stats import bootstrap

from picture_checks import overlaps
from rigs import one_line
from sampling import count, some
from spherical_wrist import Experiment, load_recording, simulate
from spherical_wrist.cli import main
from spherical_wrist.cli.compare import print_comparison
from spherical_wrist.cli.results import ResultFiles
from spherical_wrist.comparison.cases import DEFAULT, FAULTY, IDEAL, Case, group_of, read_cases, select
from spherical_wrist.comparison.compare import compare
from spherical_wrist.comparison.comparison_table import comparison_table
from spherical_wrist.comparison.law_selection import (
    law_from_text,
    law_option,
    law_text,
    law_value,
    laws_from_texts,
    named_laws,
    registered,
)
from spherical_wrist.comparison.picture import comparison_picture
from spherical_wrist.comparison.ranking import (
    combined_error,
    geometric_mean,
    median_intervals,
    over_seeds,
    pareto_front,
    ranks,
    ratios,
)
from spherical_wrist.comparison.report import pareto_laws, to_dict
from spherical_wrist.comparison.results import Cell, Comparison
from spherical_wrist.control import PD, ComputedTorque, Law, SlidingMode
from spherical_wrist.disturbance import Noise
from spherical_wrist.errors import LawError, ParameterError, UnknownNameError, WristError
from spherical_wrist.experiment.command import command_of, read_settings
from spherical_wrist.experiment.description import PARTS, with_changes
from spherical_wrist.experiment.presets import HARDWARE
from spherical_wrist.experiment.randomness import is_random
from spherical_wrist.loop.outcome import Outcome, Status
from spherical_wrist.measure.metrics import METRICS, Metrics
from spherical_wrist.picture_style import STYLE, WIDTHS
from spherical_wrist.reference import Step
from spherical_wrist.result_table import as_latex, as_markdown
from spherical_wrist.sensing import Realistic as RealisticSensing

LAW = """
from spherical_wrist.control import Law

class Spring(Law):
    stiffness: float = 0.1
    damping: float = 0.01

    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            spring = parameters.stiffness * signal.error[i] + parameters.damping * signal.rate_error[i]
            command.torque[i] = spring + signal.N[i]
"""
WRIST = [sys.executable, "-c", "from spherical_wrist.cli import main; main()"]
QUICK = ["--law", "pd", "--law", "sliding_mode", "--case", "constant-heavy", "--duration", "0.2"]


# --- ranks, scores and fronts

ERRORS = {"a": 2e-3, "b": 1e-3, "c": inf, "d": 1e-3, "e": 4e-3}


def test_ranks_and_ratios_of_numbers_worked_out_by_hand():
    assert ranks(ERRORS) == {"b": 1, "d": 1, "a": 3, "e": 4, "c": 5}
    assert ratios(ERRORS) == pytest.approx({"a": 2.0, "b": 1.0, "c": inf, "d": 1.0, "e": 4.0})
    assert ratios({"a": inf}) == {"a": inf}
    assert combined_error(4e-4, 9e-2) == pytest.approx(6e-3)
    assert combined_error(0.0, 0.0) == pytest.approx(combined_error(1e-12, 1e-9))
    assert combined_error(None, 1.0) == combined_error(1.0, None) == inf
    assert over_seeds(np.array([[1.0, 9.0, 2.0], [1.0, inf, 1.0]])).tolist() == [2.0, inf]
    assert geometric_mean([2.0, 8.0]) == pytest.approx(4.0)
    assert geometric_mean([]) is None


coordinate = st.sampled_from([0.5, 1.0, 2.0, 3.0, 5.0])


@given(st.dictionaries(st.text(min_size=1, max_size=3), st.tuples(coordinate, coordinate), max_size=12))
def test_the_pareto_front_is_what_comparing_every_pair_gives(points):
    def beaten(p):
        return any(q[0] <= p[0] and q[1] <= p[1] and q != p for q in points.values())

    found = pareto_front(points)
    assert sorted(found) == sorted(name for name, point in points.items() if not beaten(point))
    assert [points[name][0] for name in found] == sorted(points[name][0] for name in found)


NAN = dict.fromkeys(METRICS)


def cell(law, case, seed, error, chattering=1.0):
    """A cell that never ran; one without an error diverged. An error is one number, or two: of attitude and tip."""
    outcome = Outcome(Status.COMPLETED, 10.0) if error is not None else Outcome(Status.DIVERGED, 3.0, "too fast")
    attitude, tip = error if isinstance(error, tuple) else (error, error)
    errors = {"rms_error_rad": attitude or 1e-9, "rms_tip_error_mm": tip or 1e-9}
    metrics = Metrics({**NAN, **errors, "chattering_Nm_per_s": chattering})
    return Cell(law, case, seed, Experiment(), outcome, metrics)


def comparison(table, chattering=None, calm=None):
    """A comparison from errors by law: a list with an entry for each case, which is a list if there are seeds."""
    count = len(next(iter(table.values())))
    names = [f"case-{number}" for number in range(count)]
    cases = tuple(Case(name, "", {}) for name in names)
    chattering = chattering or {law: [1.0] * count for law in table}
    runs = {law: [each if isinstance(each, list) else [each] for each in errors] for law, errors in table.items()}
    seeds = {name: tuple(range(len(runs[next(iter(runs))][place]))) for place, name in enumerate(names)}
    cells = {
        (law, name, seed): cell(law, name, seed, error, amount)
        for law, errors in runs.items()
        for name, of_seeds, amount in zip(names, errors, chattering[law], strict=True)
        for seed, error in enumerate(of_seeds)
    }
    laws = dict.fromkeys(table, ComputedTorque())
    calm = calm or dict.fromkeys(names, 1.0)
    calm = {(name, seed): calm[name] for name in names for seed in seeds[name]}
    return Comparison(laws, cases, seeds, cells, calm, 0.0)


def test_laws_are_ranked_by_the_median_of_the_ratios_to_the_best_and_then_by_the_worst():
    """Ratios 1, 4, 2 and 2, 1, 2 and 3, 3, 1."""
    rows = comparison({"x": [1e-3, 4e-2, 2e-5], "y": [2e-3, 1e-2, 2e-5], "z": [3e-3, 3e-2, 1e-5]}).standings()
    assert [(row.law, row.rank, row.wins, row.close) for row in rows] == [
        ("y", 1, 1, 1),
        ("x", 2, 1, 1),
        ("z", 3, 1, 1),
    ]
    assert [row.median_ratio for row in rows] == pytest.approx([2.0, 2.0, 3.0])
    assert [(row.worst_ratio, row.worst_case) for row in rows] == [
        (pytest.approx(2.0), "case-0"), (pytest.approx(4.0), "case-1"), (pytest.approx(3.0), "case-0")
    ]  # fmt: skip


def test_within_5_percent_of_the_best_counts_beside_the_wins():
    rows = comparison({"best": [1.0, 1.0], "near": [1.049, 1.051]}).standings()
    assert [(row.law, row.wins, row.close) for row in rows] == [("best", 2, 2), ("near", 0, 1)]


def test_a_wrist_that_spins_about_the_axis_of_its_tip_is_not_precise():
    found = comparison({"spins": [(1.0, 1e-3)], "tracks": [(1e-4, 1.5e-3)]})
    best, other = found.case_standings("case-0").values()
    assert (best.law, other.law) == ("tracks", "spins")
    assert other.ratio == pytest.approx(np.sqrt(1e4 / 1.5))
    assert (other.attitude_ratio, other.tip_ratio, best.tip_ratio) == pytest.approx((1e4, 1.0, 1.5))


def test_a_lost_run_counts_as_infinitely_worse_than_the_best():
    found = comparison({"good": [1e-6, 1e-6, None], "bad": [1e-1, 1e-1, 1e-1], "worst": [None, None, None]})
    rows = found.standings()
    assert [(row.law, row.median_ratio, row.worst_ratio, row.wins, row.lost) for row in rows] == [
        ("good", 1.0, inf, 2, ("case-2",)),
        ("bad", pytest.approx(1e5), pytest.approx(1e5), 1, ()),
        ("worst", inf, inf, 0, ("case-0", "case-1", "case-2")),
    ]
    half = comparison({"good": [1e-6, None], "bad": [1e-1, 1e-1]}).standings()
    assert [(row.law, row.median_ratio) for row in half] == [("bad", pytest.approx(0.5e5 + 0.5)), ("good", inf)]
    assert not [row.law for row in comparison({"a": [None], "b": [None]}).standings() if row.wins or row.close]


def test_a_case_counts_once_with_the_median_over_its_seeds_and_is_lost_with_one_of_them():
    found = comparison({"a": [[1.0, 1.0, 9.0], 2.0], "b": [[2.0, 2.0, 1.0], 1.0], "c": [[1.0, None, 1.0], 3.0]})
    by_law = found.case_standings("case-0")
    assert {law: row.ratio for law, row in by_law.items()} == pytest.approx({"a": 1.0, "b": 2.0, "c": inf})
    assert by_law["a"].range == pytest.approx((1.0, 9.0))
    assert (by_law["c"].lost, by_law["c"].range.high) == ((1,), inf)
    worst = {row.law: (row.worst_case, row.worst_seed, row.lost_runs, row.runs) for row in found.standings()}
    assert worst == {"a": ("case-0", 2, 0, 4), "b": ("case-0", 0, 0, 4), "c": ("case-0", 1, 1, 4)}


def test_the_interval_of_a_median_is_that_of_scipys_bootstrap():
    """With one seed a case, and a best law that is the same everywhere, only the cases are drawn."""
    ratio = np.exp(np.random.default_rng(1).normal(1.0, 0.5, 25))
    (best, other) = median_intervals([np.array([[1.0], [each]]) for each in ratio])
    scipy = bootstrap((ratio,), np.median, method="percentile", n_resamples=5000, rng=2).confidence_interval
    assert best == (1.0, 1.0)
    assert other == pytest.approx(scipy, rel=0.1)


def test_the_interval_of_a_median_also_covers_the_seeds():
    one = np.array([[1.0, 1.0, 1.0], [2.0, 3.0, 4.0]])
    assert median_intervals([one])[1] == (2.0, 4.0)
    lost = np.array([[1.0, 1.0, 1.0], [2.0, inf, 4.0]])
    assert median_intervals([lost])[1].high == inf


def test_equal_laws_share_a_rank():
    rows = comparison({"a": [2.0], "b": [1.0], "c": [2.0], "d": [4.0]}).standings()
    assert [row.rank for row in rows] == [1, 2, 2, 4]


def test_chattering_is_compared_with_computed_torque_on_the_same_case():
    found = comparison(
        {"a": [1e-3, 1e-3, None]}, {"a": [6.0, 6.0, 6.0]}, {"case-0": 2.0, "case-1": None, "case-2": 2.0}
    )
    figures = [found.figure(found.cells["a", case.name, 0], "chattering_ratio") for case in found.cases]
    assert figures == [3.0, None, None]
    assert found.spread("a", ["case-0", "case-1"], "chattering_ratio") == pytest.approx((3.0, 3.0, 3.0))


def test_a_spread_is_over_completed_runs():
    found = comparison({"a": [1.0, 4.0, None]})
    assert found.spread("a", [case.name for case in found.cases], "rms_error_rad") == pytest.approx((1.0, 2.0, 4.0))


def test_chattering_that_differs_in_the_fourth_digit_does_not():
    table = {"precise": [1e-5], "poor": [1e-3], "calm": [1e-2]}
    found = comparison(table, {"precise": [1.0001], "poor": [1.0], "calm": [0.9]})
    assert pareto_laws(found, ["case-0"]) == ["calm", "precise"]
    table["precise"] = [None]
    assert pareto_laws(comparison(table, {"precise": [0.1], "poor": [1.0], "calm": [0.9]}), ["case-0"]) == [
        "calm",
        "poor",
    ]


# --- cases


SUITE = {case.name: case.experiment({}, {}) for case in DEFAULT}


def test_every_case_of_the_suite_says_what_it_shows_and_is_another_experiment():
    assert len(SUITE) == len(DEFAULT)
    assert all(case.meaning and case.discriminates for case in DEFAULT)
    for name in ("meaning", "discriminates"):
        assert len({getattr(case, name) for case in DEFAULT}) == len(DEFAULT)
    assert len({each.replaced(duration=1.0) for each in SUITE.values()}) == len(SUITE)


def test_the_suite_has_what_tells_laws_apart():
    """Motions, wrists, masses, frequencies, sensors and errors, each by what the experiments are."""
    suite = SUITE.values()
    assert {each.reference.name for each in suite} == {"lissajous", "beating_heart", "suture", "step", "recorded"}
    assert len({each.model for each in suite}) == 3
    masses = {each.mass_scale for each in suite}
    assert (min(masses), max(masses)) == (0.5, 2.0)
    assert max(each.payload for each in suite) == 0.05
    assert any(each.com_shift != (0.0, 0.0, 0.0) for each in suite)
    assert {getattr(each.disturbance, "frequency", 0.0) for each in suite} >= {0.0, 5.0, 15.0, 40.0}
    worst = [each for each in suite if each.disturbance.name == "worst"]
    assert {each.sensing.delay > 0.0 for each in worst} == {True, False}
    assert all(case.judged == "largest" for case in DEFAULT if SUITE[case.name] in worst)
    late = [each.sensing for each in suite if each.sensing.delay >= 1e-3]
    assert {each.timestamped for each in late} == {True, False}
    assert max(each.sensing.loss for each in suite) >= 0.1
    assert max(each.actuation.lag for each in suite) >= 1e-3
    blind = [each.sensing for each in suite if each.sensing.rate == "estimated"]
    assert blind
    assert all(each.attitude_noise > 0.0 for each in blind)
    noise = RealisticSensing()
    assert any(
        (each.sensing.attitude_noise, each.sensing.rate_noise) == (10.0 * noise.attitude_noise, 10.0 * noise.rate_noise)
        for each in suite
    )
    assert max(np.linalg.norm(each.initial_error) for each in suite) > 1.0
    assert max(each.friction for each in suite) >= 5e-3
    assert {is_random(each) for each in suite} == {True, False}


def test_an_experiment_may_say_how_long_a_case_takes():
    case = Case("short", "", {}, duration=3.0)
    assert case.experiment({}, {}).duration == 3.0
    assert case.experiment({"duration": 7.0}, {}).duration == 7.0
    assert case.experiment({"duration": 7.0}, {"duration": 1.0}).duration == 1.0


def test_settings_that_replace_what_a_case_is_about_are_named():
    case = Case("x", "", {"model": "slender_hand", "disturbance.name": "sinusoid", "disturbance.level": 0.25})
    assert case.overridden({"model": "a.xml", "duration": 1.0}) == ["model"]
    assert case.overridden({"disturbance.level": 1.0, "law.K": 1.0}) == []
    assert case.overridden({"disturbance": 0.1}) == ["disturbance.name"]


def test_a_case_changes_the_experiment_and_settings_change_the_case():
    case = Case("x", "", {"disturbance.name": "noise", "mass_scale": 0.5, "sensing.delay": 0.002})
    made = case.experiment(
        {"payload": 0.01, "mass_scale": 2.0, "sensing": {"loss": 0.1}}, {"disturbance.bandwidth": 5.0}
    )
    assert (made.payload, made.mass_scale, made.disturbance.bandwidth) == (0.01, 0.5, 5.0)
    assert (made.sensing.delay, made.sensing.loss) == (0.002, 0.1)
    assert group_of(made) == FAULTY
    assert group_of(Experiment(friction=1e-3)) == group_of(Experiment(actuation="spherical_motor")) == FAULTY


def test_a_suite_of_ones_own(tmp_path):
    file = tmp_path / "cases.toml"
    file.write_text(
        "[[case]]\nname = 'late'\nmeaning = 'two samples'\njudged = 'largest'\n"
        "discriminates = 'prediction'\nsensing.delay = 0.002\nmass_scale = 1.5\n"
        "[[case]]\nname = 'noisy'\ndisturbance = {bandwidth = 5.0, name = 'noise', level = 0.1}\n"
    )
    late, noisy = read_cases(file)
    assert (late.name, late.meaning, late.judged, late.discriminates) == (
        "late",
        "two samples",
        "largest",
        "prediction",
    )
    assert (noisy.judged, noisy.figures) == ("rms", ("rms_error_rad", "rms_tip_error_mm"))
    made = late.experiment({}, {})
    assert (made.sensing.delay, made.mass_scale, made.disturbance.level) == (0.002, 1.5, 0.25)
    # the parameters of another shape in the experiment do not stay
    made = noisy.experiment({"disturbance": {"name": "sinusoid", "frequency": 3.0}}, {})
    assert made.disturbance == Noise(bandwidth=5.0, level=0.1)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "cannot be read"),
        ("[[case", "not valid TOML"),
        ("", "[[case]]"),
        ("case = 3", "[[case]]"),
        ("duration = 3\n[[case]]\nname = 'a'", "[[case]]"),
        ("[[case]]\nmass_scale = 1", "case 1: a name is needed"),
        ("[[case]]\nname = 'a'\nlaw = 'pd'", "cannot set the law"),
        ("[[case]]\nname = 'a'\njudged = 'largst'", "unknown judged 'largst'; did you mean 'largest'"),
        ("[[case]]\nname = 'a'\n[[case]]\nname = 'a'", "two cases are called 'a'"),
    ],
)
def test_a_wrong_suite_is_one_line(tmp_path, text, said):
    file = tmp_path / "cases.toml"
    if text is not None:
        file.write_text(text)
    with pytest.raises(ParameterError) as error:
        read_cases(file)
    assert said in one_line(error.value)


def test_a_wrong_case_says_which_one_it_is():
    with pytest.raises(ParameterError) as error:
        Case("odd", "", {"mas_scale": 1.0}).experiment({}, {})
    assert one_line(error.value).startswith("case 'odd': unknown parameter 'mas_scale'; did you mean 'mass_scale'?")
    with pytest.raises(UnknownNameError, match="did you mean 'realistic'"):
        select(DEFAULT, ["realistc"])
    assert [case.name for case in select(DEFAULT, ["friction", "worst", "friction"])] == ["friction", "worst"]
    assert select(DEFAULT, []) == DEFAULT


def test_seeds_are_run_where_something_is_random_in_motion_or_disturbance():
    """Two seeds give other figures, or the same."""
    settings = [f"{part}.name={name}" for part in ("disturbance", "reference") for name in PARTS[part].members]
    settings = [each for each in settings if not each.endswith(("=worst", "=recorded"))]
    for each in some(settings, 3):
        made = Experiment(
            **with_changes({"law": "pd", "duration": 0.03, "disturbance": {"amplitude": 0.005}}, read_settings([each]))
        )
        first, second = (simulate(made.replaced(seed=seed), keep_series=False).metrics for seed in (0, 1))
        assert (first != second) == is_random(made), each
    assert not is_random(Experiment(disturbance={"name": "steps", "level": 0.0}))
    assert not is_random(Experiment(disturbance="worst"))


# --- selection of laws


def test_every_law_of_the_package_takes_part():
    assert laws_from_texts([], {}, {}) == {name: law() for name, law in Law.members.items()} == registered()


def test_laws_with_parameters_from_files_and_from_experiments(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("my laws").mkdir()
    Path("my laws/spring.py").write_text(LAW)
    Path("tuned.toml").write_text('mass_scale = 3.0\n[law]\nname = "computed_torque"\nKv = 10\n')
    texts = [
        "pd",
        "computed_torque Kp=[1, 2, 3]  Kv = 4 prediction=false",
        "my laws/spring.py:Spring stiffness=0.3",
        "tuned.toml",
        "tuned.toml Kv=20",
    ]
    laws = laws_from_texts(texts, {"law": {"name": "sliding_mode"}}, {"mass_scale": 1.0})
    assert list(laws) == texts
    plain, gains, spring, tuned, changed = laws.values()
    assert plain == PD()
    assert gains == ComputedTorque(Kp=(1, 2, 3), Kv=4, prediction=False)
    assert (spring.name, spring.stiffness) == ("spring", 0.3)
    assert (tuned, changed) == (ComputedTorque(Kv=10), ComputedTorque(Kv=20))


def test_the_law_of_the_experiment_joins_where_it_is_another():
    assert laws_from_texts([], {"law": "pd"}, {}) == registered()
    laws = laws_from_texts([], {"law": {"name": "pd", "P": 0.3}}, {})
    assert laws == {**registered(), "pd P=0.3": PD(P=0.3)}


def test_a_law_with_a_name_of_its_own_can_be_typed_back(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("spring.py").write_text(LAW)
    laws = laws_from_texts(
        ["mine = spring.py:Spring stiffness=0.3", "stiff=pd P=[1, 2, 3]", "pd", "./a=b/../spring.py:Spring"], {}, {}
    )
    assert list(laws) == ["mine", "stiff", "pd", "./a=b/../spring.py:Spring"]
    assert (laws["mine"].stiffness, laws["mine"].status, laws["stiff"]) == (0.3, "user", PD(P=(1, 2, 3)))
    options = {label: law_option(label, law) for label, law in laws.items()}
    assert options["stiff"] == "stiff=pd P=[1,2,3]"
    assert laws_from_texts(options.values(), {}, {}) == laws
    rows = [{"law": label, "option": option} for label, option in options.items()]
    assert named_laws(rows) == [options["mine"], options["stiff"]]


@pytest.mark.parametrize("name", sorted(Law.members))
def test_the_text_of_a_law_makes_it_again(name):
    law = registered()[name]
    assert law_text(law) == name
    for field in type(law).model_fields:
        value = getattr(law, field)
        if isinstance(value, float) and value:
            law = law.replaced(**{field: 0.99 * value})
    assert law_from_text(law_text(law)) == law
    assert law_from_text(f"mine={law_text(law)}") == law
    assert Experiment(law=law_value(f"mine={law_text(law)}")).law == law


def test_settings_of_the_law_go_into_every_law():
    laws = laws_from_texts(["computed_torque", "sliding_computed_torque K=0.1"], {}, {"law.Kp": 100.0, "duration": 2.0})
    assert [law.Kp for law in laws.values()] == [(100.0, 100.0, 100.0)] * 2
    assert laws["sliding_computed_torque K=0.1"].K == (0.1, 0.1, 0.1)


@pytest.mark.parametrize(
    ("texts", "changes", "said"),
    [
        (["computed_tork"], {}, "did you mean 'computed_torque'"),
        (["computed_torque kp=1"], {}, "did you mean 'Kp'"),
        (["computed_torque Kp="], {}, "NAME=VALUE"),
        (["computed_torque Kp=[1,2]"], {}, "three"),
        (["none.py:Law"], {}, "no such file"),
        (["none.toml"], {}, "cannot be read"),
        (["empty.toml"], {}, "says nothing about the law"),
        (["pd", "pd"], {}, "given twice"),
        (["mine=pd", "mine=slotine_li"], {}, "'mine' is given twice"),
        (["pd=slotine_li"], {}, "pd is the name of another law"),
        (["mine="], {}, "mine=path/to/file.py:Law"),
        (["=pd"], {}, "mine=path/to/file.py:Law"),
        (["mine=computed_tork"], {}, "did you mean 'computed_torque'"),
        (["pd"], {"law.Kp": 1}, "law pd: unknown parameter 'Kp'"),
        (["pd"], {"law": "pd"}, "--law"),
        (["pd"], {"law.name": "pd"}, "--law"),
    ],
)
def test_a_wrong_law_is_one_line(tmp_path, monkeypatch, texts, changes, said):
    monkeypatch.chdir(tmp_path)
    Path("empty.toml").write_text("duration = 3.0\n")
    with pytest.raises(WristError) as error:
        laws_from_texts(texts, {}, changes)
    assert said in one_line(error.value)


# --- commands that replay


def replayed(monkeypatch, command):
    """The experiment that a command makes, found by running the command line up to the simulation."""
    made = []

    def catch(experiment, **_):
        made.append(experiment)
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr("spherical_wrist.simulation.simulate.simulate", catch)
        patched.setattr(sys, "argv", shlex.split(command))
        with pytest.raises(SystemExit):
            main()
    return made[0]


number = st.one_of(st.floats(1e-6, 1e6), st.integers(1, 1000).map(float), st.sampled_from([1e-5, 0.1, 1.0, 400.0]))
vector = st.one_of(number, st.tuples(number, number, number))
signed = st.tuples(*[st.one_of(number, number.map(lambda x: -x), st.just(0.0))] * 3)


def table(name, **parameters):
    """A table of a name and some of these parameters."""
    return st.fixed_dictionaries({"name": st.just(name)}, optional=parameters)


experiments = st.fixed_dictionaries(
    {},
    optional={
        "law": st.one_of(
            st.sampled_from(sorted(Law.members)),
            table("computed_torque", Kp=vector, Kv=vector, prediction=st.booleans()),
            table("sliding_computed_torque", K=vector, switching=st.sampled_from(["sign", "tanh"])),
            table("fuzzy_sliding_computed_torque", Kp=vector, error_scale=vector),
        ),
        "reference": st.one_of(
            table("lissajous", amplitude=vector, phase=signed),
            table("step", start=number, rotation=signed),
            table("recorded", file=st.sampled_from(["/a b/c,d.csv", "true", "inf", "12", "a=b", " x ", "/x'y\".csv"])),
        ),
        "disturbance": st.one_of(
            table("constant", level=number, amplitude=number),
            table("noise", level=number, bandwidth=number),
            table("sinusoid", frequency=number, phase=signed),
        ),
        "sensing": st.one_of(
            st.sampled_from(["ideal", "realistic"]),
            table("ideal", attitude_noise=number, rate_bias=signed, rate=st.sampled_from(["measured", "estimated"])),
            table("realistic", delay=st.floats(0.0, 1.0), timestamped=st.booleans(), loss=st.just(0.0)),
        ),
        "actuation": st.one_of(
            st.sampled_from(["ideal", "realistic", "spherical_motor"]),
            table("ideal", cogging=number, detents=st.integers(1, 20)),
            table("spherical_motor", failed=st.sampled_from([(), (0,), (3, 3, 3), (1, 5)])),
        ),
        "mass_scale": number,
        "com_shift": signed,
        "friction": st.one_of(number, st.just(1e-3)),
        "initial_error": st.one_of(signed, number),
        "physics_period": number,
        "steady_from": number,
        "seed": st.integers(0, 2**40),
        "duration": number,
        "model": st.sampled_from(["/a b.xml", "/it's.xml"]),
    },
)


@given(experiments)
@settings(max_examples=count(50, 200))
def test_a_command_makes_the_experiment_again(values):
    try:
        made = Experiment(**values)
    except WristError:
        assume(False)
    with pytest.MonkeyPatch.context() as patch:
        assert replayed(patch, command_of(made)) == made


@pytest.mark.parametrize(
    ("values", "command"),
    [
        ({}, "wrist run"),
        ({"law": "pd", "mass_scale": 1.0}, "wrist run --law pd --mass-scale 1"),
        (HARDWARE["realistic"], "wrist run --hardware realistic"),
        ({**HARDWARE["realistic"], "friction": 0}, "wrist run --hardware realistic --set friction=0"),
        ({"disturbance": 0.1}, "wrist run --disturbance 0.1"),
        ({"sensing": {"delay": 0.001}}, "wrist run --set sensing.delay=0.001"),
        ({"law": {"name": "computed_torque", "Kp": 100}}, "wrist run --law computed_torque --set law.Kp=100"),
        ({"reference": {"name": "recorded", "file": "/a.csv"}}, "wrist run --reference recorded:/a.csv"),
        ({"com_shift": [0.001, 0, 0]}, "wrist run --set 'com_shift=[0.001,0,0]'"),
    ],
)
def test_a_command_is_short(values, command):
    assert command_of(Experiment(**values)) == command


def test_a_law_from_a_file_is_named_by_it(tmp_path, monkeypatch):
    (tmp_path / "my laws.py").write_text(LAW)
    monkeypatch.chdir(tmp_path)
    made = Experiment(law={"name": "my laws.py:Spring", "stiffness": 0.3})
    command = command_of(made)
    monkeypatch.chdir("/")
    assert replayed(monkeypatch, command) == made


def test_what_has_no_name_on_the_command_line_has_no_command():
    class Local(Law):
        pass

    class PD(Law):  # the name of another law is not enough
        pass

    class Odd(Step):
        pass

    for made in (Experiment(law=Local()), Experiment(law=PD()), Experiment(reference=Odd())):
        with pytest.raises(ParameterError) as error:
            command_of(made)
        one_line(error.value)
    assert command_of(Experiment(law=Local()), law="a.py:Local") == "wrist run --law a.py:Local"


# --- comparing

BRIEF = {"duration": 0.3}
TWO = select(DEFAULT, ["constant-heavy", "realistic"])


@pytest.fixture(scope="module")
def found():
    return compare({"pd": PD(), "sliding_mode": SlidingMode()}, TWO, {}, BRIEF, jobs=2)


def test_every_cell_is_the_run_of_its_experiment(found):
    runs = [("constant-heavy", 0), *(("realistic", seed) for seed in range(3))]
    assert set(found.cells) == {(law, *run) for law, run in product(("pd", "sliding_mode"), runs)}
    for (law, case, seed), one in found.cells.items():
        hardware = HARDWARE["realistic" if case == "realistic" else "ideal"]
        alone = simulate(Experiment(law=law, seed=seed, **hardware, **BRIEF))
        assert one.metrics == alone.metrics
        assert one.outcome == alone.outcome
        calm = simulate(Experiment(law="computed_torque", seed=seed, **hardware, **BRIEF)).metrics.chattering_Nm_per_s
        assert found.figure(one, "chattering_ratio") == alone.metrics.chattering_Nm_per_s / calm


def test_the_number_of_threads_changes_no_bit(found):
    again = compare(found.laws, TWO, {}, BRIEF, jobs=1)
    assert [one.metrics for one in again.cells.values()] == [one.metrics for one in found.cells.values()]
    assert again.baseline_chattering == found.baseline_chattering


def test_plain_computed_torque_is_one_of_the_laws_or_runs_beside_them(found):
    other = compare({"mine": ComputedTorque(), "pd": PD()}, TWO, {}, BRIEF)
    assert other.baseline_chattering == found.baseline_chattering
    assert {law for law, *_ in other.cells} == {"mine", "pd"}
    assert [other.figure(other.cells["mine", case.name, 0], "chattering_ratio") for case in TWO] == [1.0, 1.0]
    stiff = compare({"computed_torque": ComputedTorque(Kp=900, Kv=60)}, TWO, {}, BRIEF)
    assert stiff.baseline_chattering == found.baseline_chattering


def test_progress_is_told_and_what_raises_stops_the_rest(found, tmp_path):
    (tmp_path / "bad.py").write_text(LAW.replace("signal.error[i]", "signal.error[i + 3]"))
    laws = laws_from_texts([f"{tmp_path}/bad.py:Spring", "pd"], {}, {})
    seen = []
    with pytest.raises(LawError) as error:
        compare(laws, DEFAULT, {}, {"duration": 600.0}, progress=lambda done, total: seen.append((done, total)))
    one_line(error.value)
    compare(found.laws, TWO, {}, BRIEF, progress=lambda done, total: seen.append((done, total)))
    assert seen[-12:] == [(done, 12) for done in range(1, 13)]
    for wrong in ("jobs", "seeds"):
        with pytest.raises(ParameterError, match=f"{wrong} = 0"):
            compare(found.laws, TWO, {}, BRIEF, **{wrong: 0})


def test_the_cells_asked_for_are_recorded(found, tmp_path):
    laws = {"pd P=[1,2,3]": PD(P=(1, 2, 3)), **found.laws}
    folder = tmp_path / "new" / "folder"
    recorded = compare(laws, TWO, {}, BRIEF, record=["*sliding*:*", "pd P=[1,2,3]:realistic"], folder=folder)
    names = {f"{law}--realistic--{seed}.rrd" for law, seed in product(("sliding_mode", "pd_P=_1_2_3"), range(3))}
    assert {path.name for path in folder.iterdir()} == {"sliding_mode--constant-heavy.rrd", *names}
    one = recorded.cells["sliding_mode", "realistic", 2]
    run = load_recording(one.recording)
    assert (run.experiment, run.metrics) == (one.experiment, one.metrics)
    assert one.metrics == found.cells["sliding_mode", "realistic", 2].metrics
    assert recorded.cells["pd", "realistic", 2].recording is None
    compare(found.laws, TWO[:1], {}, BRIEF, record=["all"], folder=folder)
    assert (folder / "pd--constant-heavy.rrd").is_file()


@pytest.mark.parametrize(
    ("record", "said"),
    [("pd", "LAW:CASE"), ("pdd:realistic", "did you mean 'pd'"), ("pd:realistc", "did you mean 'realistic'")],
)
def test_a_wrong_pattern_is_one_line_before_anything_runs(found, tmp_path, record, said):
    with pytest.raises(ParameterError) as error:
        compare(found.laws, TWO, {}, {"duration": 600.0}, record=[record], folder=tmp_path / "out")
    assert said in one_line(error.value)
    assert not (tmp_path / "out").exists()
    with pytest.raises(ParameterError, match="-o DIR"):
        compare(found.laws, TWO, {}, BRIEF, record=["all"])
    same = (Case("a b", "", {}), Case("a_b", "", {}))
    with pytest.raises(ParameterError, match="same file"):
        compare(found.laws, same, {}, BRIEF, record=["all"], folder=tmp_path / "out")


# --- pictures and tables


@pytest.mark.parametrize("width", WIDTHS.values())
def test_the_picture_has_names_at_the_left_in_the_order_of_ranks_and_never_over_data(width):
    long = "adaptive_fuzzy_sliding_computed_torque Kp=[400, 400, 400] Kv=[40, 40, 40]"
    many = {f"law_number_{n}": [1e-4 * (1 + 0.01 * n), None if n == 7 else 2e-4] for n in range(16)}
    shown = to_dict(comparison({**many, long: [1e-1, 2e-1]}), "")
    drawing = comparison_picture(shown, width)
    with mpl.rc_context(STYLE):
        assert overlaps(drawing) == []
    names = [text.get_text().replace("\n", " ") for text in drawing.axes[0].get_yticklabels()]
    assert [name.replace(" ", "") for name in names] == [law["law"].replace(" ", "") for law in shown["laws"]]
    assert {"median", "worst run", "a run was lost"} <= {
        text.get_text().partition(",")[0] for text in drawing.legends[0].get_texts()
    }


def test_marks_of_the_picture_are_where_the_figures_are():
    shown = to_dict(comparison({"a": [1e-3, 4e-3], "b": [1e-2, 1e-2]}, {"a": [2.0, 8.0], "b": [1.0, 1.0]}), "")
    error, chattering, counts = comparison_picture(shown).axes

    def marks(panel, marker):
        return [line.get_xdata()[0] for line in panel.lines if line.get_marker() == marker]

    assert marks(error, "o") == pytest.approx([1.0, np.sqrt(10.0 * 2.5)], rel=0.3)  # median of two
    assert marks(error, "o") == [law["median_ratio"] for law in shown["laws"]]
    assert marks(error, "|") == pytest.approx([1.0, 10.0])
    dots = [sorted(line.get_xdata()) for line in error.lines if line.get_marker() == "."]
    assert dots == [pytest.approx([1.0, 1.0]), pytest.approx([2.5, 10.0])]
    assert marks(chattering, "o") == pytest.approx([4.0, 1.0])
    assert marks(counts, "o") == [2, 0]


def test_lost_runs_are_marked_at_the_edge_and_a_single_case_has_no_dots():
    shown = to_dict(comparison({"a": [1e-3], "b": [None]}), "")
    error, *_ = comparison_picture(shown).axes
    crosses = [line for line in error.lines if line.get_marker() == "x"]
    assert [line.get_xdata()[0] for line in crosses] == [pytest.approx(error.get_xlim()[1])]
    assert not [line for line in error.lines if line.get_marker() == "."]


def test_the_table_for_a_paper():
    several = comparison_table(to_dict(comparison({"a_b": [1e-3, 4e-3, None], "c": [1e-2, 1e-2, 1e-2]}), ""))
    assert [row[0] for row in several.rows] == ["c", "a_b"] or [row[0] for row in several.rows] == ["a_b", "c"]
    row = {each[0]: each for each in several.rows}
    assert (row["a_b"][3], row["a_b"][7], row["c"][7]) == ("lost", "1", "0")
    one = comparison_table(to_dict(comparison({"a_b": [1e-3], "c": [1e-2]}), ""))
    assert [column.label for column in one.columns][:3] == [
        "law",
        "error [×]",
        METRICS["rms_error_rad"].label_and_unit,
    ]
    assert one.rows[0][:3] == ["a_b", 1.0, pytest.approx(1e-3)]
    assert {(0, 1), (0, 2)} <= one.best
    for table in (several, one):
        assert r"a\_b" in as_latex(table)
        assert "| a_b |" in as_markdown(table)


# --- the command line

SEEDS = ("--seed", "4", "--seeds", "2")


def test_json_has_the_promised_keys_and_its_commands_replay_it(wrist):
    code, out, err = wrist("compare", *QUICK, "--case", "failed-coil", "--set", "payload=0.01", *SEEDS, "--json")
    given = json.loads(out)
    assert (code, err) == (0, "")
    assert set(given) == {
        "suite",
        "laws",
        "cases",
        "standings",
        "bound_mm",
        "cells",
        "warnings",
        "versions",
        "files",
        "wall_time_s",
    }
    assert (given["suite"], given["files"]) == ("default", [])
    assert [case["case"] for case in given["cases"]] == ["constant-heavy", "failed-coil"]
    assert {law["law"] for law in given["laws"]} == {"pd", "sliding_mode"}
    assert set(given["laws"][0]["groups"]) == {IDEAL, FAULTY}
    assert [(case["random"], case["seeds"]) for case in given["cases"]] == [(False, [4]), (True, [4, 5])]
    assert len(given["cells"]) == 6
    for cell in given["cells"]:
        assert "payload" in cell["command"]
        code, out, _ = wrist(*shlex.split(cell["command"])[1:], "--no-recording", "--json")
        told = json.loads(out)
        assert (told["metrics"], told["within_bound"]) == (cell["metrics"], cell["within_bound"])
    best = [row["law"] for row in given["standings"] if row["rank"] == 1 and row["case"] == "failed-coil"]
    assert [given["cases"][1]["ranking"][0]] == [given["cases"][1]["winner"]] == best


def test_the_folder_has_the_same_numbers_in_every_form(wrist):
    code, out, err = wrist("compare", *QUICK, "--case", "realistic", "-o", "out", "--record", "pd:*", "--json")
    given = json.loads(out)
    assert (code, err) == (0, "")
    assert json.loads(Path("out/comparison.json").read_text()) == given
    names = {f"comparison.{ending}" for ending in ("csv", "json", "md", "pdf", "png", "svg", "tex")}
    assert set(given["files"]) == names
    assert {path.name for path in Path("out").glob("*.rrd")} == {
        "pd--constant-heavy.rrd",
        *(f"pd--realistic--{seed}.rrd" for seed in range(3)),
    }
    assert {path.name for path in Path("out").iterdir()} - names == {path.name for path in Path("out").glob("*.rrd")}
    with Path("out/comparison.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    keys = ("law", "case", "seed")
    assert [[row[key] for key in keys] for row in rows] == [[str(cell[key]) for key in keys] for cell in given["cells"]]
    for row, cell in zip(rows, given["cells"], strict=True):
        assert float(row["rms_error_rad"]) == cell["metrics"]["rms_error_rad"]
        assert row["command"] == cell["command"]
        assert (row["copper_loss_W"] == "") == (cell["metrics"]["copper_loss_W"] is None)
    text = Path("out/comparison.md").read_text()
    assert "| law | ratio | attitude error, RMS [rad] |" in text
    assert f"{given['cells'][0]['metrics']['max_tip_error_mm']:.4g}" in text
    for case in given["cases"]:
        assert f"| {case['case']} | {case['discriminates']} | {case['winner']} | {case['runner_up']} |" in text
    assert imread("out/comparison.png").shape[1] > 1000
    svg = Path("out/comparison.svg").read_bytes()
    assert wrist("compare", *QUICK, "--case", "realistic", "-o", "out")[0] == 0
    assert Path("out/comparison.svg").read_bytes() == svg


@pytest.mark.parametrize("width", [80, 120])
@pytest.mark.parametrize("full", [False, True])
def test_tables_fit_the_terminal_and_cut_no_figure(capsys, monkeypatch, width, full):
    monkeypatch.setenv("COLUMNS", str(width))
    names = ["adaptive_fuzzy_sliding_computed_torque", "computed_torque Kp=[100, 200, 300] Kv=20", "sliding_mode"]
    errors = {name: [1.234e-4, None, 5.678e-3] for name in (*names, *(f"law_{n}" for n in range(15)))}
    shown = to_dict(comparison(errors), "")
    print_comparison(shown, full=full, files=ResultFiles())
    out = capsys.readouterr().out
    lines = out.splitlines()
    assert all(len(line) <= width for line in lines if " diverged at " not in line)
    assert all("…" not in line for line in lines if "computed_torque Kp" not in line)
    assert all(text in out for text in ("adaptive_fuzzy_sliding", "lost", "case-1", "all lost"))
    if full:
        assert out.count("1.23e-04") == 2 * len(errors)  # of the attitude, and of the tip
        assert out.count(" diverged at ") == len(errors)
    else:
        assert out.count(" diverged at ") == 12
        assert "and 6 more lost runs" in out
        headings = [int(n) for line in lines if line.startswith("case ") for n in re.findall(r"#(\d+)", line)]
        assert len(headings) == len(errors)
        lost = [line.split()[1:] for line in lines if line.startswith("case-1 ") and "all lost" not in line]
        assert list(chain(*lost)) == ["lost"] * len(errors)


def test_a_suite_and_an_experiment_from_files(wrist):
    Path("e.toml").write_text("duration = 0.2\npayload = 0.02\nlaw = {name = 'pd', P = 0.3}\n")
    Path("cases.toml").write_text(
        "[[case]]\nname = 'light'\nmass_scale = 0.5\n[[case]]\nname = 'still'\ndisturbance = 0\n"
    )
    code, out, _ = wrist("compare", "e.toml", "--cases", "cases.toml", "--json")
    given = json.loads(out)
    assert code == 0
    assert given["suite"] == "cases.toml"
    assert {law["law"] for law in given["laws"]} == {*Law.members, "pd P=0.3"}
    for cell in given["cells"]:
        assert "--payload 0.02" in cell["command"]
        assert ("--mass-scale 0.5" in cell["command"]) == (cell["case"] == "light")


def test_divergence_is_a_result_and_no_failure(wrist):
    code, out, err = wrist("compare", *QUICK, "--set", "disturbance.amplitude=50", "--json")
    assert (code, err) == (0, "")
    given = json.loads(out)
    assert all(law["lost"] == ["constant-heavy"] and law["median_ratio"] is None for law in given["laws"])
    assert all(cell["outcome"] == "diverged" and cell["ratio"] is None for cell in given["cells"])
    code, out, _ = wrist("compare", *QUICK, "--set", "disturbance.amplitude=50", "-o", "out")
    assert code == 0
    assert "pd on constant-heavy diverged at" in out


WRONG = [
    ["--law", "computed_tork"],
    ["--case", "realistc"],
    ["--cases", "none.toml"],
    ["--cases", "e.toml"],
    ["--set", "mas_scale=1"],
    ["--set", "law.K"],
    ["--duration", "-1"],
    ["--duration", "0.0015"],
    ["--seed", "-1"],
    ["--jobs", "0"],
    ["--record", "all"],
    ["--record", "nobody:*", "-o", "out"],
    ["-o", "e.toml"],
    ["-o", "e.toml/out"],
    ["none.toml"],
    ["--no-such-option"],
]


@pytest.mark.parametrize("arguments", WRONG, ids=" ".join)
def test_wrong_input_is_one_line_exit_code_2_and_writes_nothing(wrist, arguments):
    Path("e.toml").write_text("mass_scale = 1\n")
    code, out, err = wrist("compare", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("wrist: error: ")
    assert err.count("\n") == 1
    assert [path.name for path in Path().iterdir()] == ["e.toml"]


@pytest.mark.parametrize("delay", [0.0, 0.5])
def test_ctrl_c_stops_at_once(tmp_path, delay):
    """While the runs are handed to the threads, and while these simulate."""
    simulate(Experiment(law="pd", duration=0.01))  # compiles what the process below then loads
    command = [
        *WRIST,
        "compare",
        "--law",
        "pd",
        "--duration",
        "6000",
        "--set",
        "disturbance.amplitude=0.004",
        "-o",
        "out",
    ]
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        while not (tmp_path / "out").is_dir():  # made just before the first run
            assert process.poll() is None
            time.sleep(0.002)
        time.sleep(delay)
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)  # of 21 runs of 6000 simulated seconds, which take minutes
    finally:
        process.kill()
    assert (process.returncode, out, err) == (130, "", "")
    assert not list((tmp_path / "out").iterdir())


def test_completed_runs_that_are_doubtful_are_counted_on_the_error_stream(wrist):
    code, out, err = wrist(
        "compare", "--law", "pd", "--case", "constant-heavy", "--set", "disturbance.level=8", "--json"
    )
    [said] = json.loads(out)["warnings"]
    assert (code, err) == (0, f"wrist: warning: {said}\n")
    assert said.startswith("the attitude error passed half a radian in 1 of 1 runs, most in pd on constant-heavy")
