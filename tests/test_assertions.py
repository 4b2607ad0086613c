"""Assertions for other people's tests: what they hold, what they say where it does not, and families of wrists."""

import ast
import json
import re
import shlex
import sys
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

import spherical_wrist
from rigs import one_line
from sampling import count
from spherical_wrist import Experiment, assertions, simulate
from spherical_wrist.assertions import RandomWrists, Tracked, WristGrid, assert_tracks, command_of
from spherical_wrist.cli import main
from spherical_wrist.comparison import family as families
from spherical_wrist.control import PD, ComputedTorque, Law
from spherical_wrist.disturbance import Sinusoid
from spherical_wrist.errors import ParameterError, WristError
from spherical_wrist.loop.outcome import Status
from spherical_wrist.measure.metrics import METRICS, Metrics

BRIEF = {"duration": 0.4}
GRID = WristGrid(mass_scale=(1.0, 1.5), disturbance=(0.1, 0.0), com_shift=0.0 * np.eye(3)[:1])


class Spring(Law):
    """A law of this file, which the command that replays it must find."""

    stiffness: float = 0.1
    damping: float = 0.01

    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            spring = parameters.stiffness * signal.error[i] + parameters.damping * signal.rate_error[i]
            command.torque[i] = spring + signal.N[i]


def complaint(*arguments, **options):
    """The lines of the message of an assertion that must fail."""
    with pytest.raises(AssertionError) as error:
        assert_tracks(*arguments, **options)
    return str(error.value).splitlines()


def replay(monkeypatch, capsys, lines):
    """Return the JSON object that the command in a message prints."""
    (command,) = [line.partition("replay: ")[2] for line in lines if "replay: " in line]
    monkeypatch.setattr(sys, "argv", [*shlex.split(command), "--no-recording", "--json"])
    with pytest.raises(SystemExit):
        main()
    return json.loads(capsys.readouterr().out)


def test_where_it_holds_every_run_comes_back():
    results = assert_tracks("pd", max_tip_error_mm=50.0, family=GRID, experiment=BRIEF)
    expected = [
        Experiment(law="pd", mass_scale=mass, disturbance={"name": shape, "level": level}, bound=50.0, **BRIEF)
        for mass, (level, shape) in product((1.0, 1.5), ((0.1, "constant"), (0.1, "sinusoid"), (0.0, "constant")))
    ]
    assert [result.experiment for result in results] == expected
    assert [result.metrics for result in results] == [simulate(made).metrics for made in expected]
    assert {result.outcome.status for result in results} == {Status.COMPLETED}


@pytest.mark.parametrize("bound", ["max_tip_error_mm", "rms_error_rad", "max_error_rad"])
def test_the_worst_wrist_is_the_worst_and_its_command_reproduces_its_figure(monkeypatch, capsys, bound):
    every = [getattr(simulate(made).metrics, bound) for made in GRID.experiments(Experiment(law="pd", **BRIEF))]
    assert_tracks("pd", family=GRID, experiment=BRIEF, **{bound: max(every)})
    limit = float(f"{np.median(every):.3g}")
    lines = complaint("pd", family=GRID, experiment=BRIEF, **{bound: limit})
    assert lines[0] == f"pd misses {bound} ≤ {limit:g} on {sum(value > limit for value in every)} of 6 wrists"
    assert f"{bound} = {max(every):.4g} ({max(every) / limit:.3g} × the bound)" in lines[1]
    assert replay(monkeypatch, capsys, lines)["metrics"][bound] == max(every)
    assert "seed:   0" in lines[3]
    assert lines[4].startswith("  family: WristGrid(mass_scale=(1.0, 1.5), ")


def test_of_several_bounds_the_one_that_is_missed_most_decides():
    run = simulate(Experiment(**BRIEF))
    one = Tracked(run.experiment, run.outcome, run.metrics, run.verdict)
    figures = (one.metrics.max_tip_error_mm, one.metrics.rms_error_rad)
    bounds = {"max_tip_error_mm": 2.0 * figures[0], "rms_error_rad": 0.25 * figures[1]}
    assert one.excess(bounds) == pytest.approx(4.0)
    (name, *_) = complaint("pd", max_tip_error_mm=1e9, max_error_rad=1e-9, family=GRID, experiment=BRIEF)
    assert name == "pd misses max_tip_error_mm ≤ 1e+09 and max_error_rad ≤ 1e-09 on 6 of 6 wrists"


def test_a_run_that_diverges_misses_every_bound_and_is_worst(monkeypatch, capsys):
    family = WristGrid(mass_scale=(1.0,), disturbance=(0.0, 500.0, 5000.0), com_shift=(0.0,), shape=("constant",))
    times = [simulate(made).outcome.time for made in family.experiments(Experiment(law="pd", **BRIEF))]
    assert times[0] == 0.4 > times[1] > times[2] > 0.0
    lines = complaint("pd", max_error_rad=1e9, family=family, experiment=BRIEF)
    assert lines[0] == "pd misses max_error_rad ≤ 1e+09 on 2 of 3 wrists"
    assert f"worst:  diverged at {times[2]:g} s" in lines[1]
    told = replay(monkeypatch, capsys, lines)
    assert (told["outcome"], told["ended_at_s"]) == ("diverged", times[2])


def test_no_figure_is_no_success():
    run = simulate(Experiment(**BRIEF))
    none = Tracked(run.experiment, run.outcome, Metrics(dict.fromkeys(METRICS)), run.verdict)
    assert none.excess({"rms_error_rad": 1.0}) == np.inf


def test_a_law_of_the_test_file_is_replayed_from_it(monkeypatch, capsys):
    lines = complaint(Spring, max_tip_error_mm=1e-9, family=GRID, experiment=BRIEF)
    assert f"{Path(__file__).resolve()}:Spring" in lines[2]
    told = replay(monkeypatch, capsys, lines)
    assert f"max_tip_error_mm = {told['metrics']['max_tip_error_mm']:.4g}" in lines[1]
    lines = complaint(Spring(stiffness=0.3), max_tip_error_mm=1e-9, family=GRID, experiment=BRIEF)
    assert "--set law.stiffness=0.3" in lines[2]
    assert replay(monkeypatch, capsys, lines)["metrics"] != told["metrics"]


def test_a_law_that_cannot_be_found_says_what_to_do(tmp_path, monkeypatch):
    class Local(Spring):
        pass

    lines = complaint(Local(stiffness=0.2), max_tip_error_mm=1e-9, family=GRID, experiment=BRIEF)
    assert "replay: wrist run --law FILE.py:Local --set law.stiffness=0.2" in lines[2]
    assert "top level of a Python file" in lines[3]
    # a file that does not load on its own
    (tmp_path / "needs_more.py").write_text(Path(__file__).read_text().split("BRIEF =")[0] + "import no_such_module\n")
    monkeypatch.setattr(sys.modules[__name__], "__file__", str(tmp_path / "needs_more.py"))
    lines = complaint(Spring, max_tip_error_mm=1e-9, family=GRID, experiment=BRIEF)
    assert "FILE.py:Spring" in lines[2]
    assert "no_such_module" in lines[3]


def test_a_law_is_given_in_any_way(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    source = Path(__file__).read_text()
    code = next(
        ast.get_source_segment(source, node) for node in ast.parse(source).body if isinstance(node, ast.ClassDef)
    )
    Path("mine.py").write_text(f"from spherical_wrist.control import Law\n\n{code}\n")
    grid = WristGrid(mass_scale=(1.0,), disturbance=(0.0,), com_shift=((0.0, 0.0, 0.0),))
    ways = ("pd", {"name": "pd"}, PD(), PD)
    found = [assert_tracks(way, max_error_rad=1.0, family=grid, experiment=BRIEF) for way in ways]
    assert all(one == found[0] for one in found)
    (by_file,) = assert_tracks("mine.py:Spring", max_error_rad=1.0, family=grid, experiment=Experiment(**BRIEF))
    (by_class,) = assert_tracks(Spring, max_error_rad=1.0, family=grid, experiment=BRIEF)
    assert by_file.metrics == by_class.metrics


def test_the_number_of_threads_changes_no_bit():
    family = RandomWrists(samples=4)
    both = [
        assert_tracks("pd", max_error_rad=10.0, family=family, experiment={**BRIEF, "sensing": "realistic"}, jobs=jobs)
        for jobs in (1, 2)
    ]
    assert both[0] == both[1]


@pytest.mark.parametrize(
    "options",
    [{}, {"max_error_rad": 0.0}, {"max_error_rad": -1.0}, {"rms_error_rad": float("nan")}, {"max_tip_error_mm": np.inf},
     {"max_error_rad": 1.0, "experiment": {"mas_scale": 1}}, {"max_error_rad": 1.0, "jobs": 0}],
)  # fmt: skip
def test_what_makes_no_sense_is_one_line(options):
    with pytest.raises(WristError) as error:
        assert_tracks("pd", **options)
    one_line(error.value)
    with pytest.raises(WristError, match="did you mean 'pd'"):
        assert_tracks("pdd", max_error_rad=1.0)


def test_it_is_there_to_import_from_the_package():
    assert spherical_wrist.assert_tracks is assert_tracks
    assert "assert_tracks" in dir(spherical_wrist)


def test_the_examples_of_the_docstring_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("my_law.py").write_text(
        "from spherical_wrist.control import ComputedTorqueObserver\n\nclass MyLaw(ComputedTorqueObserver):\n    pass\n"
    )
    text = assertions.__doc__
    blocks = [
        re.sub(r"^    ", "", block, flags=re.MULTILINE) for block in re.findall(r"::\n\n((?:    .*\n|\n)+)", text)
    ]
    assert len(blocks) == 2
    scope = {"pytest": pytest, "Experiment": Experiment, "simulate": simulate, "command_of": command_of}
    for block in blocks:
        exec(compile(block, "assertions.py", "exec"), scope)
    tests = [value for name, value in scope.items() if name.startswith("test_")]
    assert len(tests) == 4
    for test in tests[:-1]:
        test()
    (mark,) = tests[-1].pytestmark
    made = mark.args[1]
    assert len(made) == 18
    tests[-1](made[0])
    assert mark.kwargs["ids"](made[0]).startswith("wrist run --law pd")


# --- families


def test_the_default_grid_is_what_it_says():
    made = WristGrid().experiments(Experiment(law="pd"))
    assert len(made) == 18
    found = {(one.mass_scale, one.com_shift, one.disturbance.name, one.disturbance.level) for one in made}
    still, beside = (0.0, 0.0, 0.0), (0.002, 0.0, 0.0)
    pushes = (("constant", 0.0), ("constant", 0.25), ("sinusoid", 0.25))
    assert found == {(m, c, *push) for m, c, push in product((0.75, 1.0, 1.25), (still, beside), pushes)}
    assert all(one == Experiment(law="pd").replaced(
        mass_scale=one.mass_scale, com_shift=one.com_shift, disturbance=one.disturbance) for one in made)  # fmt: skip


def test_what_the_family_does_not_vary_is_as_the_experiment_says():
    base = Experiment(law=ComputedTorque(Kp=100), friction=1e-3, disturbance=Sinusoid(frequency=3.0, amplitude=0.1))
    for family in (WristGrid(shape=("sinusoid", "noise"), disturbance=(0.1,)), RandomWrists(shape=("sinusoid",))):
        for made in family.experiments(base):
            assert (made.law, made.friction) == (base.law, base.friction)
            assert made.disturbance.amplitude is None
            if made.disturbance.name == "sinusoid":
                assert made.disturbance.frequency == 3.0


def test_a_random_family_is_drawn_as_it_says():
    ranges = {"mass_scale": (0.5, 2.0), "payload": (0.0, 0.02), "disturbance": (0.1, 0.3)}
    made = RandomWrists(samples=600, seed=5, com_shift=0.004, shape=("pulse", "noise"), **ranges).experiments(
        Experiment()
    )
    assert len(made) == 600
    drawn = {
        "mass_scale": [one.mass_scale for one in made],
        "payload": [one.payload for one in made],
        "disturbance": [one.disturbance.level for one in made],
    }
    for name, (low, high) in ranges.items():
        assert stats.kstest(drawn[name], stats.uniform(low, high - low).cdf).pvalue > 0.01
    shifts = np.array([one.com_shift for one in made])
    distance = np.linalg.norm(shifts, axis=1)
    assert distance.max() <= 0.004 * 1.001
    assert stats.kstest((distance / 0.004) ** 3, "uniform").pvalue > 0.01  # uniform in a ball
    assert np.abs((shifts / distance[:, None]).mean(axis=0)).max() < 0.12
    assert 0.4 < np.mean([one.disturbance.name == "noise" for one in made]) < 0.6
    assert len({one.seed for one in made}) == 600


@given(st.integers(0, 2**32), st.integers(1, 8))
@settings(max_examples=count(5, 20))
def test_a_random_family_is_the_same_for_the_same_seed_and_begins_alike(seed, samples):
    base = Experiment()
    few = RandomWrists(samples=samples, seed=seed).experiments(base)
    more = RandomWrists(samples=samples + 3, seed=seed).experiments(base)
    assert few == more[:samples]
    assert few != RandomWrists(samples=samples, seed=seed + 1).experiments(base)


@pytest.mark.parametrize(
    ("family", "values"),
    [
        ("WristGrid", {"mass_scale": (0.0,)}),
        ("WristGrid", {"mass_scale": ()}),
        ("WristGrid", {"com_shift": ((1.0, 2.0),)}),
        ("WristGrid", {"shape": ("cubic",)}),
        ("WristGrid", {"masses": (1.0,)}),
        ("RandomWrists", {"samples": 0}),
        ("RandomWrists", {"mass_scale": (2.0, 1.0)}),
        ("RandomWrists", {"mass_scale": (0.0, 1.0)}),
        ("RandomWrists", {"payload": (-1.0, 1.0)}),
        ("RandomWrists", {"disturbance": (0.0, float("inf"))}),
        ("RandomWrists", {"seed": -1}),
    ],
)
def test_a_wrong_family_is_one_line(family, values):
    with pytest.raises(ParameterError) as error:
        getattr(families, family)(**values)
    one_line(error.value)
