"""The README is true: its examples run, in order, as they stand, and its figures are those of the runs.

Blocks marked ``sh``, ``python``, ``toml`` and ``sql`` are for real. Those marked ``bash`` are not run: they set up the
repository itself, or need a cluster. A block whose first comment is the name of a file is that file.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import duckdb
import pytest

import needs
from spherical_wrist import Experiment, simulate
from spherical_wrist.campaign.description import Campaign

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(sh|python|toml|sql)\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)
FILE = re.compile(r"# ([\w/]+\.(?:py|toml))\n")


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """A folder that is to a reader as a clone is, with the installed command on the path."""
    for name in ("scripts", "models"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    return tmp_path


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout}\n{done.stderr}"
    assert "Traceback" not in done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
def test_everything_in_it_runs_in_order(clone):
    needs.vulkan()
    needs.opengl()
    for _, text in BLOCKS:
        if named := FILE.match(text):
            Path(named[1]).write_text(text)
    for language, text in BLOCKS:
        named = FILE.match(text)
        if language == "sh":
            run("bash", "-euo", "pipefail", "-c", text)
        elif language == "sql":
            assert duckdb.sql(text).fetchall()
        elif language == "python" and named is None:
            run(sys.executable, "-W", "error", "-c", text)
        elif language == "python" and named[1].startswith("test_"):
            run(sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", named[1])
    for made in ("run.png", "sheet.png", "run.parquet", "run.gif", "compared/comparison.png", "campaign/report.html"):
        assert Path(made).stat().st_size > 1000, made
    assert list(Path("tuned/front").glob("*.toml"))
    assert list(Path("paper").glob("*.svg"))


def test_its_files_are_valid(tmp_path):
    files = {FILE.match(text)[1]: text for language, text in BLOCKS if language == "toml"}
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    assert Experiment.from_toml(tmp_path / "experiment.toml").disturbance.name == "noise"
    assert Campaign.from_toml(tmp_path / "wide.toml").size == 3000


def test_its_links_lead_somewhere():
    for target in re.findall(r"\]\(([^)#\s]+)", README):
        assert target.startswith("https://") or (ROOT / target).exists(), target
    anchors = {re.sub(r"[^\w\- ]", "", line.lstrip("# ").lower()).replace(" ", "-") for line in README.splitlines()}
    assert set(re.findall(r"\]\(#([^)]+)\)", README)) <= anchors


def test_the_printed_table_is_that_of_the_default_run():
    metrics = simulate(Experiment()).metrics
    for value in (metrics.rms_error_rad, metrics.max_error_rad):
        assert f"{value:.3e}" in README
    for name in ("rms_tip_error_mm", "max_tip_error_mm", "chattering_Nm_per_s", "peak_torque_Nm", "max_tilt_rad"):
        assert f"{getattr(metrics, name):.4g}" in README


RIVALS = (
    "time_delay_control",
    "boundary_layer_sliding_mode",
    "computed_torque_integral",
    "slotine_li",
    "super_twisting",
    "geometric_tracking",
    "computed_torque_observer",
)
REALISTIC = {"sensing": "realistic", "actuation": "realistic", "friction": 1e-3}


@pytest.mark.parametrize(("hardware", "paper", "best", "ours"), [({}, 27, 0.14, 0.073), (REALISTIC, 33, 20, 8.3)])
def test_the_main_result_is_true(hardware, paper, best, ours):
    def micrometres(law):
        return 1e3 * simulate(Experiment(law=law, **hardware)).metrics.rms_tip_error_mm

    rivals = {law: micrometres(law) for law in RIVALS}
    assert min(rivals, key=rivals.get) == "computed_torque_observer"
    found = (micrometres("fuzzy_sliding_computed_torque"), min(rivals.values()), micrometres("fuzzy_integral_sliding"))
    for value, printed in zip(found, (paper, best, ours), strict=True):
        assert f"{value:.2g}" == f"{printed:.2g}"
        assert f"{printed:g} µm" in README


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
