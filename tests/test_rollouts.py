"""Runs that share calls of compiled code come to the same bits as alone, whoever is among them and how he ends."""

import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigs import experiments
from spherical_wrist import Experiment, simulate
from spherical_wrist.control import Law
from spherical_wrist.errors import ParameterError
from spherical_wrist.loop.addresses import array_address
from spherical_wrist.loop.outcome import Status
from spherical_wrist.prepare.cache import SLOTS, RunCache
from spherical_wrist.prepare.closed_loop import CHUNK
from spherical_wrist.simulation.rollouts import RolloutResult, roll_out
from spherical_wrist.user_file import member_from_file

EXPERIMENTS = experiments()
ALONE = [simulate(experiment, keep_series=False) for experiment in EXPERIMENTS]
CACHE = RunCache()
WAYS = {
    "raise": "raise ValueError('no good')",
    "nan": "command.torque[1] = math.nan",
    "index": "command.torque[0] = signal.error[i + 1]",
}


def makers(numbers):
    return [lambda number=number: EXPERIMENTS[number] for number in numbers]


def same(found, alone):
    return (found.outcome, found.metrics) == (alone.outcome, alone.metrics)


@given(numbers=st.lists(st.integers(0, len(EXPERIMENTS) - 1), min_size=1, max_size=SLOTS))
def test_each_is_as_it_would_be_alone(numbers):
    for number, found in zip(numbers, roll_out(makers(numbers), CACHE), strict=True):
        assert same(found, ALONE[number])


@pytest.mark.parametrize("chunk", [1, 7, 39, 40, 41])
def test_the_chunks_in_which_they_are_played_do_not_matter(chunk):
    every = range(len(EXPERIMENTS))
    assert all(map(same, roll_out(makers(every), RunCache(), chunk=chunk), ALONE))


def test_threads_do_not_disturb_each_other():
    found = {}

    def work(thread):
        order = np.random.default_rng(thread).permutation(len(EXPERIMENTS))
        cache = RunCache()
        for _ in range(5):
            found[thread] = [(k, one) for k, one in zip(order, roll_out(makers(order), cache), strict=True)]
            assert all(same(one, ALONE[k]) for k, one in found[thread])

    team = [threading.Thread(target=work, args=(thread,)) for thread in range(4)]
    for thread in team:
        thread.start()
    for thread in team:
        thread.join()
    assert len(found) == 4
    assert all(same(one, ALONE[k]) for pairs in found.values() for k, one in pairs)


@pytest.fixture(scope="module")
def late(tmp_path_factory):
    """Experiments under laws that go wrong at 20.5 ms, each in its way, by name."""
    folder, found = tmp_path_factory.mktemp("laws"), {}
    for name, way in WAYS.items():
        file = folder / f"{name}.py"
        file.write_text(
            "import math\nfrom spherical_wrist.control import Law\n\nclass Mine(Law):\n    @staticmethod\n"
            "    def step(signal, parameters, state, command):\n        for i in range(3):\n"
            "            command.torque[i] = 0.1 * signal.error[i]\n"
            f"        if signal.time > 0.0205:\n            {way}\n"
        )
        law = member_from_file(f"{file}:Mine", Law)
        found[name] = Experiment(duration=0.04, control_period=0.001, law=law())
    return found


@pytest.mark.parametrize("chunk", [8, CHUNK])
@pytest.mark.parametrize("order", [("raise", "nan", "index"), ("index", "raise", "nan"), ("nan", "nan", "raise")])
def test_one_that_goes_wrong_does_not_take_the_others_along(late, order, chunk):

    def invalid():
        raise ParameterError("not an experiment")

    def broken():
        raise ZeroDivisionError

    wrong = [lambda name=name: late[name] for name in order]
    mixed = [*makers([0]), wrong[0], wrong[1], invalid, *makers([9]), broken, *makers([6]), wrong[2]]
    found = roll_out(mixed, RunCache(), chunk=chunk)
    assert all(same(found[slot], ALONE[number]) for slot, number in ((0, 0), (4, 9), (6, 6)))
    assert [type(found[slot]) for slot in (3, 5)] == [ParameterError, ZeroDivisionError]
    for slot, name in zip((1, 2, 7), order, strict=True):
        alone = simulate(late[name])
        assert same(found[slot], alone)
        assert (alone.outcome.status, alone.outcome.time, len(alone)) == (Status.FAILED, 0.021, 21)
        wrote = {"nan": "wrote the torque [", "raise": "raised ", "index": "raised "}[name]
        assert alone.outcome.reason.startswith(f"law 'mine' at t = 0.021 s {wrote}")


@pytest.mark.parametrize("name", ["raise", "nan"])
def test_what_was_simulated_before_a_law_failed_is_that_of_a_shorter_run(late, name):
    early = late[name].replaced(steady_from=0.01, disturbance=0.0)  # whose size would depend on the duration
    failed = simulate(early)
    whole = simulate(early.replaced(duration=0.021))
    assert (failed.outcome.status, whole.outcome.status) == (Status.FAILED, Status.COMPLETED)
    assert failed.metrics == whole.metrics
    for channel in ("attitude", "rate", "torque", "error"):
        np.testing.assert_array_equal(getattr(failed, channel), getattr(whole, channel))


def test_a_disturbance_that_goes_wrong_between_two_chunks(tmp_path):
    (tmp_path / "short.py").write_text(
        "import numpy as np\nfrom spherical_wrist.disturbance import Disturbance\n\nclass Short(Disturbance):\n"
        "    def shape(self, random):\n"
        "        return lambda time: np.where(time > 0.015, np.nan, 0.0)[:, None] * [1, 1, 1]\n"
    )
    short = EXPERIMENTS[0].replaced(disturbance={"name": f"{tmp_path / 'short.py'}:Short", "amplitude": 0.001})
    both = [lambda: EXPERIMENTS[0], lambda: short, lambda: EXPERIMENTS[1]]
    good, bad, other = roll_out(both, RunCache(), chunk=10)
    assert isinstance(good, RolloutResult)
    assert same(good, ALONE[0])
    assert same(other, ALONE[1])
    assert (bad.outcome.status, bad.outcome.time) == (Status.FAILED, 0.01)
    assert "t = 0.016 s is not finite" in bad.outcome.reason
    [alone] = roll_out([lambda: short], RunCache())  # in one chunk, it is wrong from the start
    assert isinstance(alone, ParameterError)


def test_none_of_them():
    assert roll_out([], CACHE) == []


def test_an_array_that_is_not_in_one_piece_is_not_looked_for():
    with pytest.raises(ValueError, match="strides"):
        array_address(np.zeros((4, 6))[:, ::2])


def test_all_stop_on_request_and_keep_what_they_have():
    roll_out(makers([0, 6]), CACHE)  # the size of the disturbances is known: only the loop asks whether to stop
    asked = iter([False, True])
    found = roll_out(makers([0, 6]), CACHE, stop=lambda: next(asked, True), chunk=10)
    assert [each.outcome.status for each in found] == [Status.INTERRUPTED] * 2
    assert [each.outcome.time for each in found] == pytest.approx([0.01, 0.01])
