"""Films: decoded again, their pixels where an independent projection says, on machines that lack what they need."""

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import mujoco
import numpy as np
import psutil
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation, Slerp

from rigs import mjcf, one_line
from sampling import some
from spherical_wrist import Experiment, record, simulate
from spherical_wrist.errors import ParameterError, RecordingError
from spherical_wrist.film import FilmError, FilmSettings, mp4, render_film, render_picture
from spherical_wrist.film.caption import in_mm
from spherical_wrist.film.frames import ACTUAL_COLOUR, DESIRED_COLOUR, Frames
from spherical_wrist.film.motion import Poses
from spherical_wrist.film.opengl import Renderer
from spherical_wrist.wrist import default_model

av = pytest.importorskip("av")

pytestmark = pytest.mark.slow
WRIST = [sys.executable, "-c", "from spherical_wrist.cli import main; main()"]
GL = ("MUJOCO_GL", "PYOPENGL_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY")
SMALL = (320, 180)
SHAFT = np.array([0.0, 0.0, -0.062])  # middle of the tool's shaft, in the frame of the rotor


@pytest.fixture(scope="module", autouse=True)
def opengl():
    """Nothing here means anything without OpenGL; where CI runs, it is there."""
    try:
        model = mujoco.MjModel.from_xml_string("<mujoco/>")
        Renderer(model, (64, 64)).close()
    except FilmError as error:
        if "CI" in os.environ:
            raise
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def loose():
    """A run that is far off at the start."""
    return simulate(Experiment(law="pd", initial_error=(0.7, 0.3, 0.4), duration=2.0))


@pytest.fixture(scope="module")
def recorded(loose, tmp_path_factory):
    """Return its recording."""
    record(loose, path := tmp_path_factory.mktemp("recorded") / "run.rrd")
    return path


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """The same run of a model whose pictures take a third of the time, for tests of what is around the pictures."""
    text, fine = default_model().read_text(), '<quality shadowsize="4096" offsamples="8"'
    assert fine in text
    path = tmp_path_factory.mktemp("plain") / "plain.xml"
    path.write_text(text.replace(fine, '<quality shadowsize="64" offsamples="0"'))
    return simulate(Experiment(model=path, law="pd", initial_error=(0.7, 0.3, 0.4), duration=2.0))


@pytest.fixture(scope="module")
def exact():
    """A run whose errors cannot be seen."""
    return simulate(Experiment(law="computed_torque", disturbance=0, mass_scale=1, duration=2.0))


def inside(folder):
    return sorted(path.name for path in Path(folder).iterdir())


def opened(path):
    """A still picture, or the first one of a film."""
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB")).astype(int)


def unfolded(path):
    """The pictures of a GIF, how long each lasts [ms], and how often it plays."""
    with Image.open(path) as gif:
        shown = []
        for number in range(gif.n_frames):
            gif.seek(number)
            shown.append((np.asarray(gif.convert("RGB")).astype(int), gif.info["duration"]))
        return [picture for picture, _ in shown], [duration for _, duration in shown], gif.info["loop"]


def decoded(path):
    """The pictures of a film, and its stream."""
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)], stream


def pictures(run, instants, **shot):
    with run.plant() as plant, Frames(run, plant, Poses.of(run), FilmSettings(**{"size": SMALL, **shot})) as frames:
        return [frames.at(instant).astype(int) for instant in instants]


def projected(points, size=SMALL):
    """Return the columns and rows at which the overview camera of the package's model sees points."""
    model = mujoco.MjModel.from_xml_path(str(default_model()))
    camera = model.camera("overview")
    axes = Rotation.from_quat(camera.quat, scalar_first=True)
    x, y, z = axes.inv().apply(np.atleast_2d(points) - camera.pos).T
    focal = 0.5 * size[1] / np.tan(0.5 * np.radians(camera.fovy[0]))
    return np.stack([0.5 * size[0] - focal * x / z, 0.5 * size[1] + focal * y / z], axis=1)


def like(picture, rgb, tolerance=60):
    """Return the columns and rows of the pixels that nearly have a colour."""
    rows, columns = np.nonzero(np.abs(picture - np.array(rgb)).max(axis=2) < tolerance)
    return np.stack([columns + 0.5, rows + 0.5], axis=1)


def nearest(pixels, place):
    return np.linalg.norm(pixels - place, axis=1).min(initial=np.inf)


def row_at(run, instant):
    return int(np.argmin(np.abs(run.time - instant)))


def test_motion_between_thinned_samples_is_the_shortest_arc(loose):
    thinned = loose.rows(slice(None, None, 100))
    flipped = thinned.replaced(attitude=thinned.attitude * np.where(np.arange(len(thinned)) % 2, -1.0, 1.0)[:, None])
    instants = np.array([0.0, 0.03, 0.05, 0.1, 0.777, 1.234, 1.9])
    arc = Slerp(thinned.time, Rotation.from_quat(thinned.attitude, scalar_first=True))(instants)
    found = Rotation.from_quat(Poses.of(flipped).attitudes(instants), scalar_first=True)
    assert (found * arc.inv()).magnitude().max() < 1e-12
    every = Poses.of(loose).desired_attitudes(loose.time)
    assert np.abs(np.einsum("ij,ij->i", every, loose.desired_attitude)).min() > 1.0 - 1e-12


def test_a_run_that_diverged_is_shown_up_to_its_last_pose(plain, tmp_path):
    lost = plain.attitude.copy()
    lost[700:] = np.nan
    film = render_film(plain.replaced(attitude=lost), tmp_path / "lost.mp4", FilmSettings(size=(64, 64), fps=10))
    assert film.frames == 7
    far = np.where(np.arange(len(plain))[:, None] < 700, plain.tip, 1e9)
    assert Poses.of(plain.replaced(tip=far)).end == pytest.approx(0.7)
    with pytest.raises(RecordingError, match="nothing to show"):
        Poses.of(plain.replaced(attitude=lost * np.nan))


@pytest.mark.parametrize(("speed", "duration"), [(1.0, 1.0), (0.5, 2.0), (4.0, 0.25)])
def test_mp4_has_the_frames_size_and_duration_that_were_asked_for(plain, tmp_path, speed, duration):
    film = render_film(plain, tmp_path / "run.mp4", FilmSettings(size=(128, 72), speed=speed, fps=4, end=1.0))
    frames, stream = decoded(film.path)
    assert film.frames == len(frames) == round(4 * duration)
    assert film.duration == pytest.approx(duration)
    assert float(stream.duration * stream.time_base) == pytest.approx(duration, abs=1e-3)
    assert {frame.shape for frame in frames} == {(72, 128, 3)}
    assert (stream.average_rate, stream.codec_context.name, stream.codec_context.pix_fmt) == (4, "h264", "yuv420p")
    content = film.path.read_bytes()
    assert content.index(b"moov") < content.index(b"mdat")  # plays while it is loaded


def test_both_formats_show_what_was_rendered(loose, tmp_path):
    shot = FilmSettings(size=SMALL, fps=5, start=0.4, end=1.0)
    expected = pictures(loose, 0.4 + 0.2 * np.arange(3), start=0.4, end=1.0)
    frames, _ = decoded(render_film(loose, tmp_path / "run.mp4", shot).path)
    shown, durations, loop = unfolded(render_film(loose, tmp_path / "run.gif", shot).path)
    assert (durations, loop) == ([200] * 3, 0)
    for film, close in ((frames, 2.0), (shown, 3.0)):
        for number, frame in enumerate(film):
            off = [np.abs(picture - frame).mean() for picture in expected]
            assert off[number] < close
            assert np.argmin(off) == number
    assert max(np.abs(picture - frame).max() for picture, frame in zip(expected, shown, strict=True)) < 100


def test_colours_of_mp4_are_those_of_high_definition(tmp_path):
    """ITU-R BT.709, equations 3.2 and 3.4, with the levels of 8 bits; and the file says so."""
    colours = np.array([(255, 130, 20), (20, 190, 110), (200, 210, 220)], dtype=np.uint8)
    picture = np.ascontiguousarray(np.broadcast_to(np.repeat(colours, 32, axis=0), (64, 96, 3)))
    mp4.write(tmp_path / "flat.mp4", (96, 64), Fraction(10), 1, lambda number: picture)
    with av.open(str(tmp_path / "flat.mp4")) as container:
        (frame,) = container.decode(video=0)
    luma = 16.0 + 219.0 * (colours / 255.0) @ (0.2126, 0.7152, 0.0722)
    assert np.abs(frame.to_ndarray()[32, 16:96:32] - luma).max() < 1.5
    assert (frame.colorspace, frame.color_range) == (1, 1)
    assert np.abs(frame.to_ndarray(format="rgb24")[32, 16::32].astype(int) - colours).max() < 5


def test_the_same_run_gives_the_same_film_to_the_last_bit(loose, tmp_path):
    for suffix in (".mp4", ".gif"):
        shot = FilmSettings(size=(64, 64), fps=4, end=0.5)
        both = [render_film(loose, tmp_path / f"{name}{suffix}", shot).path for name in "ab"]
        assert both[0].read_bytes() == both[1].read_bytes()


def test_frames_of_a_gif_last_what_they_say(plain, tmp_path):
    film = render_film(plain, tmp_path / "run.gif", FilmSettings(size=(64, 64), fps=30, end=0.12))
    assert film.fps == Fraction(100, 3)
    assert unfolded(film.path)[1] == [30] * 4
    for name in ("attitude", "desired_attitude", "tip", "desired_tip"):
        plain = plain.replaced(**{name: np.tile(getattr(plain, name)[:1], (len(plain), 1))})
    film = render_film(plain, tmp_path / "still.gif", FilmSettings(size=(64, 64), fps=2, speed=1e-3, end=2e-3))
    frames, durations, _ = unfolded(film.path)
    assert sum(durations) == 4 * 500  # frames that are all the same are stored once, for as long as all of them last
    assert (frames[0][:20] == frames[-1][:20]).all()
    assert film.duration == 2.0
    with pytest.raises(ParameterError, match="at most 50"):
        render_film(plain, tmp_path / "fast.gif", FilmSettings(fps=100))
    assert not (tmp_path / "fast.gif").exists()


def test_the_tool_is_where_the_attitude_says(loose):
    size, instants = (640, 360), (0.02, 0.5, 1.0, 1.5)
    places = []
    for instant, picture in zip(instants, pictures(loose, instants, size=size, ghost=False), strict=True):
        row = row_at(loose, instant)
        shaft = Rotation.from_quat(loose.attitude[row], scalar_first=True).apply(SHAFT)
        places.append((picture, projected(shaft, size)[0]))
        # the newest end of the trail, where the recording, not the film, says the tip is
        assert nearest(like(picture, ACTUAL_COLOUR), projected(loose.tip[row], size)[0]) < 4.0
    for picture, place in places:
        column, line = place.astype(int)
        assert picture[line, column].max() < 130  # dark iron, or the stripe on it, whose blue is small
        for _, other in places:
            if np.linalg.norm(other - place) > 25.0:
                column, line = other.astype(int)
                assert picture[line, column].min() > 150  # backdrop


def test_trails_are_the_last_second_and_a_half_and_fade(exact):
    size, now = (1280, 720), 1.95
    (picture,) = pictures(exact, [now], size=size, ghost=False)
    drop = {}
    for age in (0.6, 1.0, 1.2, 1.4, 1.55, 1.6):  # where the trail does not cross itself
        column, line = projected(exact.tip[row_at(exact, now - age)], size)[0].astype(int)
        blue = picture[..., 2]  # of which the trail has little and the backdrop much
        drop[age] = blue[line - 14, column] - blue[line - 2 : line + 3, column - 2 : column + 3].min()
    assert drop[0.6] > drop[1.0] + 20 > drop[1.2] + 40 > drop[1.4] + 55 > 70
    assert max(drop[1.55], drop[1.6]) < 5


def test_the_ghost_is_seen_where_there_is_an_error_and_only_there(loose, exact):
    size, instant = (640, 360), 0.05
    with_ghost, without = (pictures(loose, [instant], size=size, ghost=ghost)[0] for ghost in (True, False))
    desired = Rotation.from_quat(loose.desired_attitude[row_at(loose, instant)], scalar_first=True)
    column, line = projected(desired.apply(SHAFT), size)[0].astype(int)
    assert without[line, column].min() > 150  # backdrop
    red, green, blue = with_ghost[line, column]
    assert green > max(red, blue) + 30
    tip = projected(loose.desired_tip[row_at(loose, instant)], size)[0]
    assert nearest(like(with_ghost, DESIRED_COLOUR), tip) < 4.0
    assert nearest(like(without, DESIRED_COLOUR), tip) > 40.0

    view = (slice(0, 260), slice(0, 640))  # without the caption, whose legend differs
    both = [pictures(exact, [1.3], size=size, ghost=ghost)[0][view] for ghost in (True, False)]
    assert (np.abs(both[0] - both[1]).max(axis=2) > 24).mean() < 2e-4


def test_captions_tell_time_and_error_without_jumping():
    assert in_mm(0.0346, 0.0346) == "34.6 mm"
    assert in_mm(0.0041, 0.0346) == "4.1 mm"
    assert in_mm(2.69e-5, 3.98e-5) == "0.0269 mm"
    assert in_mm(7.3e-11, 9.9e-8) == "0.0000001 mm"
    assert in_mm(0.0, 0.0) == "0.00 mm"


def test_any_wrist_can_be_filmed(tmp_path):
    """No camera, no light, no backdrop, a small offscreen buffer, a ball off its body's origin, a mesh."""
    mesh = '<asset><mesh name="m" vertex="0 0 0 .03 0 0 0 .03 0 0 0 -.06"/></asset>'
    body = '<geom type="mesh" mesh="m"/><site name="tip" pos="0.001 0 -0.1"/>'
    path = tmp_path / "other.xml"
    path.write_text(mjcf(body, more=mesh))
    run = simulate(Experiment(model=path, law="pd", duration=0.2, initial_error=(0.5, 0, 0)))
    film = render_picture(run, tmp_path / "other.png", 0.1, FilmSettings(size=(720, 500)))
    assert film.camera == "free"
    picture = opened(film.path)
    assert picture.shape == (500, 720, 3)
    assert picture[:40].mean() > 150  # a backdrop
    assert like(picture, DESIRED_COLOUR).size
    assert (picture[100:400, 200:520].mean(axis=2) < 120).mean() > 0.05  # and the wrist before it


def test_rendering_leaves_simulating_as_it_is(loose, tmp_path):
    render_picture(loose, tmp_path / "a.png", settings=FilmSettings(size=(64, 64)))
    again = simulate(loose.experiment)
    assert all(
        (getattr(again, name) == array).all() for name, array in loose.channels.items() if name in ("rate", "tip")
    )
    assert again.metrics == loose.metrics


def test_the_law_of_a_recording_need_not_be_there(loose, tmp_path):
    gone = {**loose.description, "law": {"name": "/gone/law.py:Mine"}}
    film = render_picture(
        replace(loose, description=gone, _experiment=None), tmp_path / "a.png", 1.0, FilmSettings(size=SMALL)
    )
    assert film.path.is_file()


def test_command_makes_films_and_pictures_and_tells(wrist, loose):
    record(loose, "run.rrd")
    code, out, err = wrist("render", "run.rrd", "--size", "96x64", "--to", "1", "--fps", "8", "--speed", "2", "--json")
    assert (code, err) == (0, "")
    assert json.loads(out) == {
        "recording": "run.rrd",
        "output": "run.mp4",
        "frames": 4,
        "width": 96,
        "height": 64,
        "fps": 8.0,
        "duration_s": 0.5,
        "from_s": 0.0,
        "to_s": 1.0,
        "camera": "overview",
        "bytes": Path("run.mp4").stat().st_size,
    }
    assert len(decoded("run.mp4")[0]) == 4
    code, out, _ = wrist("render", "run.rrd", "-o", "a.gif", "--size", "97x65", "--to", "0.1", "--fps", "30")
    assert (code, opened("a.gif").shape) == (0, (65, 97, 3))
    assert "33.33 fps instead of 30" in " ".join(out.split())
    code, out, _ = wrist("render", "run.rrd", "--frame", "a.png", "--size", "320x180", "--json", "--no-ghost")
    worst = loose.time[np.argmax(np.linalg.norm(loose.tip - loose.desired_tip, axis=1))]
    assert (code, json.loads(out)["from_s"]) == (0, worst)
    assert (opened("a.png") == pictures(loose, [worst], ghost=False)[0]).all()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("damaged.rrd", "damaged.rrd"),
        ("missing.rrd", "no such file"),
        ("run.rrd --size 641x360", "even for MP4 (H.264); try 642x360"),
        ("run.rrd --size 640", "WIDTHxHEIGHT"),
        ("run.rrd --size 8x8", "from 64 to 8192"),
        ("run.rrd --camera overveiw", "did you mean 'overview'? (valid: free, overview)"),
        ("run.rrd -o film.avi", "(valid: .gif, .mp4)"),
        ("run.rrd -o film", "(valid: .gif, .mp4)"),
        ("run.rrd --frame a.jpg", "(valid: .png)"),
        ("run.rrd --frame a.png --at 2.5", "the recording is from 0 s to 2 s"),
        ("run.rrd --frame a.png --speed 2", "--speed is for films"),
        ("run.rrd --frame a.png -o b.mp4", "-o is for films"),
        ("run.rrd --at 1", "--frame"),
        ("run.rrd --to 3", "to 3 s: the recording is from 0 s to 2 s"),
        ("run.rrd --from 1.5 --to 1", "must come after"),
        ("run.rrd --speed 0", "greater than 0"),
        ("run.rrd --fps 1000", "240"),
        ("run.rrd -o nowhere/film.gif --size 64x64", "create its directory first"),
    ],
)
def test_wrong_input_is_told_in_one_line_and_leaves_nothing(wrist, recorded, arguments, words):
    shutil.copy(recorded, "run.rrd")
    Path("damaged.rrd").write_bytes(Path("run.rrd").read_bytes()[:20_000])
    before = inside(".")
    code, out, err = wrist("render", *arguments.split())
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert words in err
    assert inside(".") == before


NO_LIBRARY = """
import ctypes
found = ctypes.CDLL.__init__
def load(self, name, *rest, **more):
    if any(part in str(name) for part in ("EGL", "libGL", "OpenGL", "OSMesa")):
        raise OSError(f"{name}: cannot open shared object file")
    found(self, name, *rest, **more)
ctypes.CDLL.__init__ = load
"""


MISSING = {
    "no library": (NO_LIBRARY, {}, "libegl1 libgl1-mesa-dri libopengl0"),
    "no library, and it is asked for": (NO_LIBRARY, {"MUJOCO_GL": "osmesa"}, "apt install libosmesa6"),
    "no driver": ("", {"__EGL_VENDOR_LIBRARY_DIRS": "/nowhere"}, "libegl1 libgl1-mesa-dri libopengl0"),
}


@pytest.mark.skipif(sys.platform != "linux", reason="these are Linux's libraries")
@pytest.mark.parametrize("missing", some(MISSING, 3))
def test_missing_opengl_is_told_in_one_line(loose, tmp_path, missing):
    broken, environment, words = MISSING[missing]
    record(loose, tmp_path / "run.rrd")
    kept = {name: value for name, value in os.environ.items() if name not in GL}
    command = [*WRIST[:2], broken + WRIST[2], "render", "run.rrd", "-o", "a.gif", "--size", "64x64"]
    done = subprocess.run(
        command, cwd=tmp_path, env={**kept, **environment}, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert words in done.stderr
    assert inside(tmp_path) == ["run.rrd"]


def test_missing_pyav_and_forbidden_opengl_are_told_in_one_line(wrist, loose, monkeypatch):
    record(loose, "run.rrd")
    monkeypatch.setenv("MUJOCO_GL", "off")
    assert "MUJOCO_GL=off forbids" in wrist("render", "run.rrd")[2]
    monkeypatch.setenv("MUJOCO_GL", "vulkan")
    assert "MUJOCO_GL=vulkan is not known" in wrist("render", "run.rrd")[2]
    monkeypatch.setitem(sys.modules, "av", None)
    code, _, err = wrist("render", "run.rrd")
    assert (code, err.count("\n")) == (2, 1)
    assert "pip install 'spherical-wrist[video]'" in err
    assert inside(".") == ["run.rrd"]


@pytest.mark.skipif(sys.platform != "linux", reason="EGL is the choice on Linux only")
def test_no_screen_and_no_setting_are_needed(loose, tmp_path):
    record(loose, tmp_path / "run.rrd")
    clean = {name: value for name, value in os.environ.items() if name not in GL}
    clean = {**clean, "DISPLAY": ":987"}  # a screen that is not there
    command = [*WRIST, "render", "run.rrd", "--frame", "a.png", "--size", "64x64"]
    subprocess.run(command, cwd=tmp_path, env=clean, capture_output=True, check=True)
    assert opened(tmp_path / "a.png").shape == (64, 64, 3)


def begun(process, folder):
    """Return True while a film is being written: its file, which has no name yet on Linux, is open."""
    if sys.platform != "linux":
        return worked(process) > 2.3
    links = []
    for link in Path(f"/proc/{process.pid}/fd").iterdir():
        with contextlib.suppress(OSError):
            links.append(str(link.readlink()))
    return any(link.startswith(str(folder)) and link.endswith("(deleted)") for link in links)


def worked(process):
    """The time that a processor has worked for it [s]."""
    return sum(psutil.Process(process.pid).cpu_times()[:2])


@pytest.mark.parametrize(("number", "code"), some([(signal.SIGTERM, 143), (signal.SIGINT, 130)], 2))
def test_a_film_that_is_stopped_leaves_nothing(loose, tmp_path, number, code):
    record(loose, tmp_path / "run.rrd")
    (tmp_path / "run.mp4").write_text("what was here before")
    command = [*WRIST, "render", "run.rrd", "--fps", "200", "--speed", "0.01", "--size", "64x64"]
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        while not begun(process, tmp_path):
            assert process.poll() is None
            time.sleep(0.02)
        until = worked(process) + 0.7  # some frames later; all would take minutes
        while worked(process) < until:
            assert process.poll() is None
            time.sleep(0.02)
        assert begun(process, tmp_path)
        process.send_signal(number)
        process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == code
    assert inside(tmp_path) == ["run.mp4", "run.rrd"]
    assert (tmp_path / "run.mp4").read_text() == "what was here before"


@pytest.mark.parametrize("suffix", ["mp4", "gif"])
def test_a_full_disk_is_told_and_leaves_nothing(plain, tmp_path, suffix):
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2000, before[1]))
    try:
        with pytest.raises(RecordingError) as caught:
            render_film(plain, tmp_path / f"run.{suffix}", FilmSettings(size=(128, 72), fps=5))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert "cannot be written" in one_line(caught.value)
    assert not inside(tmp_path)
