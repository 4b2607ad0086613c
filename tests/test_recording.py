"""Recordings: bit-exact, whole or absent, and never mistaken for what they are not."""

import errno
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import mujoco
import numpy as np
import pytest
import rerun as rr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rigs import OPTIONAL, bits, channel_names, random_channels
from sampling import count
from spherical_wrist import files
from spherical_wrist.actuation import Ideal as IdealActuation
from spherical_wrist.actuation import SphericalMotor
from spherical_wrist.channels import Condition, Place
from spherical_wrist.errors import RecordingError
from spherical_wrist.measure.series import Series
from spherical_wrist.prepare.plant import Perturbation, perturbed
from spherical_wrist.recording import metrics_text as summary
from spherical_wrist.recording.experiment_text import experiment_text, title
from spherical_wrist.recording.geometry import visible_geoms
from spherical_wrist.recording.plots import limits
from spherical_wrist.recording.reader import read_recording
from spherical_wrist.recording.writer import write_recording
from spherical_wrist.sensing import Ideal
from spherical_wrist.wrist import Wrist

WRIST = Wrist.load()

PROPERTIES = {
    "experiment": {
        "law": {"name": "pd", "Kp": [400.0, 300.0, 200.0], "flag": True, "nothing": None, "deep": {"a": [[1, 2], []]}},
        "reference": {"name": "lissajous"},
        "disturbance": {"name": "constant", "level": 0.1 + 0.2},
        "seed": 7,
        "model": None,
    },
    "outcome": {"status": "diverged", "time_s": 1.5, "reason": "the rate is not finite | ✗"},
    "metrics": {"rms_error_rad": 1.0 / 3.0, "reaching_time_s": None, "peak_torque_Nm": 5e-324},
    "versions": {"numpy": "2.0"},
    "empty": {},
}


def series_of(rows: int, seed: int = 0, surface: bool = True) -> Series:
    generator = np.random.default_rng(seed)
    names = channel_names(Condition.SURFACE) if surface else channel_names()
    return Series(channels=random_channels(generator, rows, names))


SENSED, DRIVEN, COILS = ("measured_attitude", "measured_rate"), ("commanded_torque",), ("current", "condition")
HARDWARES = [(), SENSED, DRIVEN, DRIVEN + COILS, SENSED + DRIVEN + COILS, ("law_state", *SENSED), OPTIONAL]


def with_extras(rows: int, names: tuple[str, ...], seed: int = 1, surface: bool = True) -> Series:
    """A series with these of its extras."""
    generator = np.random.default_rng(seed)
    return series_of(rows, surface=surface).replaced(**random_channels(generator, rows, names, law_state=5))


HARDWARE = {plot.name for plot in with_extras(1, OPTIONAL).plots() if plot.channel.place is Place.HARDWARE}


def curves_of(series: Series) -> dict[str, np.ndarray]:
    return {plot.name: plot.curves for plot in series.plots()}


def entities_of(path: Path) -> set[str]:
    return {chunk.entity_path for chunk in rr.chunk.RrdReader(path).stream()}


def names_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / "run.rrd"
    write_recording(path, series_of(300), WRIST, PROPERTIES)
    return path


def write(path: Path, rows: int = 50) -> None:
    write_recording(path, series_of(rows), WRIST, PROPERTIES)


# --- what is written is read -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("surface", [True, False])
@pytest.mark.parametrize("rows", [1, 2, 1234])
def test_arrays_come_back_bit_for_bit(tmp_path, rows, surface):
    series = series_of(rows, surface=surface)
    write_recording(tmp_path / "run.rrd", series, WRIST, PROPERTIES, every=3)
    back = read_recording(tmp_path / "run.rrd")
    assert bits(back.series) == bits(series)
    assert all(array.dtype == np.float64 for array in back.series.channels.values())
    assert all(array.shape == series.channels[name].shape for name, array in back.series.channels.items())
    assert back.every == 3


@settings(max_examples=count(5, 15), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_any_float_comes_back_bit_for_bit(tmp_path, data):
    series = series_of(2)
    for name in ("attitude", "error", "surface", "tip"):
        array = getattr(series, name)
        array.flat[:] = data.draw(st.lists(st.floats(), min_size=array.size, max_size=array.size), label=name)
    write_recording(tmp_path / "run.rrd", series, WRIST, {})
    assert bits(read_recording(tmp_path / "run.rrd").series) == bits(series)


@pytest.mark.parametrize("names", HARDWARES, ids="+".join)
@pytest.mark.parametrize("rows", [1, 2, 345])
def test_what_hardware_does_comes_back_bit_for_bit(tmp_path, rows, names):
    series = with_extras(rows, names)
    write_recording(tmp_path / "run.rrd", series, WRIST, PROPERTIES)
    back = read_recording(tmp_path / "run.rrd").series
    assert bits(back) == bits(series)
    shapes = {name: array.shape for name, array in series.channels.items()}
    assert {name: array.shape for name, array in back.channels.items()} == shapes


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300, 5e-324])
def test_any_value_of_what_hardware_does_comes_back(tmp_path, value):
    """A map without rank has an infinite condition number, and the last rows of a divergence hold anything."""
    series = with_extras(20, OPTIONAL)
    for name in OPTIONAL:
        getattr(series, name)[7:] = value
    series.attitude[9:], series.torque[9:], series.rate[9:] = value, value, value
    write_recording(tmp_path / "run.rrd", series, WRIST, {})
    assert bits(read_recording(tmp_path / "run.rrd").series) == bits(series)
    for name in OPTIONAL:
        getattr(series, name)[:] = value
    write_recording(tmp_path / "run.rrd", series, WRIST, {})
    assert bits(read_recording(tmp_path / "run.rrd").series) == bits(series)


def test_times_that_are_no_whole_nanoseconds_come_back(tmp_path):
    series = series_of(100)
    series.time[:] = np.arange(100) / 3e9 + 1e5
    write_recording(tmp_path / "run.rrd", series, WRIST, {})
    assert bits(read_recording(tmp_path / "run.rrd").series) == bits(series)


def test_properties_come_back(recording):
    assert read_recording(recording).properties == PROPERTIES


JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**70), 2**70) | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


@settings(max_examples=count(8, 30), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.dictionaries(st.text(min_size=1), st.dictionaries(st.text(), JSON, max_size=3), max_size=3))
def test_any_properties_come_back(tmp_path, properties):
    properties = {f"group {name}": entries for name, entries in properties.items()}
    write_recording(tmp_path / "run.rrd", series_of(2), WRIST, properties)
    assert read_recording(tmp_path / "run.rrd").properties == properties


def test_types_of_a_property_may_change_between_recordings(tmp_path):
    for value in (1.0, "text", True, None, [1, 2]):
        write_recording(tmp_path / "run.rrd", series_of(2), WRIST, {"experiment": {"value": value}})
        assert read_recording(tmp_path / "run.rrd").properties == {"experiment": {"value": value}}


def test_an_array_that_is_partly_nan_is_stored_and_plotted(tmp_path):
    series = series_of(20)
    series.surface[3] = np.nan
    write_recording(tmp_path / "run.rrd", series, WRIST, {})
    assert bits(read_recording(tmp_path / "run.rrd").series) == bits(series)
    assert "surface" in {plot.name for plot in series.plots()}


def test_a_diverged_run_is_recorded(tmp_path):
    series = series_of(50)
    for name in ("attitude", "rate", "error", "tip", "torque"):
        getattr(series, name)[-3:] = [[np.nan], [np.inf], [1e300]]
    write_recording(tmp_path / "run.rrd", series, WRIST, {})
    assert bits(read_recording(tmp_path / "run.rrd").series) == bits(series)


def test_small_enough_and_without_threads_left(tmp_path):
    path = tmp_path / "run.rrd"
    write_recording(path, series_of(10_000), WRIST, PROPERTIES)  # noise: nothing for a compressor
    assert path.stat().st_size <= 5e6
    before = len(names_in(Path("/proc/self/task"))) if sys.platform == "linux" else 0
    for _ in range(10):
        write(path)
    assert sys.platform != "linux" or len(names_in(Path("/proc/self/task"))) <= before + 4


def test_two_threads_write_at_once(tmp_path):
    paths = [tmp_path / f"{k}.rrd" for k in range(8)]
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(write, paths))
    assert all(bits(read_recording(path).series) == bits(series_of(50)) for path in paths)


def test_strict_mode_is_left_as_it_was(tmp_path):
    before = rr.strict_mode()
    write(tmp_path / "run.rrd")
    assert rr.strict_mode() == before


# --- the scene -------------------------------------------------------------------------------------------------------


def test_geoms_are_where_mujoco_has_them():
    plant = perturbed(WRIST, Perturbation(payload=0.05))
    geoms = {geom.name: geom for geom in visible_geoms(plant)}
    assert geoms["payload"].moving
    np.testing.assert_allclose(geoms["payload"].position, plant.lever, atol=1e-12)
    turned = mujoco.MjData(plant.model)
    turned.qpos[:] = np.array([0.5, 0.5, -0.1, 0.7]) / np.linalg.norm([0.5, 0.5, -0.1, 0.7])
    mujoco.mj_forward(plant.model, turned)
    rotation = turned.xmat[plant.body].reshape(3, 3)
    for geom in geoms.values():
        place = plant.anchor + rotation @ geom.position if geom.moving else geom.position
        axes = rotation @ geom.rotation if geom.moving else geom.rotation
        np.testing.assert_allclose(place, turned.geom_xpos[geom.geom], atol=1e-12)
        np.testing.assert_allclose(axes.ravel(), turned.geom_xmat[geom.geom], atol=1e-12)


SHAPES = """
<mujoco>
  <asset><mesh name="m" vertex="0 0 0  .01 0 0  0 .01 0  0 0 .01"/></asset>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body pos="0 0 .5">
      <joint name="ball" type="ball"/>
      <geom type="sphere" size=".01"/> <geom name="a / b" type="mesh" mesh="m"/>
      <geom type="capsule" size=".01 .02"/> <geom type="box" size=".01 .01 .01"/>
      <geom type="sphere" size="1" group="3"/>
      <site name="tip" pos="0 0 -.1"/>
    </body>
  </worldbody>
  <actuator>
    <motor joint="ball" gear="1 0 0"/> <motor joint="ball" gear="0 1 0"/> <motor joint="ball" gear="0 0 1"/>
  </actuator>
</mujoco>
"""


def test_a_wrist_of_ones_own_is_drawn(tmp_path):
    wrist = Wrist.of(mujoco.MjSpec.from_string(SHAPES))
    write_recording(tmp_path / "run.rrd", series_of(20), wrist, {})
    entities = entities_of(tmp_path / "run.rrd")
    assert "/world/wrist/a\\ \\/\\ b" in entities
    assert {"/world/desired/sphere", "/world/desired/capsule", "/world/desired/box"} <= entities
    assert sum(entity.startswith("/world/wrist/") for entity in entities) == 4


# --- plots and text --------------------------------------------------------------------------------------------------


def test_limits_show_a_residue_after_a_transient():
    wave = 1e-3 * np.sin(np.linspace(0.0, 60.0, 10_000))
    low, high = limits(wave)
    assert low <= -1e-3
    assert 1e-3 <= high <= 3e-3
    wave[:100] = 0.3
    assert limits(wave)[1] <= 3e-3
    wave[:100] = 3e-3
    assert limits(wave)[1] >= 3e-3


@pytest.mark.parametrize("value", [0.0, 1e-320, -5.0, 1e300, 0.00433])
def test_limits_of_a_constant(value):
    low, high = limits(np.array([value, value, np.nan, np.inf]))
    assert np.isfinite([low, high]).all()
    assert low < high


def test_text_says_what_matters():
    text = experiment_text(PROPERTIES["experiment"]) + summary.metrics_text(PROPERTIES, 50, 4)
    for part in (
        "**pd**",
        "lissajous",
        "constant",
        "level 30 %",
        "seed | 7",
        "diverged",
        "rad",
        "every 4th",
        "50 rows",
    ):
        assert part in text
    assert "attitude error, RMS | **0.3333** rad" in text
    assert title(PROPERTIES["experiment"]) == "pd · lissajous"
    assert title({}) == "wrist"


@pytest.mark.parametrize(
    ("names", "plots"),
    [
        ((), set()),
        (SENSED, {"sensed_attitude", "sensed_rate"}),
        (DRIVEN, {"made_torque"}),
        (DRIVEN + COILS, {"made_torque", "current", "condition"}),
        (OPTIONAL, HARDWARE | {"law_state"}),
    ],
    ids=["ideal", "sensors", "motors", "coils", "all"],
)
@pytest.mark.parametrize("surface", [True, False])
def test_hardware_has_plots_where_it_is_not_ideal_and_only_there(tmp_path, names, plots, surface):
    series = with_extras(30, names, surface=surface)
    write_recording(tmp_path / "run.rrd", series, WRIST, PROPERTIES)
    found = {entity.removeprefix("/plots/") for entity in entities_of(tmp_path / "run.rrd") if "/plots/" in entity}
    assert found - {plot.name for plot in series_of(1).plots()} == plots
    assert ("surface" in found) == surface


def test_curves_of_hardware():
    """log(q⁻¹ q_m) by SciPy, whatever the signs of the quaternions; what is made less what is asked."""
    series = with_extras(500, OPTIONAL)
    curves = curves_of(series)
    true, seen = (Rotation.from_quat(q, scalar_first=True) for q in (series.attitude, series.measured_attitude))
    np.testing.assert_allclose(curves["sensed_attitude"], (true.inv() * seen).as_rotvec(), atol=1e-12)
    series.measured_attitude[::3] *= -1.0
    np.testing.assert_allclose(curves_of(series)["sensed_attitude"], curves["sensed_attitude"], atol=1e-12)
    series.measured_attitude[:] = series.attitude
    np.testing.assert_allclose(curves_of(series)["sensed_attitude"], 0.0, atol=1e-15)
    np.testing.assert_array_equal(curves["sensed_rate"], series.measured_rate - series.rate)
    np.testing.assert_array_equal(curves["made_torque"], series.torque - series.commanded_torque)
    np.testing.assert_array_equal(curves["current"], series.current)
    assert not HARDWARE & curves_of(series_of(5)).keys()


def test_plots_of_hardware_cost_ideal_runs_nothing(tmp_path):
    """A row of an ideal run takes 500 bytes, and one with all of it 1,000; noise, nothing for a compressor.

    The size differs by up to 0.05 % from file to file, with how the writer cuts it into chunks; hence 1 % of room.
    """
    rows = 10_000
    sizes = {}
    for names in ((), OPTIONAL):
        write_recording(tmp_path / "run.rrd", with_extras(rows, names), WRIST, PROPERTIES)
        sizes[names] = (tmp_path / "run.rrd").stat().st_size
    assert sizes[()] < 1.01 * 500 * rows
    assert sizes[OPTIONAL] < 1.01 * 1000 * rows


def test_text_says_what_faults_the_hardware_has():
    """With units; what is zero, or says nothing without another fault, is left out, as are ideal sensors and motors."""
    ideal = {"sensing": Ideal().model_dump(mode="json"), "actuation": IdealActuation().model_dump(mode="json")}
    text = experiment_text(ideal | {"friction": 1e-3})
    assert "friction | 0.001 N·m" in text
    assert "sensing" not in text
    assert "actuation" not in text
    late = {"sensing": Ideal(delay=0.002, rate_bias=0.1).model_dump(mode="json")}
    text = experiment_text(ideal | late)
    assert "| sensing | **ideal** but for rate bias 0.1 rad/s |\n|  | delay 0.002 s |\n|  | timestamped yes |" in text
    assert "noise" not in text
    motor = {"actuation": SphericalMotor(failed=[3, 5], cogging=1e-3).model_dump(mode="json")}
    text = experiment_text(ideal | motor)
    faults = ("failed | 3, 5", "failure known | no", "detents | 8", "resistance | 2.5 Ω", "cogging | 0.001 N·m")
    for line in ("actuation | **spherical_motor**", *(f"actuation: {fault}" for fault in faults)):
        assert f"| {line} |" in text
    assert "lag" not in text
    plain = {"actuation": SphericalMotor().model_dump(mode="json")}
    text = experiment_text(ideal | plain)
    assert "failure known" not in text
    assert "detents" not in text
    strange = {"sensing": {"name": "from a later version", "delay": 1.0, "glare": 3.0}}
    assert "sensing: glare | 3" in experiment_text(strange)


def test_text_has_figures_of_coils_where_there_are_coils():
    figures = {"rms_error_rad": 1e-3}
    assert "copper" not in summary.metrics_text({"metrics": figures}, 10, 1)
    figures |= {"copper_loss_W": 3.75, "peak_current_A": 1.25, "max_condition_number": None}
    text = summary.metrics_text({"metrics": figures}, 10, 1)
    for line in ("copper loss | **3.75** W", "coil current, peak | **1.25** A", "condition number, largest | –"):
        assert f"| {line} |" in text


# --- whole or not at all ---------------------------------------------------------------------------------------------


def assert_untouched(path: Path, content: bytes) -> None:
    assert path.read_bytes() == content
    assert names_in(path.parent) == [path.name]


def test_an_existing_file_is_replaced(recording):
    write(recording)
    assert len(read_recording(recording).series) == 50
    assert names_in(recording.parent) == [recording.name]


def fail_after(calls: int, error: BaseException, real):
    def replacement(*args):
        nonlocal calls
        calls -= 1
        if calls < 0:
            raise error
        return real(*args)

    return replacement


@pytest.mark.parametrize("function", ["write", "fsync", "replace"])
@pytest.mark.parametrize(
    ("error", "expected"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), RecordingError),
        (OSError(errno.EIO, "Input/output error"), RecordingError),
        (KeyboardInterrupt(), KeyboardInterrupt),
    ],
)
def test_a_failure_midway_leaves_the_old_file(recording, monkeypatch, function, error, expected):
    before = recording.read_bytes()
    monkeypatch.setattr(files.os, function, fail_after(0, error, getattr(os, function)))
    with pytest.raises(expected) as caught:
        write(recording)
    monkeypatch.undo()
    assert_untouched(recording, before)
    if expected is RecordingError:
        assert str(recording) in str(caught.value)
        assert error.strerror in str(caught.value)
        assert "\n" not in str(caught.value)


def test_a_disk_that_takes_little_at_a_time(tmp_path, monkeypatch):
    real = os.write
    monkeypatch.setattr(files.os, "write", lambda descriptor, content: real(descriptor, content[:10_000]))
    write(tmp_path / "run.rrd")
    assert len(read_recording(tmp_path / "run.rrd").series) == 50


@pytest.mark.skipif(sys.platform == "win32", reason="no limits there")
def test_a_limit_on_file_sizes(recording):
    resource = pytest.importorskip("resource")
    before, limits = recording.read_bytes(), resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limits[1]))
    try:
        with pytest.raises(RecordingError, match="File too large"):
            write(recording, 5000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert_untouched(recording, before)


@pytest.mark.parametrize(
    ("place", "reason"),
    [
        ("missing/run.rrd", "No such file or directory"),
        ("file/run.rrd", "Not a directory"),
        ("folder", "it is a directory"),
        ("x" * 300 + ".rrd", "File name too long"),
    ],
)
def test_places_that_cannot_be_written(tmp_path, place, reason):
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    with pytest.raises(RecordingError, match=reason) as caught:
        write(tmp_path / place)
    assert "\n" not in str(caught.value)
    assert names_in(tmp_path) == ["file", "folder"]


@pytest.mark.skipif(sys.platform != "linux", reason="Linux's own file systems")
@pytest.mark.parametrize("path", ["/proc/run.rrd", "/dev/full", "/dev/null"])
def test_places_that_even_root_cannot_write(path):
    with pytest.raises(RecordingError, match="cannot be written"):
        write(Path(path))


def test_a_link_is_written_through(recording, tmp_path):
    link = tmp_path / "latest.rrd"
    link.symlink_to(recording)
    write(link)
    assert link.is_symlink()
    assert len(read_recording(recording).series) == 50


def test_series_that_cannot_be_recorded(tmp_path):
    with pytest.raises(RecordingError, match="without rows"):
        write_recording(tmp_path / "run.rrd", Series.empty(), WRIST, {})
    with pytest.raises(RecordingError, match="'tip' of the series has shape"):
        write_recording(tmp_path / "run.rrd", series_of(5).replaced(tip=np.zeros((4, 3))), WRIST, {})
    with pytest.raises(RecordingError, match="not finite"):
        write_recording(tmp_path / "run.rrd", series_of(5).replaced(time=np.full(5, np.nan)), WRIST, {})
    with pytest.raises(ValueError, match="seal"):
        write_recording(tmp_path / "run.rrd", series_of(5), WRIST, {"seal": {}})
    assert names_in(tmp_path) == []


def test_rerun_switched_off_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setenv("RERUN", "off")
    with pytest.raises(RecordingError, match="unset the variable RERUN"):
        write(tmp_path / "run.rrd")


# --- files that are no recordings ------------------------------------------------------------------------------------


def refused(path: Path, capfd) -> str:
    with pytest.raises(RecordingError) as caught:
        read_recording(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")
    return str(caught.value)


def test_missing_directory_empty_garbage(tmp_path, capfd):
    (tmp_path / "empty").touch()
    (tmp_path / "garbage").write_bytes(np.random.default_rng(0).bytes(10_000))
    (tmp_path / "header").write_bytes(b"RRF2" + bytes(10_000))
    assert "no such file" in refused(tmp_path / "missing", capfd)
    assert "not a file" in refused(tmp_path, capfd)
    assert "empty" in refused(tmp_path / "empty", capfd)
    assert "not a Rerun file" in refused(tmp_path / "garbage", capfd)
    assert "truncated" in refused(tmp_path / "header", capfd)


def test_truncated_anywhere(recording, tmp_path, capfd):
    content = recording.read_bytes()
    cut = tmp_path / "cut.rrd"
    ends = {*range(1, 40), *(len(content) - k for k in range(1, 60)), *range(40, len(content), 5003)}
    for end in ends:
        cut.write_bytes(content[:end])
        refused(cut, capfd)


def test_any_flipped_bit_is_noticed(recording, tmp_path, capfd):
    content = recording.read_bytes()
    generator = np.random.default_rng(0)
    seal = content.index(b"<SHA-256 ")
    places = [0, 3, 4, 11, seal, seal + 9, seal + 73, len(content) - 1, *generator.integers(len(content), size=200)]
    for place in places:
        damaged = bytearray(content)
        damaged[place] ^= 1 << int(generator.integers(8))
        (tmp_path / "damaged.rrd").write_bytes(damaged)
        refused(tmp_path / "damaged.rrd", capfd)


def test_foreign_recordings(recording, tmp_path, capfd):
    stream = rr.RecordingStream("someone_else")
    stream.save(tmp_path / "foreign.rrd")
    stream.log("text", rr.TextLog("hello"))
    stream.disconnect()
    assert "not made by spherical-wrist" in refused(tmp_path / "foreign.rrd", capfd)
    # two recordings one after the other are a Rerun file, but no recording of one run
    (tmp_path / "two.rrd").write_bytes(2 * recording.read_bytes())
    refused(tmp_path / "two.rrd", capfd)


def test_reading_is_silent(recording, capfd):
    read_recording(recording)
    assert capfd.readouterr() == ("", "")
