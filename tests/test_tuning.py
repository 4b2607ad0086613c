"""Gains found by search: ranges, scores, studies that go on, fronts, files that reproduce, and `wrist tune`."""

import fcntl
import json
import shlex
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.image import imread
from scipy.stats import gmean

from rigs import one_line
from sampling import some
from spherical_wrist import Experiment, simulate
from spherical_wrist.comparison.cases import Case
from spherical_wrist.comparison.law_selection import laws_from_texts
from spherical_wrist.control import PD, FuzzySlidingComputedTorque, Law, SlidingComputedTorque
from spherical_wrist.errors import ParameterError, WristError
from spherical_wrist.folder_lock import folder_lock
from spherical_wrist.missing_package import installing

optuna = pytest.importorskip("optuna")

from optuna.storages.journal import JournalFileBackend, JournalStorage  # noqa: E402

from spherical_wrist.simulation.runner import Runner  # noqa: E402
from spherical_wrist.tuning.family import Family, usual  # noqa: E402
from spherical_wrist.tuning.gains_file import toml  # noqa: E402
from spherical_wrist.tuning.objective import WORST, Figures, Score  # noqa: E402
from spherical_wrist.tuning.pareto import front_of, summary_of  # noqa: E402
from spherical_wrist.tuning.picture import front_picture  # noqa: E402
from spherical_wrist.tuning.ranges import space_of  # noqa: E402
from spherical_wrist.tuning.scoring import scores_of  # noqa: E402
from spherical_wrist.tuning.search import Search, SearchResult, tune  # noqa: E402
from spherical_wrist.tuning.study import Trial  # noqa: E402

WRIST = [sys.executable, "-c", "from spherical_wrist.cli import main; main()"]
SHORT = {"duration": 0.1, "sensing.attitude_noise": 3e-4}
PAIR = (Case("light", "", {"mass_scale": 0.75}), Case("heavy", "", {"mass_scale": 1.25}))
SPRING = """
from pydantic import model_validator

from spherical_wrist.control import Law
from spherical_wrist.parameters import Positive

class Spring(Law):
    stiffness: Positive = 0.1
    damping: Positive = 0.01
    unused: Positive = 3.0
    label: int = 2

    @model_validator(mode="after")
    def soft(self):
        if self.stiffness > 0.3:
            raise ValueError("too stiff")
        return self

    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            spring = parameters.stiffness * signal.error[i] + parameters.damping * signal.rate_error[i]
            command.torque[i] = spring + signal.N[i]
        if parameters.damping > 0.03:
            command.torque[2] = 1.0
        if parameters.damping < 0.004:
            command.torque[1] = 0.1 / (signal.time * 0.0)
"""


def search_of(law, ranges=(), cases=PAIR, sampler="tpe", seed=0, changes=SHORT):
    family = Family.of(cases, law, {}, changes)
    return Search(space_of(law, ranges), bool(ranges), family, sampler, seed)


def journal(folder):
    """Optuna's storage of a study."""
    return JournalStorage(JournalFileBackend(str(folder / "tune.log")))


def outcome(found):
    return [(trial.number, trial.values, trial.score) for trial in found.trials]


# --- ranges


def test_by_default_every_positive_number_is_searched_from_a_quarter_to_four_times_but_nothing_else():
    law = SlidingComputedTorque(K=(0.05, 0.05, 0.03))
    ranges = {each.name: each for each in space_of(law).ranges}
    numbers = {name for name in type(law).model_fields if name not in ("prediction", "switching")}
    assert set(ranges) == {f"law.{name}" for name in numbers}
    for name, each in ranges.items():
        assert each.default == np.max(getattr(law, name.removeprefix("law.")))
        assert (each.low, each.high) == (each.default / 4.0, each.default * 4.0)
        assert each.logarithmic
    assert ranges["law.K"].unit == "N·m"


def test_zeros_rules_and_what_the_motors_can_do_are_left_alone():
    law = FuzzySlidingComputedTorque(Kv=(40.0, 40.0, 0.0))
    names = {each.name for each in space_of(law).ranges}
    assert "law.K" in names
    assert not {"law.Kv", "law.rules", "law.torque_limit"} & names
    for law in laws_from_texts([], {}, {}).values():
        assert "law.torque_limit" not in {each.name for each in space_of(law).ranges}


def test_a_vector_is_scaled_as_a_whole_or_axis_by_axis():
    law = SlidingComputedTorque(K=(0.05, 0.04, 0.03))
    assert space_of(law).law_with({"law.K": 0.1}) == law.replaced(K=(0.1, 0.08, 0.06))
    by_axis = space_of(law, per_axis=True)
    assert by_axis.law_with({"law.K.y": 0.1}) == law.replaced(K=(0.05, 0.1, 0.03))
    assert {f"law.K.{axis}" for axis in "xyz"} <= {each.name for each in by_axis.ranges}
    assert space_of(law, ["law.K.z=0.01:0.2"]).law_with({"law.K.z": 0.1}).K == (0.05, 0.04, 0.1)
    start = law.replaced(K=0.05)
    assert space_of(start, ["law.K=0.01:0.2"], per_axis=True).law_with({"law.K.x": 0.02}).K == (0.02, 0.05, 0.05)


@pytest.mark.parametrize("name", sorted(Law.members))
def test_default_values_make_the_very_same_law_and_others_have_four_digits(name):
    law = Law.resolve(name, default=name)
    space = space_of(law)
    assert space.law_with(space.defaults) == law
    odd = space.law_with({each.name: each.default * 1.23456789 for each in space.ranges[:1]})
    field = space.ranges[0].name.removeprefix("law.")
    for value in np.ravel(getattr(odd, field)):
        assert float(f"{value:.4g}") == value
    assert np.max(getattr(odd, field)) == pytest.approx(space.ranges[0].default * 1.23456789, rel=1e-3)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("law.K", "NAME=LOW:HIGH"),
        ("law.K=0.1", "NAME=LOW:HIGH"),
        ("law.K=0.2:0.01", "NAME=LOW:HIGH"),
        ("law.K=0:inf", "NAME=LOW:HIGH"),
        ("law.k=0.01:0.2", "did you mean"),
        ("K=0.01:0.2", "law.K"),
        ("mass_scale=0.5:2", "unknown parameter"),
        ("law.switching=0:1", "unknown parameter"),
        ("law.slope.x=1:40", "no such axis"),
        ("law.K.w=0.01:0.2", "no such axis"),
        ("law.K=0.1:0.2", "leaves out the default gain 0.05"),
        ("law.K=-0.1:0.2", "greater than 0"),
    ],
)
def test_a_wrong_range_is_refused_in_one_line(text, said):
    with pytest.raises(WristError) as caught:
        space_of(SlidingComputedTorque(K=0.05), [text])
    assert said in one_line(caught.value)


def test_a_parameter_given_twice_is_refused():
    for twice in (["law.K=0.01:0.2", "law.K=0.01:0.1"], ["law.K=0.01:0.2", "law.K.x=0.01:0.2"]):
        with pytest.raises(ParameterError, match="given twice"):
            space_of(SlidingComputedTorque(K=0.05), twice)


def test_a_law_without_numbers_is_refused():
    class Nothing(Law):
        pass

    with pytest.raises(ParameterError, match="no positive number"):
        space_of(Nothing())


# --- scores


def test_a_score_is_the_geometric_mean_over_the_cases_that_simulating_each_gives():
    law, other = PD(), PD(P=0.3)
    family = Family.of(PAIR, law, {}, SHORT)
    for each, score in zip((law, other), scores_of([law, other], family, Runner(2)), strict=True):
        runs = [
            simulate(Experiment(law=each, mass_scale=scale, duration=0.1, sensing={"attitude_noise": 3e-4}))
            for scale in (0.75, 1.25)
        ]
        assert score.error == pytest.approx(gmean([run.metrics.rms_error_rad for run in runs]), rel=1e-14)
        assert score.chattering == pytest.approx(gmean([run.metrics.chattering_Nm_per_s for run in runs]), rel=1e-14)
        assert score.tip_error == max(run.metrics.max_tip_error_mm for run in runs)
        assert not score.failed
        assert Score.from_plain(json.loads(json.dumps(score.to_plain()))) == score


def test_one_case_that_was_not_completed_makes_a_score_infeasible():
    good = Figures("completed", 1e-4, 0.01, 0.1)
    assert Score({"a": good, "b": Figures("diverged")}).failed == 1
    assert Score({"a": Figures("diverged"), "b": Figures("failed")}).failed == 2
    assert Score({}, "refused").failed == 1
    broken = Score({"a": good, "b": Figures("diverged")})
    assert (broken.error, broken.chattering, broken.tip_error) == (*WORST, None)


def test_a_case_with_more_tip_error_than_the_bound_is_not_completed():
    laws = [PD(P=float(p)) for p in (0.05, 0.2, 0.8)]
    free = scores_of(laws, Family.of(PAIR, PD(), {}, SHORT), Runner())
    bound = free[1].tip_error
    held = scores_of(laws, Family.of(PAIR, PD(), {}, SHORT, bound), Runner())
    assert [score.failed > 0 for score in held] == [score.tip_error > bound for score in free] == [True, False, False]
    assert held[1:] == free[1:]
    assert "missed" in {figures.outcome for figures in held[0].cases.values()}
    with pytest.raises(ParameterError, match="--bound 0"):
        Family.of(PAIR, PD(), {}, SHORT, 0.0)


def test_a_run_that_never_reaches_the_steady_window_is_refused():
    with pytest.raises(ParameterError, match="steady window"):
        scores_of([PD()], Family.of(PAIR, PD(), {}, {"duration": 0.1, "steady_from": 1.0}), Runner(1))


def test_the_usual_family_has_wrong_masses_and_real_hardware():
    experiments = Family.of(usual(), PD(), {}, {}).experiments
    assert {each.mass_scale for each in experiments} >= {0.75, 1.25}
    assert sum(not each.sensing.ideal for each in experiments) >= 3
    assert len({each.reference.name for each in experiments}) == 3


def test_settings_that_make_two_cases_the_same_are_refused():
    with pytest.raises(ParameterError, match="'light' and 'heavy' are the same"):
        Family.of(PAIR, PD(), {}, {"mass_scale": 1.0})


# --- fronts

amount = st.sampled_from([0.5, 1.0, 2.0, 3.0, 5.0])


def found_with(points):
    """A search whose trials have these (error, chattering), None for one that diverged."""
    search = search_of(PD(), ["law.P=0.01:9"])
    scores = [
        Score({"a": Figures("diverged") if point is None else Figures("completed", point[0], 0.1, point[1])})
        for point in points
    ]
    values = [{"law.P": 0.16 + 0.01 * number} for number in range(len(points))]
    trials = tuple(Trial(n, v, s) for n, (v, s) in enumerate(zip(values, scores, strict=True)))
    plain = Score({"a": Figures("completed", 1.0, 1.0, 1.0)})
    return SearchResult(search, search.space, (), plain, trials, False, {}, 0.0)


@given(st.lists(st.none() | st.tuples(amount, amount), min_size=1, max_size=10))
def test_front_and_choices_are_what_comparing_every_pair_gives(points):
    found = found_with(points)
    feasible = {number: point for number, point in enumerate(points) if point is not None}

    def beaten(p):
        return any(q[0] <= p[0] and q[1] <= p[1] and q != p for q in feasible.values())

    wanted = {number for number, point in feasible.items() if not beaten(point)}
    assert {trial.number for trial in front_of(found)} == wanted
    table = summary_of(found)
    assert [point["chattering_Nm_per_s"] for point in table["front"]] == pytest.approx(
        sorted(feasible[number][1] for number in wanted)
    )
    assert {each["trial"] for each in table["others"]} == set(feasible) - wanted
    assert table["infeasible"] == points.count(None)
    if points[0] is None:
        assert table["precise"] is table["calm"] is None
        return
    no_noisier = [point[0] for point in feasible.values() if point[1] <= points[0][1]]
    no_worse = [point[1] for point in feasible.values() if point[0] <= points[0][0]]
    assert feasible[table["precise"]][0] == min(no_noisier)
    assert feasible[table["calm"]][1] == min(no_worse)
    assert {table["precise"], table["calm"]} <= wanted


def test_of_equal_gains_the_first_is_on_the_front():
    found = found_with([(1.0, 1.0), (2.0, 2.0), (0.5, 0.5), (0.5, 0.5)])
    again = found.trials[3]._replace(values=found.trials[2].values)
    assert [trial.number for trial in front_of(found._replace(trials=(*found.trials[:3], again)))] == [2]


# --- studies


@pytest.mark.parametrize("sampler", ["tpe", "nsga2"])
def test_a_study_that_was_stopped_and_continued_is_the_one_that_ran_through_on_any_number_of_threads(tmp_path, sampler):
    search = search_of(PD(), sampler=sampler)
    steps = (3, 8, 11) if sampler == "tpe" else (3, 22, 26)
    whole = tune(search, tmp_path / "whole", steps[-1], jobs=2)
    for trials in steps:
        parts = tune(search, tmp_path / "parts", trials, jobs=1)
        assert len(parts.trials) == trials
    assert outcome(parts) == outcome(whole)
    assert whole.trials[0].values == search.space.defaults
    assert len({tuple(trial.values.values()) for trial in whole.trials}) > steps[-1] // 2
    other = tune(search_of(PD(), sampler=sampler, seed=1), tmp_path / "other", 8)
    assert outcome(other)[0] == outcome(whole)[0]
    assert outcome(other)[1:] != outcome(whole)[1:8]


@pytest.mark.parametrize("sampler", ["tpe", "nsga2"])
def test_a_study_whose_file_was_cut_off_anywhere_goes_on_as_if_it_had_not_been(tmp_path, sampler):
    """Killed at any moment, or with no room left on the disk: the journal is written line by line."""
    search = search_of(PD(), sampler=sampler)
    trials = {"tpe": 19, "nsga2": 27}[sampler]  # of NSGA-II, into the second generation
    whole = tune(search, tmp_path / "whole", trials)
    content = (tmp_path / "whole" / "tune.log").read_bytes()
    begun = content.index(b"settings")
    (tmp_path / "cut").mkdir()
    for share in some((0.0, 0.01, 0.1, 0.45, 0.46, 0.7, 0.88, 0.92, 0.96), 2):
        (tmp_path / "cut" / "tune.log").write_bytes(content[: begun + round(share * (len(content) - begun))])
        assert outcome(tune(search, tmp_path / "cut", trials)) == outcome(whole)


def test_interrupted_at_any_moment_it_keeps_what_is_done_and_goes_on(tmp_path):
    search = search_of(PD())
    whole = tune(search, tmp_path / "whole", 12)
    assert not whole.stopped
    asked = []

    def tired(after):
        asked.append(0)
        return len(asked) > after

    part = tune(search, tmp_path / "part", 12, stop=lambda: tired(28))
    assert part.stopped
    assert 0 < len(part.trials) < 12
    assert outcome(part) == outcome(whole)[: len(part.trials)]
    assert outcome(tune(search, tmp_path / "part", 12)) == outcome(whole)
    for early in (2, 16):
        asked.clear()
        assert tune(search, tmp_path / "early", 12, stop=lambda after=early: tired(after)) is None
    assert outcome(tune(search, tmp_path / "early", 12)) == outcome(whole)


def test_the_search_comes_close_to_the_front_of_a_fine_grid(tmp_path):
    """One gain, so that the whole front is known: at every error of the grid's front, no more chattering than 3 %."""
    law = PD(D=0.016)
    search = search_of(law, ["law.D=0.004:0.064"])
    found = tune(search, tmp_path, 40)
    grid = [law.replaced(D=float(d)) for d in np.geomspace(0.004, 0.064, 60)]
    exact = [(score.error, score.chattering) for score in scores_of(grid, search.family, Runner())]
    tried = [(trial.score.error, trial.score.chattering) for trial in found.trials]
    for error, chattering in exact:
        assert min(c for e, c in tried if e <= 1.03 * error) <= 1.03 * chattering


def fate(**values):
    if values["law.stiffness"] > 0.3:
        return "refused"
    damping = values["law.damping"]
    return "diverged" if damping > 0.03 else "failed" if damping < 0.004 else "completed"


def test_what_does_not_complete_is_never_on_the_front_which_is_that_of_optuna_itself(tmp_path):
    """The law refuses stiff springs, raises at low damping, and spins the wrist up at high damping."""
    file = tmp_path / "law.py"
    file.write_text(SPRING)
    (law,) = laws_from_texts([f"{file}:Spring"], {}, {}).values()
    search = search_of(law, changes={"duration": 4.0})
    found = tune(search, tmp_path / "study", 40)
    assert found.idle == ("law.unused",)
    expected = {trial.number: fate(**trial.values) for trial in found.trials}
    assert set(expected.values()) == {"refused", "diverged", "failed", "completed"}
    for trial in found.trials:
        outcomes = {figures.outcome for figures in trial.score.cases.values()} or {"refused"}
        assert outcomes == {expected[trial.number]}
    infeasible = {number for number, word in expected.items() if word != "completed"}
    stored = optuna.load_study(study_name="tune", storage=journal(tmp_path / "study"))
    assert {trial.number for trial in stored.trials if max(trial.constraints.values()) > 0.0} == infeasible
    front = {trial.number for trial in front_of(found)}
    assert front == {trial.number for trial in stored.best_trials}
    assert not front & infeasible


@pytest.fixture(scope="module")
def begun(tmp_path_factory):
    """The folder of a study of PD with one trial."""
    folder = tmp_path_factory.mktemp("begun")
    tune(search_of(PD()), folder, 1)
    return folder


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (lambda: search_of(PD(P=0.2)), "law: P was [0.16, 0.16, 0.06], and is [0.2, 0.2, 0.2] here"),
        (lambda: search_of(PD(), ["law.P=0.02:1"]), "range: law.P was 0.04:0.64, and is 0.02:1 here"),
        (lambda: search_of(PD(), seed=2), "seed was 0, and is 2 here"),
        (lambda: search_of(PD(), sampler="nsga2"), "sampler was tpe, and is nsga2 here"),
        (lambda: search_of(PD(), cases=PAIR[:1]), "case: heavy was {"),
        (
            lambda: search_of(PD(), cases=(PAIR[0], PAIR[1]._replace(changes={"mass_scale": 1.25, "payload": 0.1}))),
            "case: heavy: payload was 0.0, and is 0.1 here",
        ),
    ],
)
def test_a_study_of_something_else_is_refused_in_one_line(begun, other, said):
    before = begun.joinpath("tune.log").read_bytes()
    with pytest.raises(ParameterError) as caught:
        tune(other(), begun, 1)
    assert said in one_line(caught.value)
    assert "give another folder with -o" in str(caught.value)
    assert begun.joinpath("tune.log").read_bytes() == before


def test_folders_that_cannot_be_used_are_refused_in_one_line(tmp_path):
    search = search_of(PD())
    (tmp_path / "text").mkdir()
    (tmp_path / "text" / "tune.log").write_text("no data base, but a text that is long enough to be taken for one" * 20)
    (tmp_path / "foreign").mkdir()
    (tmp_path / "foreign" / "tune.log").write_text('{"something": 1}\n' * 3)
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "tune.db").write_text("")
    (tmp_path / "file").write_text("")
    (tmp_path / "other").mkdir()
    other = optuna.create_study(
        study_name="tune", storage=journal(tmp_path / "other"), directions=["minimize", "minimize"]
    )
    other.add_trial(optuna.trial.create_trial(values=[1.0, 2.0]))
    for name in ("text", "foreign", "file", "other", "old"):
        with pytest.raises(WristError) as caught:
            tune(search, tmp_path / name, 1)
        assert name in one_line(caught.value)
    (tmp_path / "busy").mkdir()
    with (tmp_path / "busy" / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(ParameterError, match="another command is tuning"):
            tune(search, tmp_path / "busy", 1)
    with (
        folder_lock(tmp_path / "held", ParameterError, "tuning"),
        pytest.raises(ParameterError, match="another command is tuning"),
    ):
        tune(search, tmp_path / "held", 1)
    assert len(tune(search, tmp_path / "held", 1).trials) == 1


# --- files and the command

values = st.recursive(
    st.booleans() | st.integers(-(2**62), 2**62) | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(min_size=1), inner, max_size=3),
    max_leaves=8,
)


@given(values.filter(lambda value: "\\ud" not in json.dumps(value)))
def test_values_come_back_from_toml(value):
    assert tomllib.loads(f"value = {toml(value)}")["value"] == value


QUICK = ["--case", "constant-heavy", "--case", "rate-noise", "--duration", "0.1", "--set", "payload=0.01"]


def test_every_file_of_the_front_reproduces_its_figures_and_runs(wrist, tmp_path):
    code, out, err = wrist("tune", "pd", *QUICK, "--trials", "8", "-o", "out", "--json")
    assert (code, err) == (0, "")
    table = json.loads(out)
    assert table == json.loads((tmp_path / "out" / "tune.json").read_text())
    assert sorted(table["files"]) == sorted(
        str(path.relative_to("out")) for path in Path("out").rglob("*") if path.is_file() and path.name != ".lock"
    )
    assert table["trials"] == 8
    assert table["default"]["trial"] == 0
    assert table["default"]["parameters"] == {k: list(v) for k, v in PD().model_dump().items() if k != "name"}
    assert len(table["front"]) > 1
    noise = next(case["changes"] for case in table["cases"] if case["case"] == "rate-noise")
    heavy = {"mass_scale": 1.25, "disturbance.name": "constant", "disturbance.level": 0.25}
    for point in table["front"]:
        file = Path("out") / point["file"]
        runs = [simulate(Experiment.from_toml(file, changes)) for changes in (heavy, noise)]
        assert all(run.experiment.payload == 0.01 for run in runs)
        assert point["rms_error_rad"] == gmean([run.metrics.rms_error_rad for run in runs])
        assert point["chattering_Nm_per_s"] == pytest.approx(
            gmean([run.metrics.chattering_Nm_per_s for run in runs]), rel=1e-14
        )
        assert point["max_tip_error_mm"] == max(run.metrics.max_tip_error_mm for run in runs)
        assert f"{point['rms_error_rad']:.6g} rad" in file.read_text()
    code, out, _ = wrist("run", file, "--no-recording", "--json")
    assert code == 0
    assert json.loads(out)["law"] == "pd"
    (command,) = (line for line in file.read_text().splitlines() if "These figures again" in line)
    code, out, _ = wrist(*shlex.split(command.partition(": ")[2])[1:], "--json")
    cells = {cell["case"]: cell["metrics"] for cell in json.loads(out)["cells"]}
    for case, figures in point["cases"].items():
        assert figures["rms_error_rad"] == cells[case]["rms_error_rad"]
        assert figures["chattering_Nm_per_s"] == cells[case]["chattering_Nm_per_s"]


def test_more_trials_go_on_and_what_left_the_front_goes(wrist, tmp_path):
    arguments = ["tune", "pd", *QUICK, "-o", "out"]
    assert wrist(*arguments, "--trials", "4")[0] == 0
    (tmp_path / "out" / "front" / "mine.toml").write_text("# not ours")
    (tmp_path / "out" / "front" / "trial-9999.toml").write_text("# of an earlier front")
    code, out, _ = wrist(*arguments, "--trials", "10")
    assert code == 0
    assert "10 sets of gains on 2 cases" in out
    table = json.loads((tmp_path / "out" / "tune.json").read_text())
    kept = {path.name for path in (tmp_path / "out" / "front").iterdir()}
    assert kept == {"mine.toml", *(Path(point["file"]).name for point in table["front"])}
    assert f"wrist run out/{table['front'][0]['file']}" in out or table["precise"] == table["calm"]
    code, _, err = wrist(*arguments, "--parameter", "law.P=0.1:0.3")
    assert code == 2
    assert "holds another study" in err
    assert len(err.splitlines()) == 1


def test_an_experiment_file_gives_law_and_experiment(wrist, tmp_path):
    (tmp_path / "mine.toml").write_text('duration = 0.1\npayload = 0.02\n[law]\nname = "pd"\nP = 0.3\n')
    code, out, _ = wrist(
        "tune", "mine.toml", "--case", "friction", "--parameter", "law.D=0.001:0.1", "--trials", "2", "--json"
    )
    assert code == 0
    table = json.loads(out)
    assert table["default"]["parameters"]["P"] == [0.3, 0.3, 0.3]
    file = Path("tune-pd") / table["front"][0]["file"]
    assert Experiment.from_toml(file).payload == 0.02
    (tmp_path / "lawless.toml").write_text("duration = 0.1\n")
    assert "says nothing about the law" in wrist("tune", "lawless.toml")[2]


def test_the_picture_marks_default_front_and_choices(tmp_path):
    table = summary_of(found_with([(1.0, 1.0), (0.5, 1.0), (1.0, 0.5), (0.3, 4.0), (3.0, 0.3), (5.0, 5.0), None]))
    drawing = front_picture(table)
    upper, lower = drawing.axes
    drawn = [line.get_label() for line in upper.get_lines()]
    assert {text.get_text() for text in upper.get_legend().get_texts()} <= set(drawn)
    lines = {line.get_label(): line for line in upper.get_lines()}
    assert lines["default gains"].get_xydata().tolist() == [[1.0, 1.0]]
    front = next(line for label, line in lines.items() if label.startswith("Pareto front"))
    assert front.get_xdata() == pytest.approx([0.3, 0.5, 1.0, 4.0])  # the error is upwards
    assert front.get_ydata() == pytest.approx([3.0, 1.0, 0.5, 0.3])
    others = next(line for label, line in lines.items() if label.startswith("other gains"))
    assert others.get_xydata() == pytest.approx(np.array([[1.0, 1.0], [5.0, 5.0]]))
    assert lines["trial 1, more precise: error × 0.5"].get_xydata().tolist() == [[1.0, 0.5]]
    assert lines["trial 2, calmer: chattering × 0.5"].get_xydata().tolist() == [[0.5, 1.0]]
    assert [label.get_text() for label in lower.get_yticklabels()] == ["P"]
    drawing.savefig(tmp_path / "front.png")
    assert imread(tmp_path / "front.png").std() > 0.01
    front_picture(summary_of(found_with([None, None]))).savefig(tmp_path / "none.png")
    both, _ = front_picture(summary_of(found_with([(1.0, 1.0), (0.5, 0.5)]))).axes
    named = [line for line in both.get_lines() if line.get_label().startswith("trial")]
    assert [line.get_label() for line in named] == ["trial 1, more precise and calmer: error × 0.5, chattering × 0.5"]
    assert named[0].get_xydata().tolist() == [[0.5, 0.5]]


def test_the_command_says_in_one_line_that_optuna_is_not_there(wrist, monkeypatch):
    for name in [name for name in sys.modules if name.startswith("spherical_wrist.tuning")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "optuna", None)
    code, out, err = wrist("tune", "pd")
    assert (code, out) == (2, "")
    assert err == f"wrist: error: tuning needs Optuna: {installing('tune')}\n"


@pytest.mark.parametrize(
    "arguments",
    [
        ["nonsense"],
        ["pd", "--case", "nonsense"],
        ["pd", "--trials", "0"],
        ["pd", "--jobs", "0"],
        ["pd", "--sampler", "nonsense"],
        ["pd", "--set", "law.nonsense=1"],
        ["pd", "--set", "nonsense=1"],
        ["pd", "--parameter", "law.P"],
        ["pd", "--duration", "-1"],
        ["pd", "--bound", "-1"],
        ["pd", "--cases", "nonsense.toml"],
    ],
)
def test_wrong_input_gives_one_line_and_no_files(wrist, tmp_path, arguments):
    code, out, err = wrist("tune", *arguments)
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == 1
    assert not [path for path in tmp_path.rglob("*") if path.name == "tune.json"]


def test_ctrl_c_leaves_a_study_that_goes_on(wrist, tmp_path):
    command = [*WRIST, "tune", "pd", "--case", "constant-heavy", "--trials", "5000", "--duration", "1", "-o", "out"]
    running = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def stored():
        try:
            study = optuna.load_study(study_name="tune", storage=journal(tmp_path / "out"))
        except (KeyError, FileNotFoundError):
            return 0
        return sum(trial.state is optuna.trial.TrialState.COMPLETE for trial in study.trials)

    end = time.monotonic() + 60.0
    while not stored() and time.monotonic() < end:
        time.sleep(0.1)
    running.send_signal(signal.SIGINT)
    _, err = running.communicate(timeout=60.0)
    assert running.returncode == 130
    assert "the same command goes on" in err
    assert "Traceback" not in err
    table = json.loads((tmp_path / "out" / "tune.json").read_text())
    assert table["trials"] == stored() > 0
    code, out, _ = wrist(*command[len(WRIST) :], "--trials", table["trials"] + 1, "--json")
    assert (code, json.loads(out)["trials"]) == (0, table["trials"] + 1)
