"""Experiments: what they accept, what they refuse and how they say so; user laws; runs."""

import json

import numpy as np
import pytest

from rigs import channel_names, one_line
from spherical_wrist import Experiment, WristError, simulate
from spherical_wrist.channels import CHANNELS, Condition
from spherical_wrist.control import ComputedTorque
from spherical_wrist.disturbance import Pulse
from spherical_wrist.errors import LawError, ParameterError
from spherical_wrist.experiment.description import with_changes
from spherical_wrist.loop.outcome import Status
from spherical_wrist.reference import Step

LAW = """
from spherical_wrist.control import Law
from helper import spring

class Spring(Law):
    stiffness: float = 0.1
    damping: float = 0.01

    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            torque = spring(parameters.stiffness, signal.error[i])
            command.torque[i] = torque + parameters.damping * signal.rate_error[i] + signal.N[i]
"""
HELPER = "def spring(stiffness, error):\n    return stiffness * error\n"


@pytest.fixture
def law_file(tmp_path):
    (tmp_path / "helper.py").write_text(HELPER)
    file = tmp_path / "my_law.py"
    file.write_text(LAW)
    return file


def test_defaults_are_the_default_run():
    given = Experiment()
    assert given.law.name == "fuzzy_sliding_computed_torque"
    assert given.reference.name == "lissajous"
    assert (given.disturbance.name, given.disturbance.level) == ("constant", 0.25)
    assert (given.mass_scale, given.duration, given.control_period) == (1.25, 10.0, 0.001)


def test_parts_are_named_tabled_or_made():
    by_table = Experiment(law={"name": "computed_torque", "Kp": 100}, reference="step", disturbance={"name": "pulse"})
    by_hand = Experiment(law=ComputedTorque(Kp=100), reference=Step(), disturbance=Pulse())
    assert by_table == by_hand
    assert by_table.law.Kp == (100.0, 100.0, 100.0)


def test_disturbance_may_be_a_level():
    assert Experiment(disturbance=0.1).disturbance.level == 0.1


def test_numpy_arrays_are_taken_for_vectors():
    assert Experiment(com_shift=np.array([0.001, 0.0, 0.0])).com_shift == (0.001, 0.0, 0.0)


def test_a_description_makes_the_same_experiment_again():
    given = Experiment(law={"name": "computed_torque", "Kp": [1, 2, 3]}, disturbance={"name": "noise"}, payload=0.01)
    again = Experiment(**json.loads(json.dumps(given.model_dump(mode="json"))))
    assert again == given


def test_experiments_are_frozen():
    with pytest.raises(Exception, match="frozen"):
        Experiment().duration = 1.0


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"law": "computed_tork"}, "did you mean 'computed_torque'"),
        ({"law": {"kp": 1}}, "did you mean 'Kp'"),
        ({"mas_scale": 1}, "did you mean 'mass_scale'"),
        ({"reference": "lisajous"}, "did you mean 'lissajous'"),
        ({"disturbance": {"name": "sine"}}, "sinusoid"),
        ({"mass_scale": 0}, "mass_scale = 0: must be greater than 0"),
        ({"mass_scale": float("nan")}, "finite"),
        ({"duration": float("inf")}, "finite"),
        ({"payload": -0.1}, "payload = -0.1"),
        ({"law": {"K": [1, 2]}}, "three"),
        ({"law": {"rules": [[1, 1, 1]] * 6}}, "rules"),
        ({"law": {"rules": [[0, 1, 1]] * 7}}, "greater than 0"),
        ({"law": {"switching": "sgn"}}, "'sign', 'saturation' or 'tanh'"),
        ({"seed": -1}, "seed"),
        ({"seed": 1.5}, "integer"),
        ({"law": 3}, "name"),
        ({"model": 3}, "model"),
    ],
)
def test_wrong_input_is_refused_in_one_line_that_helps(given, said):
    with pytest.raises(ParameterError) as caught:
        Experiment(**given)
    assert said in one_line(caught.value)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"control_period": 0.0015, "physics_period": 0.001}, "use 0.001 or 0.002"),
        ({"control_period": 0.0005, "physics_period": 0.001}, "physics_period"),
        ({"duration": 0.00123}, "multiple"),
        ({"reference": {"name": "hold", "rotation": 0}}, "N·m instead"),
        ({"model": "none.xml"}, "no such file"),
    ],
)
def test_what_cannot_be_simulated_is_refused_in_one_line(given, said):
    with pytest.raises(WristError) as caught:
        simulate(Experiment(**given))
    assert said in one_line(caught.value)


def test_toml_files_with_changes(tmp_path):
    file = tmp_path / "e.toml"
    file.write_text('mass_scale = 0.5\nlaw = "computed_torque"\n[disturbance]\nname = "pulse"\nlevel = 0.1\n')
    given = Experiment.from_toml(file, {"law.Kp": 9, "disturbance.width": 0.2, "seed": 4})
    assert (given.mass_scale, given.law.Kp[0], given.seed) == (0.5, 9.0, 4)
    assert (given.disturbance.name, given.disturbance.level, given.disturbance.width) == ("pulse", 0.1, 0.2)


@pytest.mark.parametrize(("text", "said"), [("law = ", "TOML"), ("mass_scal = 1", "mass_scale"), ("\xff", "TOML")])
def test_bad_toml_is_refused_in_one_line(tmp_path, text, said):
    file = tmp_path / "e.toml"
    file.write_bytes(text.encode("latin-1"))
    with pytest.raises(ParameterError) as caught:
        Experiment.from_toml(file)
    assert said in one_line(caught.value)


def test_missing_toml_is_refused(tmp_path):
    with pytest.raises(ParameterError, match="cannot be read"):
        Experiment.from_toml(tmp_path / "none.toml")


def test_changes_keep_what_they_do_not_name():
    assert with_changes({"law": {"name": "pd", "P": 1}}, {"law.D": 2}) == {"law": {"name": "pd", "P": 1, "D": 2}}
    for late in ({"law.D": 2, "law": "pd"}, {"law.D": 2, "law.name": "pd"}):
        assert with_changes({"law": {"name": "sliding_mode", "K": 1}}, late) == {"law": {"name": "pd", "D": 2}}
    assert with_changes({"disturbance": 0.3}, {"disturbance.name": "pulse"}) == {
        "disturbance": {"level": 0.3, "name": "pulse"}
    }


def test_a_law_from_a_file_of_ones_own(law_file):
    run = simulate(Experiment(law={"name": f"{law_file}:Spring", "stiffness": 0.2}, duration=0.2))
    assert run.outcome.status is Status.COMPLETED
    plain = simulate(Experiment(law={"name": f"{law_file}:spring", "stiffness": 0.2}, duration=0.2), interpreted=True)
    assert np.abs(run.attitude - plain.attitude).max() < 1e-12


def test_two_law_files_have_a_helper_each(tmp_path):
    runs = []
    for name, stiffness in (("a", "stiffness"), ("b", "2 * stiffness")):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "helper.py").write_text(HELPER.replace("stiffness *", f"{stiffness} *"))
        (folder / "my_law.py").write_text(LAW + f"# {name}\n")
        runs.append(simulate(Experiment(law=f"{folder / 'my_law.py'}:Spring", duration=0.1)))
    assert not np.array_equal(runs[0].torque, runs[1].torque)


def test_a_law_class_made_on_the_spot(law_file):
    """An instance needs no name, no file, and no registration."""

    class Twice(ComputedTorque):
        pass

    run = simulate(Experiment(law=Twice(), duration=0.1))
    same = simulate(Experiment(law=ComputedTorque(), duration=0.1))
    assert np.array_equal(run.torque, same.torque)


@pytest.mark.parametrize(
    ("text", "name", "said"),
    [
        (LAW, "Sprin", "did you mean 'Spring'"),
        ("x = 1\n", "Spring", "no subclass"),
        ("import no_such_module_at_all\n", "Spring", "ModuleNotFoundError"),
        ("def (:\n", "Spring", "line 1"),
        (LAW.replace("spring(parameters", "1 / 0 + spring(parameters"), "Spring", "ZeroDivisionError"),
        (LAW.replace("command.torque[i] =", "command.torque[i] = float('nan') *"), "Spring", "nan"),
        (LAW.replace("command.torque[i] =", "unused ="), "Spring", "torque"),
        (LAW.replace("command.torque[i]", "command.torque[i + 1]"), "Spring", "IndexError"),
        (LAW.replace("def step", "def stepp"), "Spring", "step"),
        (LAW.replace("def step(signal, parameters, state, command)", "def step(signal)"), "Spring", "TypeError"),
        (LAW.replace("torque = spring", "torque = [{}][0] or spring"), "Spring", "compiled"),
    ],
)
def test_a_wrong_law_file_is_refused_in_one_line(tmp_path, text, name, said):
    (tmp_path / "helper.py").write_text(HELPER)
    file = tmp_path / "my_law.py"
    file.write_text(text)
    with pytest.raises(WristError) as caught:
        simulate(Experiment(law=f"{file}:{name}", duration=0.01))
    assert said in one_line(caught.value)


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("raise ValueError('too late')", "too late"),
        ("command.torque[i + 7] = 0.0", "IndexError"),
    ],
)
@pytest.mark.parametrize("interpreted", [True, False])
def test_a_law_that_fails_in_the_middle_says_when(law_file, fault, said, interpreted):
    law_file.write_text(f"{LAW}            if signal.time > 0.05:\n                {fault}\n")
    run = simulate(Experiment(law=f"{law_file}:Spring", duration=0.1), interpreted=interpreted)
    assert (run.outcome.status, len(run.time)) == ("failed", 51)
    assert run.outcome.time == pytest.approx(0.051)
    assert said in one_line(run.outcome.reason)


def test_series_have_their_shapes_and_identities():
    run = simulate(Experiment(duration=0.5))
    assert list(run.channels) == channel_names(Condition.SURFACE)
    for name, array in run.channels.items():
        assert array.shape == (500, *CHANNELS[name].shape)
        assert array.dtype == np.float64
    assert run.time == pytest.approx(np.arange(500) * 0.001, abs=1e-15)
    assert run.surface == pytest.approx(run.slope * run.error + run.rate_error, abs=1e-15)
    assert np.linalg.norm(run.attitude, axis=1) == pytest.approx(np.ones(500), abs=1e-12)


def test_initial_errors_are_where_the_run_starts():
    run = simulate(Experiment(initial_error=(0.1, -0.2, 0.3), initial_rate_error=(0.5, 0.0, -0.5), duration=0.01))
    assert run.error[0] == pytest.approx((0.1, -0.2, 0.3))
    assert run.rate_error[0] == pytest.approx((0.5, 0.0, -0.5))


def test_thinning_keeps_every_nth_and_the_full_metrics():
    full, thin = (simulate(Experiment(duration=9.0), record_every=every) for every in (1, 7))
    assert np.array_equal(thin.time, full.time[::7])
    assert np.array_equal(thin.torque, full.torque[::7])
    assert thin.metrics == full.metrics


def test_without_series_the_metrics_are_the_same():
    with_series, without = (simulate(Experiment(duration=3.0), keep_series=keep) for keep in (True, False))
    assert len(without) == 0
    assert without.metrics == with_series.metrics


def test_divergence_is_an_outcome_with_time_reason_and_data():
    run = simulate(Experiment(disturbance={"name": "constant", "amplitude": 50.0}))
    assert run.outcome.status is Status.DIVERGED
    assert run.outcome.time == pytest.approx(len(run) * 0.001)
    assert "rad/s" in run.outcome.reason
    assert all(np.isfinite(array).all() for array in run.channels.values())


def test_stopping_keeps_what_was_simulated():
    run = simulate(Experiment(duration=1000.0), stop=iter([False] * 124 + [True]).__next__)
    assert run.outcome.status is Status.INTERRUPTED
    assert 0 < len(run) < 1_000_000
    assert run.outcome.time == pytest.approx(len(run) * 0.001)


def test_a_short_run_is_judged_by_its_second_half():
    assert simulate(Experiment(duration=1.0)).measurement.steady_from == 0.5
    assert simulate(Experiment(duration=3.0)).measurement.steady_from == 2.0
    assert simulate(Experiment(duration=3.0, steady_from=1.0)).measurement.steady_from == 1.0


def test_the_model_travels_with_the_package():
    assert Experiment(model=None).nominal().model.nbody == 4


def test_a_random_reference_follows_the_seed_and_the_run_knows_which_motion_it_was():
    runs = [simulate(Experiment(reference="beating_heart", seed=seed, duration=0.5)) for seed in (1, 1, 2)]
    assert np.array_equal(runs[0].desired_attitude, runs[1].desired_attitude)
    assert not np.array_equal(runs[0].desired_attitude, runs[2].desired_attitude)
    again = runs[2].experiment.drawn_reference.motion(runs[2].time)
    assert np.array_equal(again["attitude"], runs[2].desired_attitude)


def test_a_complaint_of_several_parameters_together_is_in_its_own_words():
    with pytest.raises(ParameterError) as caught:
        Experiment(actuation={"name": "spherical_motor", "coils": 25})
    assert one_line(caught.value) == "actuation spherical_motor: 25 coils do not spread evenly over 2 layers"


def test_a_parameter_with_a_name_that_records_keep_is_refused(tmp_path):
    """Interpreted, ``parameters.mean`` would silently be NumPy's method."""
    (tmp_path / "law.py").write_text(LAW.replace("stiffness", "mean").replace("from helper import spring\n", ""))
    with pytest.raises(LawError) as caught:
        simulate(Experiment(law=f"{tmp_path / 'law.py'}:Spring", duration=0.1))
    assert "cannot be called 'mean'" in one_line(caught.value)


def test_stopping_before_the_first_period_is_an_interruption_and_no_complaint():
    """The pass that finds the disturbance's size is cut short then: nothing may follow from what it found."""
    run = simulate(Experiment(duration=100.0), stop=lambda: True)
    assert run.outcome.status is Status.INTERRUPTED
    assert (run.outcome.time, len(run), run.metrics.rms_error_rad) == (0.0, 0, None)
