"""The criterion for gains: its measurements against closed forms, the search, and what the package ships."""

import json
from math import exp, inf, pi, sqrt

import mujoco
import numpy as np
import pytest

from sampling import long, some
from spherical_wrist.control import ComputedTorque, L1Adaptive, Law
from spherical_wrist.design import (
    CONSTRAINTS,
    FIGURES,
    Assessment,
    constraints_of,
    criterion,
    designed,
    find_gains,
    judge,
    shipped,
)
from spherical_wrist.design.criterion import INFEASIBLE, cost, fingerprint
from spherical_wrist.design.search import space_of_design
from spherical_wrist.design.trial import LATE, REALISTIC, DesignTrial
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.parameters import searched
from spherical_wrist.prepare.cache import RunCache
from spherical_wrist.prepare.needed_torque import needed_variation
from spherical_wrist.prepare.plant import plant_of
from spherical_wrist.simulation.runner import Worker
from spherical_wrist.simulation.simulate import simulate
from spherical_wrist.tuning.ranges import tunable

LAWS = {name: Law.resolve(name, default=name) for name in Law.members}
NAMES = {each.name for each in CONSTRAINTS}


@pytest.fixture(scope="module")
def worker():
    return Worker(RunCache(), lambda: False)


# --- measurements


@pytest.mark.parametrize("damping", [0.2, 0.4, 1.0])
def test_swing_back_is_that_of_a_second_order_system(worker, damping):
    law = ComputedTorque(Kp=400.0, Kv=2.0 * damping * 20.0)
    expected = exp(-2.0 * pi * damping / sqrt(1.0 - damping**2)) if damping < 1.0 else 0.0
    assert DesignTrial(law, worker).swing_back(1.0) == pytest.approx(expected, rel=0.05, abs=1e-4)


def test_needed_torque_is_that_of_mujocos_inverse_dynamics(worker):
    experiment = Experiment(mass_scale=1.5, payload=0.05, com_shift=(0.001, 0.0, 0.0), duration=2.5)
    plant = plant_of(experiment).model
    data, found = mujoco.MjData(plant), []
    for motion in experiment.reference.motion(np.arange(2000, 2500) * 1e-3):
        data.qpos[:], data.qvel[:], data.qacc[:] = motion["attitude"], motion["rate"], motion["acceleration"]
        mujoco.mj_inverse(plant, data)
        found.append(data.qfrc_inverse.copy())
    expected = np.abs(np.diff(found, axis=0)).mean() / 1e-3
    assert needed_variation(experiment, worker.cache) == pytest.approx(expected, rel=1e-9)


def test_a_law_that_follows_is_not_restless_however_heavy_the_plant_is(worker):
    """Plain computed torque sags under 50 g; a law that does not asks for what the plant needs."""
    heavy = {"payload": 0.05, "duration": 4.0}
    assert DesignTrial(LAWS["linear_adrc"], worker).restlessness(heavy) == pytest.approx(1.0, abs=0.01)
    own, plain = (simulate(Experiment(law=law, **heavy)).metrics for law in ("linear_adrc", "computed_torque"))
    assert own.chattering_Nm_per_s > 1.3 * plain.chattering_Nm_per_s
    shaking = DesignTrial(L1Adaptive(bandwidth=500.0, filter_bandwidth=2000.0), worker)
    assert (shaking.restlessness({**LATE, **heavy}) or inf) > 10.0


def test_torque_step_is_the_mean_change_of_the_command_over_the_limit(worker):
    run = simulate(Experiment(law="linear_adrc", **REALISTIC))
    steps = np.abs(np.diff(run.commanded_torque[2000:], axis=0)).mean()
    assert DesignTrial(LAWS["linear_adrc"], worker).torque_step() == pytest.approx(
        steps / np.mean([0.25, 0.2, 0.33]), rel=1e-9
    )


class Runaway(Law):
    """A spring that pushes away."""

    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            command.torque[i] = -0.1 * signal.error[i]


def test_a_law_that_is_lost_breaks_everything_and_has_no_objective(worker):
    verdict = judge(Runaway(), worker)
    assert set(verdict.broken(Runaway())) == NAMES
    assert verdict.objective is None
    assert cost(Runaway(), worker) > 2.0 * INFEASIBLE


# --- the order of candidates


def test_violation_is_zero_exactly_where_the_limit_is_kept():
    for each in CONSTRAINTS:
        assert each.violation(each.limit) == 0.0
        better, worse = (2.0, 0.5) if each.at_least else (0.5, 2.0)
        assert each.violation(better * each.limit) == 0.0
        assert each.violation(worse * each.limit) == pytest.approx(0.5)
        assert each.violation(None) == 1.0
        assert each.violation(inf) == (0.0 if each.at_least else 1.0)


def test_feasible_gains_come_first_then_those_that_miss_by_less(monkeypatch):
    """With stages: a run that oscillates is worse than any margin that is missed, and margins are not measured then."""
    measured = []

    def table(values):
        def measure(each):
            def value(trial):
                measured.append(each.name)
                return values.get(each.name, each.limit)

            return value

        return tuple(each._replace(measure=measure(each)) for each in CONSTRAINTS)

    def of(**values):
        monkeypatch.setattr(criterion, "CONSTRAINTS", table(values))
        return cost(ComputedTorque(), None)

    monkeypatch.setattr(criterion, "FIGURES", tuple(f._replace(measure=lambda trial: 7.0) for f in FIGURES))
    costs = [
        of(),
        of(disk_margin=0.45),
        of(disk_margin=0.4),
        of(max_sensitivity=9.0, disk_margin=0.1),
        of(swing_back=0.11),
    ]
    assert costs[0] == pytest.approx(7.0)
    assert costs == sorted(costs)
    assert len(set(costs)) == len(costs)
    measured.clear()
    of(swing_back=0.2)
    assert set(measured) == {each.name for each in CONSTRAINTS if each.stage == 0}


def test_the_objective_is_the_geometric_mean_of_all_figures():
    figures = dict(zip((each.name for each in FIGURES), (1.0, 2.0, 4.0, 8.0, 16.0), strict=True))
    assert Assessment({}, figures).objective == pytest.approx(4.0)
    assert Assessment({}, {**figures, FIGURES[0].name: None}).objective is None


# --- the search


@pytest.fixture
def bowl(monkeypatch):
    """Replace the criterion by a bowl whose bottom is known."""

    def of(law, worker):
        return 1.0 + np.log(law.bandwidth / 70.0) ** 2 + np.log(law.filter_bandwidth / 900.0) ** 2

    monkeypatch.setattr("spherical_wrist.design.search.cost", of)


def test_the_search_finds_the_best_gains(bowl):
    found = find_gains(L1Adaptive(), trials=150)
    assert found.law.bandwidth == pytest.approx(70.0, rel=0.02)
    assert found.law.filter_bandwidth == pytest.approx(900.0, rel=0.02)
    assert found.gains == {"bandwidth": found.law.bandwidth, "filter_bandwidth": found.law.filter_bandwidth}


def test_seed_and_budget_determine_the_gains_and_nothing_else_does(bowl):
    first = find_gains(L1Adaptive(), seed=3, trials=20, jobs=1)
    assert find_gains(L1Adaptive(bandwidth=40.0, filter_bandwidth=1000.0), seed=3, trials=20, jobs=2) == first
    assert find_gains(L1Adaptive(), seed=4, trials=20).gains != first.gains


@long
def test_the_real_search_is_reproducible():
    first, again = (find_gains(L1Adaptive(), seed=1, trials=6, jobs=jobs) for jobs in (1, 2))
    assert first == again


def test_a_law_of_ones_own_is_searched_around_its_gains(bowl):
    ranges = {each.name: each for each in space_of_design(Plain(bandwidth=40.0)).ranges}
    assert set(ranges) == {"law.bandwidth", "law.filter_bandwidth"}
    assert (ranges["law.bandwidth"].low, ranges["law.bandwidth"].high) == (10.0, 160.0)
    assert find_gains(Plain(), trials=60).law.bandwidth == pytest.approx(70.0, rel=0.1)
    with pytest.raises(ParameterError, match="no positive number"):
        find_gains(Runaway())


class Plain(Law):
    """A law without declared ranges."""

    bandwidth: float = 40.0
    filter_bandwidth: float = 800.0


# --- what the package ships


def test_the_defaults_of_every_law_are_the_gains_that_were_found():
    kept = shipped()
    assert kept["criterion"] == fingerprint()
    assert list(kept["laws"]) == sorted(name for name in designed() if not LAWS[name].gains_from)
    for name, found in kept["laws"].items():
        law = LAWS[name]
        assert set(found["gains"]) == {each.name.removeprefix("law.") for each in space_of_design(law).ranges}
        assert law == law.replaced(**found["gains"]), name


def test_every_gain_of_a_designed_law_is_searched():
    """Nobody chooses a gain by hand: what is no limit, no switch and no assumption has a range."""
    for name in designed():
        law = LAWS[name]
        assert [gain for gain in tunable(law) if searched(type(law), gain) is None] == [], name
        for each in space_of_design(law).ranges:
            assert each.low <= each.default <= each.high, each


def test_every_law_claims_what_it_was_found_to_keep():
    for name, found in shipped()["laws"].items():
        every = constraints_of(LAWS[name])
        broken = [each.name for each in every if not kept_to(each, found["constraints"][each.name])]
        assert set(broken) == set(LAWS[name].exempt), name


def kept_to(constraint, value):
    return constraint.violation(inf if value is None and constraint.at_least else value) == 0.0


def test_exemptions_are_constraints_with_a_reason():
    for name, law in LAWS.items():
        assert set(law.exempt) | set(law.promises) <= NAMES, name
        assert all(len(reason) > 20 for reason in law.exempt.values()), name


@pytest.mark.parametrize("name", some([*designed(), *(name for name in LAWS if name not in designed())], len(LAWS)))
def test_a_law_keeps_the_constraints_that_it_claims(name, worker):
    verdict = judge(LAWS[name], worker)
    assert set(verdict.broken(LAWS[name])) == set(LAWS[name].exempt)
    if name in shipped()["laws"]:
        assert verdict.objective == pytest.approx(shipped()["laws"][name]["objective"], rel=1e-3)


# --- the command


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "give laws to search gains for"),
        (["indi", "--all"], "either laws or --all"),
        (["--check", "-o", "x.json"], "--check finds nothing to keep"),
        (["no_such_law"], "no_such_law"),
        (["indi", "--trials", "0"], "must be 1 or more"),
        (["indi", "-o", "other.json"], "is no file of wrist design"),
    ],
)
def test_wrong_use_is_one_line(wrist, tmp_path, arguments, message):
    (tmp_path / "other.json").write_text('{"laws": 1}')
    code, out, err = wrist("design", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err


def test_check_and_search_print_tables_and_json(wrist, bowl, monkeypatch, tmp_path):
    values = {each.name: each.limit for each in CONSTRAINTS}
    verdict = Assessment({**values, "gain_margin_db": inf}, {each.name: 2.0 for each in FIGURES})
    monkeypatch.setattr("spherical_wrist.design.judge", lambda law, worker: verdict)
    code, out, _ = wrist("design", "l1_adaptive", "--trials", "12", "-o", "gains.json", "--json")
    assert code == 0
    table = json.loads(out)
    kept = json.loads((tmp_path / "gains.json").read_text())
    assert kept["laws"]["l1_adaptive"]["gains"] == table["found"]["l1_adaptive"]["gains"]
    assert table["laws"][0]["gains_from"] == "given"
    assert table["laws"][0]["constraints"]["gain_margin_db"] == {
        "value": None,
        "limit": 3.0,
        "met": True,
        "claimed": True,
    }
    code, out, _ = wrist("design", "indi", "--trials", "12", "-o", "gains.json")
    assert (code, "best of 12 sets of gains, seed 0" in out) == (0, True)
    assert set(json.loads((tmp_path / "gains.json").read_text())["laws"]) == {"indi", "l1_adaptive"}
    broken = Assessment({**values, "swing_back": None}, {each.name: 2.0 for each in FIGURES})
    monkeypatch.setattr("spherical_wrist.design.judge", lambda law, worker: broken)
    code, out, _ = wrist("design", "--check")
    assert code == 1
    assert "pd breaks swing_back, claimed" in out
    assert "lost" in out
    for each in CONSTRAINTS:
        assert each.name in out
