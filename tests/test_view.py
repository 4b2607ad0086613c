"""Recordings in the native viewer: what it shows, that only this machine sees it, and that it leaves nothing behind."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import pytest
import rerun_cli
from matplotlib.image import imread
from rerun.experimental import ViewerClient

import needs
from sampling import some
from spherical_wrist import Experiment, load_recording, record, simulate
from spherical_wrist.cli import main
from spherical_wrist.colours import AXES, rgb
from spherical_wrist.recording.address import Address, free_port, is_listening
from spherical_wrist.recording.screenshot import Screenshot
from spherical_wrist.wrist import Wrist

pytestmark = pytest.mark.slow
WRIST = [sys.executable, "-c", "from spherical_wrist.cli import main; main()"]
SCREEN = {"DISPLAY": ":0"}
"""As if there were one: what is run in these tests opens no window."""

BACKGROUND = np.array([58, 64, 74]) / 255.0


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("recordings") / "run.rrd"
    record(simulate(Experiment(duration=4.0)), path)
    return path


@pytest.fixture
def wrist(capsys, monkeypatch, tmp_path):
    """Runs the command in this process, in an empty folder and without a display."""
    monkeypatch.chdir(tmp_path)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)

    def command(*arguments):
        monkeypatch.setattr(sys, "argv", ["wrist", "view", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        printed = capsys.readouterr()
        return end.value.code or 0, printed.out, printed.err

    return command


def wait_for(condition, patience=60.0):
    deadline = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < deadline, "it did not happen"
        time.sleep(0.05)


def near(picture, colour, tolerance=0.06):
    return np.abs(picture - np.asarray(colour)).max(axis=2) < tolerance


# --- a picture -------------------------------------------------------------------------------------------------------


def tip_in(picture, tip):
    """Pixel at which the viewer's camera sees a point of the world, and the pixels of the scene's background."""
    back = near(picture, BACKGROUND, 0.01)
    rows, columns = np.flatnonzero(back.sum(axis=1) > 100), np.flatnonzero(back.sum(axis=0) > 100)
    top, bottom, left, right = rows[0], rows[-1] + 1, columns[0], columns[-1] + 1
    stat = Wrist.load().model.stat
    forward = -np.array([0.60, -0.79, 0.12])  # the model's overview camera
    eye = stat.center - 1.05 * stat.extent * forward
    forward /= np.linalg.norm(forward)
    sideways = np.cross(forward, [0.0, 0.0, 1.0])
    sideways /= np.linalg.norm(sideways)
    seen = tip - eye
    scale = 0.5 * (bottom - top) / np.tan(np.radians(55.0) / 2.0) / (seen @ forward)  # Rerun's field of view
    x = 0.5 * (left + right) + scale * (seen @ sideways)
    y = 0.5 * (top + bottom) - scale * (seen @ np.cross(sideways, forward))
    return round(x), round(y), back


def test_a_picture_shows_the_wrist_where_it_is_at_that_time_and_the_plots(wrist, recording, tmp_path):
    needs.vulkan()
    run = load_recording(recording)
    pictures, backs, tips = [], [], []
    for at in (1.0, 2.5):
        target = tmp_path / f"at-{at}.png"
        code, out, err = wrist(recording, "--screenshot", target, "--at", at, "--size", "1200x800")
        assert (code, out, err) == (0, f"picture {target}\n", "")
        picture = imread(target)[..., :3]
        assert picture.shape == (800, 1200, 3)
        x, y, back = tip_in(picture, run.tip[round(1000 * at)])
        pictures.append(picture)
        backs.append(back)
        tips.append((x, y))
    for k, (x, y) in enumerate(tips):
        patch = (slice(y - 6, y + 7), slice(x - 6, x + 7))
        assert not backs[k][patch].all(), "there is no tip where the recording has it"
    assert np.hypot(*np.subtract(*tips)) > 40.0
    scene = np.zeros((800, 1200), dtype=bool)
    scene[np.ix_(backs[0].sum(axis=1) > 100, backs[0].sum(axis=0) > 100)] = True
    moved = near(pictures[0], (0, 0, 0), 2.0) & (np.abs(pictures[0] - pictures[1]).max(axis=2) > 0.1)
    assert 500 < moved[scene].sum() < 0.3 * scene.sum()  # the wrist and its trail, not all of the scene
    for picture in pictures:
        for colour in AXES:
            drawn = near(picture[:, 620:], np.array(rgb(colour)) / 255.0)
            assert drawn.any(axis=0).sum() > 300, "a curve goes from one side of the plots to the other"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["at-1.0.png", "at-2.5.png"]


def test_what_the_viewer_complains_of_is_told_and_is_exit_code_1(wrist, recording, monkeypatch):
    taken = Screenshot(b"picture", ("Motor torque: warning: no data",))
    monkeypatch.setattr("spherical_wrist.recording.screenshot.screenshot", lambda *_: taken)
    code, out, err = wrist(recording, "--screenshot", "a.png")
    assert (code, out, err) == (1, "picture a.png\n", "wrist: Motor torque: warning: no data\n")
    assert Path("a.png").read_bytes() == b"picture"


def test_a_time_that_is_not_in_the_recording_is_one_line(wrist, recording):
    needs.vulkan()
    code, out, err = wrist(recording, "--screenshot", "a.png", "--at", "4.5", "--size", "300x300")
    assert (code, out) == (2, "")
    assert err == "wrist: error: time 4.5 s is not in the recording, which goes from 0 s to 3.999 s\n"
    assert not Path("a.png").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="hides Mesa's drivers as they are found on Linux")
def test_without_graphics_one_line_says_what_to_install(wrist, recording, monkeypatch):
    for name in ("VK_DRIVER_FILES", "VK_ICD_FILENAMES", "__EGL_VENDOR_LIBRARY_FILENAMES"):
        monkeypatch.setenv(name, "/nonexistent")
    code, out, err = wrist(recording, "--screenshot", "a.png")
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert "apt-get install libvulkan1 mesa-vulkan-drivers" in err
    assert not list(Path().iterdir())


# --- wrong input -----------------------------------------------------------------------------------------------------


def damaged(path, target):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    target.write_bytes(content)
    return target


@pytest.mark.parametrize("options", [[], ["--web", "--no-browser"], ["--screenshot", "a.png"]], ids=" ".join)
@pytest.mark.parametrize("kind", ["missing", "damaged", "foreign"])
def test_what_is_no_whole_recording_is_refused_before_anything_starts(wrist, recording, monkeypatch, kind, options):
    monkeypatch.setenv("RERUN_CLI_PATH", "/nonexistent")
    monkeypatch.setenv("DISPLAY", ":0")
    file = Path("bad.rrd")
    if kind == "damaged":
        damaged(recording, file)
    elif kind == "foreign":
        file.write_bytes(b"\x89PNG\r\n")
    code, out, err = wrist(file, *options)
    assert (code, out) == (2, "")
    assert err.startswith("wrist: error: recording 'bad.rrd' ")
    assert err.count("\n") == 1
    assert "RERUN_CLI_PATH" not in err


WRONG = [
    ["--screenshot", "a.png"],
    ["run.rrd", "--at", "1"],
    ["run.rrd", "--size", "300x300"],
    ["run.rrd", "--no-browser"],
    ["run.rrd", "--web", "--screenshot", "a.png"],
    ["run.rrd", "--port", "9000", "--screenshot", "a.png"],
    ["run.rrd", "--screenshot", "a.png", "--size", "300"],
    ["run.rrd", "--screenshot", "a.png", "--size", "199x300"],
    ["run.rrd", "--screenshot", "a.png", "--size", "300x9000"],
    ["run.rrd", "--screenshot", "a.png", "--at", "soon"],
    ["--port", "0"],
    ["--port", "65536"],
    ["--port", "x"],
    ["run.rrd", "another.rrd"],
]


@pytest.mark.parametrize("arguments", WRONG, ids=" ".join)
def test_wrong_input_is_one_line_exit_code_2(wrist, arguments, monkeypatch):
    monkeypatch.setenv("RERUN_CLI_PATH", "/nonexistent")
    code, out, err = wrist(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith("wrist: error: ")
    assert err.count("\n") == 1
    assert "RERUN_CLI_PATH" not in err
    assert not list(Path().iterdir())


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have a display")
@pytest.mark.parametrize("files", [0, 1])
def test_without_a_display_one_line_says_what_else_there_is(wrist, recording, files):
    code, out, err = wrist(*[recording] * files, "--port", free_port())
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert "--web" in err
    assert "--screenshot" in err


# --- the process -----------------------------------------------------------------------------------------------------


@pytest.fixture
def program(tmp_path, monkeypatch):
    """Puts a shell script in the place of Rerun's program."""

    def write(script):
        path = tmp_path / "program"
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(0o755)
        monkeypatch.setenv("RERUN_CLI_PATH", str(path))

    return write


def test_the_command_ends_when_the_viewer_is_closed(wrist, recording, program, monkeypatch):
    program('echo "$CI" "$@" > arguments')
    monkeypatch.setenv("DISPLAY", ":0")
    port = free_port()
    assert wrist(recording, "--port", port) == (0, "", "")
    expected = f"true {recording} --port {port} --hide-welcome-screen --bind 127.0.0.1\n"
    assert Path("arguments").read_text() == expected


def test_a_viewer_that_fails_says_why_in_one_line(wrist, recording, program, monkeypatch):
    program('echo "INFO starting" >&2; echo "Error: the sky is falling" >&2; exit 3')
    monkeypatch.setenv("DISPLAY", ":0")
    code, out, err = wrist(recording, "--port", free_port())
    assert (code, out) == (2, "")
    assert err == "wrist: error: the viewer ended with exit code 3: Error: the sky is falling\n"


def started(tmp_path, script, *arguments, first="", **environment):
    """The command in a process of its own with ``script`` for Rerun's program, and what that has become.

    ``first`` is what it does before the command.
    """
    program, mark = tmp_path / "program", tmp_path / "pid"
    program.write_text(f'#!/bin/sh\necho $$ > "{mark}.part"; mv "{mark}.part" "{mark}"\n{script}\n')
    program.chmod(0o755)
    variables = {**os.environ, **SCREEN, "RERUN_CLI_PATH": str(program), **environment}
    process = subprocess.Popen(
        [*WRIST[:2], first + WRIST[2], "view", *map(str, arguments)],
        env=variables,
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_for(lambda: mark.exists() or process.poll() is not None)
    return process, psutil.Process(int(mark.read_text()))


def gone(process):
    return not process.is_running() or process.status() == psutil.STATUS_ZOMBIE


WILLING, STUBBORN = "exec sleep 1000", "trap '' TERM; while :; do sleep 0.1; done"
HASTY = "from spherical_wrist.recording import process; process._GRACE = 0.5; "
"""Does not wait as long as usual for a viewer to end."""


@pytest.mark.parametrize(
    ("number", "script"),
    some(
        [(signal.SIGINT, WILLING), (signal.SIGTERM, WILLING), (signal.SIGHUP, WILLING), (signal.SIGTERM, STUBBORN)], 3
    ),
)
def test_a_signal_ends_the_viewer_too(tmp_path, number, script):
    process, viewer = started(tmp_path, script, "--port", free_port(), first=HASTY)
    process.send_signal(number)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 128 + number
    assert err == ""
    assert "waiting for live runs" in out
    assert gone(viewer)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux ends a child with its parent")
def test_kill_9_leaves_no_viewer(tmp_path):
    process, viewer = started(tmp_path, WILLING, "--port", free_port())
    process.kill()
    process.communicate(timeout=30)
    wait_for(lambda: gone(viewer))


def test_everything_listens_on_this_machine_only_and_a_second_recording_goes_to_the_open_viewer(
    wrist, tmp_path, recording
):
    needs.vulkan()
    port = free_port()
    program = Path(rerun_cli.__file__).with_name("rerun")
    real = f"exec '{program}' --headless \"$@\""
    home = tmp_path / "home"
    home.mkdir()
    process, viewer = started(tmp_path, real, "--port", port, HOME=str(home))
    try:
        wait_for(lambda: is_listening(port))
        everyone = [viewer, *viewer.children(recursive=True), psutil.Process(process.pid)]
        sockets = [each for one in everyone for each in one.net_connections("inet")]
        hosts = {each.laddr.ip for each in sockets if each.status == psutil.CONN_LISTEN}
        assert hosts == {"127.0.0.1"}
        code, out, _ = wrist(recording, "--port", port)
        assert (code, out) == (0, f"shown in the viewer that is open already, on 127.0.0.1:{port}\n")
        client = ViewerClient.connect(Address(port=port).url)
        wait_for(lambda: client.get_state().recordings)
        code, _, err = wrist("--port", port)
        assert (code, err.count("\n")) == (2, 1)
        assert "listens" in err
    finally:
        process.terminate()
        process.communicate(timeout=30)
    assert process.returncode == 143
    wait_for(lambda: not is_listening(port))
    assert not list(home.rglob("analytics.json"))  # not even an identity to send telemetry with
