"""The table of channels: every channel is everywhere where channels are, and an old recording is what it was."""

import csv
import io
import json
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rigs import bits, channel_names, one_line
from sampling import some
from spherical_wrist import Experiment, load_recording, record, simulate
from spherical_wrist.channels import CHANNELS, COMMAND, LOG, Condition, Source
from spherical_wrist.control import Law
from spherical_wrist.errors import RecordingError
from spherical_wrist.guides import read_guide
from spherical_wrist.inspection import difference, inspect
from spherical_wrist.inspection.columns import columns
from spherical_wrist.inspection.export import exported
from spherical_wrist.inspection.panels import _MOTIONS, PORTRAYED
from spherical_wrist.inspection.picture import run_picture
from spherical_wrist.inspection.replay import replay
from spherical_wrist.picture_file import picture_content
from spherical_wrist.recording.layout import FORMAT
from spherical_wrist.recording.reader import read_recording

OLD = sorted((Path(__file__).parent / "recordings").glob("format*/*.rrd"))
each_channel = pytest.mark.parametrize("channel", CHANNELS.values(), ids=CHANNELS)
each_old = pytest.mark.parametrize("path", OLD, ids=lambda path: path.stem)


@cache
def run_of(law):
    """A run with a law that has every channel but those that another law logs."""
    own = {"law": law, "sensing": "realistic", "actuation": "realistic"}
    return simulate(Experiment(duration=0.1, disturbance={"amplitude": 0.004}, **own))


def run_with(channel):
    """A run that has a channel: with the law that logs it, if it is such a channel."""
    laws = (name for name, law in Law.members.items() if channel.name in law.logs)
    return run_of(next(laws) if channel.when is Condition.LOGGED else "fuzzy_integral_sliding")


@pytest.fixture(scope="module")
def run():
    return run_of("fuzzy_integral_sliding")


@pytest.fixture(scope="module")
def recorded(run, tmp_path_factory):
    path = tmp_path_factory.mktemp("channels") / "run.rrd"
    record(run, path)
    return path


# --- every channel of the table --------------------------------------------------------------------------------------


def test_the_run_of_these_tests_has_every_channel_but_those_of_other_laws(run):
    logged = run.experiment.law.logs
    assert list(run.channels) == [
        name for name, each in CHANNELS.items() if each.when is not Condition.LOGGED or name in logged
    ]
    assert all(array.dtype == np.float64 and len(array) == len(run) for array in run.channels.values())


@each_channel
def test_a_channel_is_logged_or_has_another_source(channel):
    logged = channel.source in (Source.LOOP, Source.LAW)
    assert (channel.name in LOG.names) == logged
    assert (channel.name in COMMAND.names) == (channel.source is Source.LAW or channel.name == "torque")
    if logged:
        assert LOG[channel.name].shape == channel.shape


@each_channel
def test_a_channel_says_what_it_is(channel):
    assert channel.title
    assert channel.meaning
    assert channel.axes is None or len(set(channel.axes)) == len(channel.axes)
    if channel.fault is not None:
        assert channel.fault.other in CHANNELS


@each_channel
def test_a_channel_is_recorded_with_its_description(channel, recorded, tmp_path):
    run = run_with(channel)
    if channel.when is Condition.LOGGED:
        record(run, recorded := tmp_path / "run.rrd")
    back = read_recording(recorded).series
    assert back.channels[channel.name].tobytes() == run.channels[channel.name].tobytes()
    assert back.channels[channel.name].shape == run.channels[channel.name].shape
    assert back.channel(channel.name) == run.channel(channel.name)


@cache
def titles(law):
    """Return the titles of the panels of the sheet of the run with a law."""
    return {panel.get_title("left") for panel in run_picture(run_of(law), ["title"]).axes}


@each_channel
def test_a_channel_is_in_a_view_unless_the_table_says_that_it_is_only_stored(channel):
    run = run_with(channel)
    plots = {plot.channel.name for plot in run.plots()}
    assert (channel.name in plots) == channel.place.has_plot
    shown = PORTRAYED.union(*(motion.shows for motion in _MOTIONS))
    if channel.place.has_plot and channel.name not in shown:
        headings = {plot.heading for plot in run.plots() if plot.channel.name == channel.name}
        assert headings
        assert headings <= titles(run.experiment.law.name)


@each_channel
def test_a_channel_is_exported_with_its_unit(channel):
    run = run_with(channel)
    found = [column for column in columns(run) if column.name.startswith(channel.name)]
    rows = run.channels[channel.name].reshape(len(run), -1)
    mine = [column for column in found if any(column.values.tobytes() == values.tobytes() for values in rows.T)]
    assert len(mine) >= rows.shape[1]
    assert all(column.meaning.startswith(channel.meaning) for column in mine[:1])


@each_channel
def test_a_channel_is_compared(channel):
    run = run_with(channel)
    array = run.channels[channel.name].copy()
    array.flat[-1] += 1e-10  # of time: still the same instant
    (different,) = [each for each in difference(run, run.replaced(**{channel.name: array})).arrays if not each.same]
    assert (different.name, different.unit) == (channel.name, run.channel(channel.name).difference_unit)


@each_channel
def test_a_channel_is_in_the_guide(channel):
    """One row of a table: name, symbol, unit, meaning, and which runs have it."""
    (row,) = re.findall(rf"^\| `{channel.name}` \|(.*)\|$", read_guide("conventions").text, re.MULTILINE)
    cells = [cell.strip() for cell in row.split("|")]
    components = "m" if channel.axes is None else str(len(channel.axes) or 1)
    assert cells == [channel.symbol, components, channel.unit, channel.meaning, str(channel.when)]


@each_channel
def test_a_channel_that_a_run_does_not_have_is_absent(channel):
    ideal = simulate(Experiment(law="pd", duration=0.01, disturbance=0))
    logged = ideal.experiment.law.logs
    assert list(ideal.channels) == [name for name in CHANNELS if name in channel_names() or name in logged]
    if channel.name not in ideal.channels:
        with pytest.raises(AttributeError, match=f"no channel '{channel.name}', which exists for") as caught:
            getattr(ideal, channel.name)
        one_line(caught.value)
        assert channel.name not in dir(ideal)
        assert channel.name not in {each.name for each in difference(ideal, ideal).arrays}
        assert not [column for column in columns(ideal) if column.name.startswith(channel.name)]


def test_a_name_that_is_no_channel_is_no_attribute(run):
    with pytest.raises(AttributeError, match="has no attribute 'eror'"):
        run.eror  # noqa: B018
    assert {"error", "metrics", "channels"} <= set(dir(run))


def test_the_state_of_a_law_has_names_everywhere(run, recorded, tmp_path):
    names = run.experiment.law.state_names()
    assert "integral_x" in names
    back = load_recording(recorded)
    assert back.channel("law_state").axes == names
    assert back.channel("law_state").units == run.experiment.law.state_units()
    exported_names = {column.name: column.unit for column in columns(back)}
    assert exported_names["law_state_integral_x_rad_s"] == "rad·s"
    plots = {plot.name: plot for plot in back.plots()}
    assert plots["law_state/integral"].labels == ["integral x", "integral y", "integral z"]
    assert plots["law_state/integral"].unit == "rad·s"
    shown = [plot.curves for plot in plots.values() if plot.channel.name == "law_state"]
    np.testing.assert_array_equal(np.hstack(shown), run.law_state)


# --- a channel that is added: one entry, and the law that writes it --------------------------------------------------

ADDED = """
import spherical_wrist.channels as table
import sys

source = open(table.__file__).read()
place = source.index("    Channel(\\n        name=\\"torque\\"")
assert source.count("    Channel(\\n        name=\\"torque\\"") == 1
added = (
    "    Channel(name='observed_torque', unit='N·m', axes=XYZ, symbol='d̂', title='Observed torque', "
    "meaning='disturbance torque that the law believes in, body frame'),\\n"
)
exec(compile(source[:place] + added + source[place:], table.__file__, "exec"), table.__dict__)

from pathlib import Path
import numpy as np
from spherical_wrist import Experiment, load_recording, record, simulate
from spherical_wrist.inspection import difference, inspect
from spherical_wrist.inspection.columns import columns
from spherical_wrist.inspection.picture import run_picture

folder, old = Path(sys.argv[1]), Path(sys.argv[2])
law = folder / "law.py"
law.write_text(
    "from spherical_wrist.control import Law\\n"
    "class Watching(Law):\\n"
    "    logs = ('observed_torque',)\\n"
    "    @staticmethod\\n"
    "    def step(signal, parameters, state, command):\\n"
    "        for i in range(3):\\n"
    "            command.torque[i] = 0.16 * signal.error[i] + 0.016 * signal.rate_error[i] + signal.N[i]\\n"
    "            command.observed_torque[i] = 2.0 * signal.error[i]\\n"
)
for interpreted in (False, True):
    run = simulate(Experiment(law=f"{law}:Watching", duration=0.05), interpreted=interpreted)
    np.testing.assert_array_equal(run.observed_torque, 2.0 * run.error)
    other = simulate(Experiment(law="sliding_mode", duration=0.05), interpreted=interpreted)
    assert "observed_torque" not in other.channels and "surface" in other.channels
    assert np.isfinite(other.surface).all() and "surface" not in run.channels
record(run, folder / "run.rrd")
back = load_recording(folder / "run.rrd")
assert (back.observed_torque == run.observed_torque).all()
assert "Observed torque" in {plot.title for plot in back.plots()}
drawn = {panel.get_title("left"): panel.get_ylabel() for panel in run_picture(back, ["t"]).axes}
assert drawn["Observed torque"] == "d̂ [N·m]"
assert "observed_torque_x_Nm" in {column.name for column in columns(back)}
assert [each.name for each in difference(back, back.replaced(observed_torque=run.error)).arrays if not each.same] == [
    "observed_torque"
]
inspect(old).check()
assert "observed_torque" not in load_recording(old).channels
"""


def test_a_channel_is_added_by_one_entry_and_the_law_that_writes_it(tmp_path):
    """In a process of its own; a recording made with it is read by this one, which knows nothing of the channel."""
    old = next(path for path in OLD if path.stem == "pd_ideal")
    done = subprocess.run(
        [sys.executable, "-c", ADDED, tmp_path, old], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "observed_torque" not in CHANNELS
    back = load_recording(tmp_path / "run.rrd")
    assert back.channel("observed_torque").unit == "N·m"
    np.testing.assert_array_equal(back.observed_torque, 2.0 * back.error)
    assert "Observed torque" in {plot.title for plot in back.plots()}
    assert "observed_torque_x_Nm" in {column.name for column in columns(back)}
    assert difference(back, back).same


# --- formats ---------------------------------------------------------------------------------------------------------


@each_old
def test_recordings_of_older_formats_are_read_inspected_exported_and_drawn(path, tmp_path):
    number = read_recording(path).format
    assert number == int(path.parent.name.removeprefix("format")) <= FORMAT
    found = inspect(path)
    found.check()
    run = found.run
    assert {name for name in channel_names() if CHANNELS[name].since <= number} <= set(run.channels) <= set(CHANNELS)
    assert all(np.isfinite(array).any() and array.size for array in run.channels.values())
    assert ("surface" in run.channels) == ("slope" in run.channels) == ("sliding" in run.description["law"]["name"])
    assert ("current" in run.channels) == (run.description["actuation"]["name"] != "ideal")
    files = {kind: b"".join(exported(run, Path(f"run.{kind}"))) for kind in ("csv", "parquet", "npz")}
    assert all(files.values())
    (header, *rows) = csv.reader(io.StringIO(files["csv"].decode()))
    assert (header[0], len(rows)) == ("time_s", len(run))
    assert difference(run, run).same
    if path in some(OLD, 3):
        assert picture_content(run_picture(run, ["title"]), Path("run.png"))
    record(run, tmp_path / "again.rrd")
    again = read_recording(tmp_path / "again.rrd")
    assert (again.format, bits(again.series)) == (FORMAT, bits(run))


@each_old
def test_recordings_of_older_formats_are_simulated_again_from_themselves(path):
    """Bit for bit with the versions and on the processor that they were made with, else to rounding."""
    found = replay(path, trust=True)
    assert found.same_outcome or found.circumstances
    if not {name for name in found.circumstances if name != "spherical-wrist"}:
        assert not found.metrics
        assert {each.name for each in found.series.arrays if not each.same} <= {"law_state"}
        if "law_state" in found.again.channels:  # in which the arithmetic of a law has been put in another order
            states = (run.channels["law_state"] for run in (found.again, found.recorded))
            np.testing.assert_allclose(*states, rtol=1e-12, atol=1e-12)
    elif found.recorded.outcome.status == "completed":
        assert set(found.again.channels) >= set(found.recorded.channels)
        for name in channel_names():
            np.testing.assert_allclose(
                found.again.channels[name], found.recorded.channels[name], rtol=0.0, atol=1e-9, err_msg=name
            )


def test_a_recording_describes_its_channels_to_readers_without_a_table(recorded, run):
    import rerun as rr

    chunks = rr.chunk.RrdReader(recorded).stream().filter(content=["/__properties/recording"])
    batch = next(iter(chunks)).to_record_batch()
    column = next(name for name in batch.schema.names if name.endswith("channels"))
    told = json.loads(batch.column(column)[0].as_py()[0])
    assert list(told) == list(run.channels)
    assert (told["error"]["unit"], told["error"]["axes"]) == ("rad", ["x", "y", "z"])
    assert told["error"]["entities"] == ["plots/error"]


def test_a_newer_format_is_refused_in_one_line(tmp_path, monkeypatch, run):
    with monkeypatch.context() as patch:
        patch.setattr("spherical_wrist.recording.writer.FORMAT", FORMAT + 1)
        record(run, tmp_path / "run.rrd")
    with pytest.raises(RecordingError, match=rf"has format {FORMAT + 1}; this version reads formats 1 to {FORMAT}: "):
        load_recording(tmp_path / "run.rrd")
