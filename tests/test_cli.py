"""The command line: what it prints, what it writes, its exit codes, and that no wrong input gives a traceback."""

import json
import os
import re
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from sampling import some
from spherical_wrist import Experiment, load_recording, simulate
from spherical_wrist.cli.list import family_title
from spherical_wrist.experiment.description import PARTS
from spherical_wrist.experiment.options import OPTIONS
from spherical_wrist.measure.metrics import METRICS

WRIST = [sys.executable, "-c", "from spherical_wrist.cli import main; main()"]
TELLS = """
import os, sys
to, told = int(sys.argv.pop(1)), []
def listen(event, args):
    if event == "ctypes.dlsym" and args[1] == "mjcb_time" and not told:
        told.append(os.write(to, b"simulating\\n"))
sys.addaudithook(listen)
from spherical_wrist.cli import main
main()
"""
"""The command, which tells through a pipe when it begins to simulate, as Python's own audit events say."""


def test_json_is_one_object_with_the_promised_keys(wrist):
    code, out, err = wrist("run", "--json", "--duration", "3")
    told = json.loads(out)
    assert (code, err) == (0, "")
    assert set(told) == {
        "outcome",
        "verdict",
        "bound_mm",
        "within_bound",
        "warnings",
        "law",
        "reference",
        "duration_s",
        "control_period_s",
        "seed",
        "recording",
        "replaced",
        "wall_time_s",
        "real_time_factor",
        "metrics",
    }
    assert list(told["metrics"]) == list(METRICS)
    assert told["recording"] == "wrist.rrd"
    assert Path("wrist.rrd").is_file()
    expected = simulate(Experiment(duration=3.0)).metrics
    assert told["metrics"] == dict(expected)


def test_options_file_and_settings_reach_the_experiment(wrist):
    Path("e.toml").write_text('mass_scale = 0.5\npayload = 0.01\nlaw = "pd"\n')
    options = ["--law", "computed_torque", "--reference", "sinusoid", "--disturbance", "0.1", "--seed", "3"]
    options += ["--disturbance-shape", "noise", "--mass-scale", "0.75", "--duration", "1", "--control-period", "0.002"]
    code, _, err = wrist("run", "e.toml", *options, "--set", "law.Kp=100", "--set", "reference.amplitude=[0.1,0.2,0.3]")
    assert (code, err) == (0, "")
    given = load_recording("wrist.rrd").experiment
    assert (given.law.name, given.law.Kp) == ("computed_torque", (100.0, 100.0, 100.0))
    assert (given.reference.name, given.reference.amplitude) == ("sinusoid", (0.1, 0.2, 0.3))
    assert (given.disturbance.name, given.disturbance.level) == ("noise", 0.1)
    assert (given.mass_scale, given.payload, given.duration) == (0.75, 0.01, 1.0)
    assert (given.control_period, given.seed) == (0.002, 3)


def test_options_replace_what_would_contradict_them_in_the_file(wrist):
    """A level takes the place of a torque; another shape or law has no use for the parameters of the one before."""
    Path("e.toml").write_text(
        'law = {name = "fuzzy_sliding_computed_torque", K = 0.01}\n'
        'disturbance = {name = "noise", amplitude = 0.1, bandwidth = 5.0}\n'
    )
    options = ["--law", "pd", "--disturbance", "0.1", "--disturbance-shape", "pulse", "--duration", "0.1"]
    code, _, err = wrist("run", "e.toml", *options)
    assert (code, err) == (0, "")
    given = load_recording("wrist.rrd").experiment
    assert given.law.name == "pd"
    assert (given.disturbance.name, given.disturbance.level, given.disturbance.amplitude) == ("pulse", 0.1, None)


def test_table_for_people(wrist):
    code, out, _ = wrist("run", "--duration", "3", "-o", "a.rrd")
    assert code == 0
    for text in ("fuzzy_sliding_computed_torque on lissajous", "completed", "tip error, RMS", "mm", "a.rrd", "t ≥ 2 s"):
        assert text in out


def test_no_recording_writes_nothing(wrist):
    code, out, _ = wrist("run", "--no-recording", "--duration", "0.1", "--json")
    assert (code, json.loads(out)["recording"]) == (0, None)
    assert not list(Path().iterdir())


def test_divergence_is_exit_code_1_and_keeps_its_data(wrist):
    code, out, _ = wrist("run", "--set", "disturbance.amplitude=50", "--json")
    told = json.loads(out)
    assert (code, told["outcome"]) == (1, "diverged")
    assert "rad/s" in told["reason"]
    assert told["metrics"]["rms_error_rad"] is None
    assert len(load_recording("wrist.rrd")) == round(told["ended_at_s"] * 1000)


def test_thinned_recording_says_so(wrist):
    assert wrist("run", "--duration", "3", "--record-every", "10")[0] == 0
    code, out, _ = wrist("inspect", "wrist.rrd")
    assert code == 0
    assert "1 in 10 control instants" in out
    told = json.loads(wrist("inspect", "wrist.rrd", "--json")[1])
    assert (told["record_every"], told["samples"]) == (10, 300)
    assert told["metrics"]["rms_error_rad"] == simulate(Experiment(duration=3.0)).metrics.rms_error_rad


def test_inspect_shows_what_was_run_and_recomputes_its_metrics(wrist):
    law = ("--law", "sliding_computed_torque", "--hardware", "realistic")
    wrist("run", "--duration", "3", "--seed", "5", *law)
    code, out, err = wrist("inspect", "wrist.rrd", "--json")
    told = json.loads(out)
    assert (code, err) == (0, "")
    assert (told["experiment"]["law"]["name"], told["experiment"]["seed"]) == ("sliding_computed_torque", 5)
    assert "mujoco" in told["versions"]
    assert list(told["metrics"]) == list(METRICS)
    assert told["recomputed_metrics"] == {
        name: value and pytest.approx(value) for name, value in told["metrics"].items()
    }
    assert told["mismatches"] == []
    text = wrist("inspect", "wrist.rrd")[1]
    assert text.splitlines()[0] == told["verdict"]
    assert "measured again" in text


def test_list_names_everything_with_units(wrist):
    code, out, _ = wrist("list", "all")
    assert code == 0
    for name in ("pd", "fuzzy_sliding_computed_torque", "lissajous", "noise", "law.K", "N·m", "mass_scale"):
        assert name in out
    told = json.loads(wrist("list", "--json")[1])
    assert told["laws"]["computed_torque"]["parameters"]["Kp"]["unit"] == "1/s²"
    assert {*map(family_title, PARTS), "experiment", "metrics", "warnings"} <= set(told)
    assert told["metrics"]["rms_error_rad"]["unit"] == "rad"


WRONG = [
    ["--law", "computed_tork"],
    ["--law", "none.py:Law"],
    ["--reference", "circle"],
    ["--disturbance", "-1"],
    ["--disturbance", "nan"],
    ["--disturbance-shape", "rectangle"],
    ["--mass-scale", "0"],
    ["--mass-scale", "inf"],
    ["--payload", "-0.1"],
    ["--duration", "0"],
    ["--duration", "long"],
    ["--control-period", "0.0015"],
    ["--control-period", "-0.001"],
    ["--seed", "-1"],
    ["--seed", "1.5"],
    ["--set", "law.k=1"],
    ["--set", "law.K"],
    ["--set", "law.K=[1,2]"],
    ["--set", "nonsense=1"],
    ["--set", "law.K.x=1"],
    ["--record-every", "0"],
    ["--model", "none.xml"],
    ["--model", "e.toml"],
    ["none.toml"],
    ["e.toml"],
    ["--no-such-option"],
    ["-o", "no/such/folder/a.rrd"],
    ["-o", "."],
    ["-o", "e.toml/a.rrd"],
]


@pytest.mark.parametrize("arguments", WRONG, ids=" ".join)
def test_wrong_input_is_one_line_exit_code_2_and_writes_nothing(wrist, arguments):
    Path("e.toml").write_text("mass_scal = 1\n")
    code, out, err = wrist("run", *arguments)
    assert code == 2
    assert out == ""
    assert err.startswith("wrist: error: ")
    assert err.count("\n") == 1
    assert [path.name for path in Path().iterdir()] == ["e.toml"]


@pytest.mark.parametrize("content", [None, b"", b"RRF2 nonsense", b"\0" * 1000])
def test_inspecting_what_is_no_recording_is_one_line(wrist, content):
    if content is not None:
        Path("a.rrd").write_bytes(content)
    code, out, err = wrist("inspect", "a.rrd")
    assert (code, out) == (2, "")
    assert err.startswith("wrist: error: ")
    assert err.count("\n") == 1


def test_a_truncated_recording_is_refused(wrist):
    wrist("run", "--duration", "0.5")
    whole = Path("wrist.rrd").read_bytes()
    Path("wrist.rrd").write_bytes(whole[: len(whole) // 2])
    code, _, err = wrist("inspect", "wrist.rrd")
    assert code == 2
    assert err.count("\n") == 1


@pytest.mark.parametrize("number", some([signal.SIGINT, signal.SIGTERM], 2))
def test_signals_stop_cleanly_and_keep_what_was_simulated(tmp_path, number):
    simulate(Experiment(duration=0.01))  # compiles what the process below then loads, so that it starts at once
    file = tmp_path / "a.rrd"
    # a size in N·m, for which no peak torque has to be found before the run begins
    size = ["--set", "disturbance.amplitude=0.004"]
    options = [*size, "--duration", "36000", "--record-every", "1000", "-o", str(file), "--json"]
    read, write = os.pipe()
    process = subprocess.Popen(
        [sys.executable, "-c", TELLS, str(write), "run", *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        pass_fds=[write],
    )
    os.close(write)
    with os.fdopen(read) as told:
        assert told.readline() == "simulating\n"

    def worked():
        return sum(psutil.Process(process.pid).cpu_times()[:2])

    before = worked()
    while worked() < before + 0.2:  # of its own, however busy the machine is
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(number)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 128 + number, err
    told = json.loads(out)
    assert told["outcome"] == "interrupted"
    assert told["metrics"]["rms_error_rad"] > 0.0
    assert len(load_recording(file)) == -(-round(told["ended_at_s"] * 1000) // 1000)
    assert [path.name for path in tmp_path.iterdir()] == ["a.rrd"]


def test_a_full_disk_is_an_error_and_no_half_file(wrist):
    """A file size limit stands in for the full disk: writing fails in the middle."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, before[1]))
    try:
        code, _, err = wrist("run", "-o", "a.rrd")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)
    assert code == 2, err
    assert err.startswith("wrist: error: ")
    assert err.count("\n") == 1
    assert not list(Path().iterdir())


def test_a_closed_pipe_is_no_traceback(tmp_path):
    command = f"{sys.executable} -c 'from spherical_wrist.cli import main; main()' list | head -1"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert "Traceback" not in done.stderr


def test_help_of_run_has_every_option_of_a_parameter_with_its_declared_default(wrist):
    code, out, _ = wrist("run", "--help")
    assert code == 0
    entries = (" ".join(entry.split()) for entry in re.split(r"\n  (?=-)", out))
    listed = {entry.partition(" ")[0]: entry for entry in entries}
    usual = Experiment().model_dump()
    for option in OPTIONS:
        part, _, own = option.parameter.partition(".")
        default = usual[part] if part not in PARTS else usual[part][own or "name"]
        if default is not None:
            shown = re.search(r"\[(.+)\]$", listed[option.flag])[1]
            assert shown == default if isinstance(default, str) else float(shown) == default


def test_version(wrist):
    code, out, _ = wrist("--version")
    assert code == 0
    assert out.startswith("spherical-wrist ")


def test_the_working_directory_stays_clean(tmp_path):
    """No log of MuJoCo's, no cache: only the recording."""
    environment = {**os.environ, "HOME": str(tmp_path / "home")}
    command = [*WRIST, "run", "--set", "disturbance.amplitude=1e9", "-o", "a.rrd"]
    work = tmp_path / "work"
    work.mkdir()
    done = subprocess.run(command, cwd=work, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1, done.stderr
    assert [path.name for path in work.iterdir()] == ["a.rrd"]
