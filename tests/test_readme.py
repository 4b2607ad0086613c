"""The README's examples run, in order, as they stand."""

import re
from pathlib import Path

import pytest

from spherical_wrist import Experiment, simulate
from spherical_wrist.simulation.outcome import Status

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def test_python_examples_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    first, law, tests = blocks("python")
    exec(compile(first, "README.md", "exec"), {"__name__": "readme"})
    (tmp_path / "my_law.py").write_text(law)
    run = simulate(Experiment(law="my_law.py:Spring", duration=0.5))
    assert run.outcome.status is Status.COMPLETED
    scope = {"__name__": "readme"}
    exec(compile(tests, "README.md", "exec"), scope)
    for name in [name for name in scope if name.startswith("test_")]:
        scope[name]()


def test_the_experiment_file_is_valid(tmp_path):
    (text,) = blocks("toml")
    file = tmp_path / "experiment.toml"
    file.write_text(text)
    given = Experiment.from_toml(file)
    assert given.disturbance.name == "noise"


def test_the_printed_table_is_that_of_the_default_run():
    metrics = simulate(Experiment()).metrics
    for value in (metrics.rms_error_rad, metrics.max_error_rad):
        assert f"{value:.3e}" in README
    for name in ("rms_tip_error_mm", "max_tip_error_mm", "chattering_Nm_per_s", "peak_torque_Nm", "max_tilt_rad"):
        assert f"{getattr(metrics, name):.4g}" in README


@pytest.mark.parametrize(
    ("law", "rms", "tip"),
    [
        ("pd", "8.4·10⁻²", "4.4"),
        ("computed_torque", "8.6·10⁻²", "4.9"),
        ({"name": "computed_torque", "Kp": 10000, "Kv": 200}, "3.5·10⁻³", "0.20"),
        ("sliding_computed_torque", "2.7·10⁻³", "0.16"),
        ("sliding_mode", "8.4·10⁻⁴", "0.048"),
        ("adaptive_fuzzy_sliding_computed_torque", "3.3·10⁻⁴", "0.024"),
        ("fuzzy_sliding_computed_torque", "4.7·10⁻⁴", "0.027"),
        ({"switching": "sign"}, "1.9·10⁻⁴", "0.014"),
        ("time_delay_control", "9.2·10⁻⁶", "0.0010"),
        ("boundary_layer_sliding_mode", "9.4·10⁻⁶", "0.0010"),
        ("computed_torque_integral", "8.6·10⁻⁶", "0.00096"),
        ("slotine_li", "8.5·10⁻⁶", "0.00095"),
        ("super_twisting", "8.4·10⁻⁶", "0.00094"),
        ("geometric_tracking", "8.3·10⁻⁶", "0.00093"),
        ("computed_torque_observer", "1.2·10⁻⁶", "0.00014"),
        ("fuzzy_integral_sliding", "6.6·10⁻⁷", "0.000073"),
    ],
)
def test_the_table_of_laws_is_true(law, rms, tip):
    metrics = simulate(Experiment(law=law)).metrics
    digits = f"{metrics.rms_error_rad:.1e}"
    power = str(int(digits[-3:])).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    assert f"{digits[:3]}·10{power}" == rms
    assert f"{metrics.rms_tip_error_mm:.2g}" == f"{float(tip):.2g}"
    assert f"| {rms} | {tip} |" in README
