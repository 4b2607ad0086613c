"""Properties of recordings: whatever they say, every command ends with a result or one line."""

import copy
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fuzzing import examples
from spherical_wrist import Experiment, load_recording, simulate
from spherical_wrist.errors import RecordingError
from spherical_wrist.prepare.plant import plant_of
from spherical_wrist.recording.properties import check_properties
from spherical_wrist.recording.runs import properties_of
from spherical_wrist.recording.writer import write_recording

MISSING = object()
VALUES = [
    MISSING, None, True, -1, 0, 2, 10**40, float("nan"), float("inf"), 1e308, -1e-320, 1e12, 1e-12, "", "word",
    "\x1b[31m", "a.py:B", "/etc/hosts", [], [1, 2], [[]], [[[[[[[[[[]]]]]]]]]], {}, {"name": "pd"}, {"name": 3},
    {"self": 1},
]  # fmt: skip
COMMANDS = ("inspect", "inspect --json", "diff", "replay", "inspect --export a.npz")


@pytest.fixture(scope="module")
def honest():
    """A run that has every kind of property."""
    return simulate(Experiment(duration=0.02, sensing="realistic", actuation="spherical_motor"))


@pytest.fixture(scope="module")
def properties(honest):
    return json.loads(json.dumps(properties_of(honest)))


@pytest.fixture(scope="module")
def plant():
    return plant_of(Experiment())


def places(value, place=()):
    """Every place in nested tables and lists, of which only the first entry counts."""
    yield place
    inner = value.items() if isinstance(value, dict) else enumerate(value[:1]) if isinstance(value, list) else ()
    for key, entry in inner:
        yield from places(entry, (*place, key))


def changed(properties, place, value):
    """A copy with another value at a place, or without it."""
    result = copy.deepcopy(properties)
    *way, last = place
    table = result
    for key in way:
        table = table[key]
    if value is MISSING:
        del table[last]
    else:
        table[last] = value
    return result


@examples(32)
@given(data=st.data(), value=st.sampled_from(VALUES))
def test_any_property(wrist, honest, properties, plant, tmp_path, data, value):
    inner = [place for place in places(properties) if len(place) > 1]
    place = data.draw(st.sampled_from(inner), label="place")
    for name, said in (("a.rrd", properties), ("b.rrd", changed(properties, place, value))):
        if name == "b.rrd" or not (tmp_path / name).exists():
            write_recording(tmp_path / name, honest, plant, said, 1, honest.embedded_files.archive())
    for command in data.draw(st.permutations(COMMANDS), label="commands")[:2]:
        name, *options = command.split()
        code, _, err = wrist(name, "b.rrd", *(["a.rrd"] if name == "diff" else []), *options)
        assert code in (0, 1, 2), err
        assert err.count("\n") == (code == 2), err
        assert len(err) < 1000


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        ("outcome.status", "fine", "outcome.status = 'fine': must be 'completed'"),
        ("outcome.time_s", -1.0, "outcome.time_s = -1.0: must be greater"),
        ("outcome", MISSING, "it lacks outcome"),
        ("experiment.duration", "10", "experiment.duration = '10': must be a valid number"),
        ("experiment.duration", 1e-3, "it has 20 rows, every 0.001 s, of a run that ended at 0.02 s"),
        ("experiment.duration", MISSING, "it lacks experiment.duration"),
        ("experiment.seed", 2**200, "experiment.seed is a number of 201 bits"),
        ("experiment.law.K", [float("inf")], "experiment.law.K is not a finite number"),
        ("experiment.law", "pd", "experiment.law = 'pd'"),
        ("experiment.disturbance.level", [1], "experiment.disturbance.level"),
        ("experiment.disturbance", {"name": "mine.py:Mine"}, "it lacks experiment.disturbance.level"),
        ("experiment.com_shift", [1, 2], "experiment.com_shift"),
        ("metrics.rms_error_rad", "0", "metrics.rms_error_rad = '0'"),
        ("metrics.rms_error_rad", MISSING, "metric 'rms_error_rad'"),
        ("metrics.nothing", 1.0, "metric 'nothing'"),
        ("measurement.lever", [0.0, 0.0], "measurement.lever"),
        ("versions.numpy", 2, "versions.numpy = 2"),
        ("files.model.path", "model/none.xml", "lacks 'model/none.xml'"),
        ("files.law", {"path": "model/wrist.xml"}, "as the Python file of its law"),
    ],
)
def test_what_is_wrong_is_named(honest, properties, plant, tmp_path, place, value, said):
    forged = changed(properties, place.split("."), value)
    write_recording(tmp_path / "a.rrd", honest, plant, forged, 1, honest.embedded_files.archive())
    with pytest.raises(RecordingError) as error:
        load_recording(tmp_path / "a.rrd")
    assert said in str(error.value)


def test_what_is_right_stays_as_it_was_written(properties):
    """Lists, whole numbers in the place of others, and parts of another version are fine."""
    before = copy.deepcopy(properties)
    for place, value in (
        ("experiment.motors", ["a", "b", "c"]),
        ("experiment.com_shift", 0),
        ("experiment.seed", 2**128 - 1),
        ("experiment.law", {"name": "newer", "gain": [[1, {"a": None}]]}),
        ("experiment.newer", 1),
    ):
        properties = changed(properties, place.split("."), value)
        check_properties(properties)
    check_properties(before)


def rows_changed(run, **changes):
    return run.replaced(**{name: change(run.channels[name]) for name, change in changes.items()})


@pytest.mark.parametrize(
    "change",
    [lambda time: time[::-1], lambda time: 0.0 * time, lambda time: 2.0 * time + 1.0, lambda time: time - 1e9],
    ids=["backwards", "still", "late", "early"],
)
def test_times_that_are_not_those_of_the_run(honest, properties, plant, tmp_path, change):
    run = rows_changed(honest, time=change)
    write_recording(tmp_path / "a.rrd", run, plant, properties, 1)
    with pytest.raises(RecordingError, match=r"times do not increase|rows, every|archive"):
        load_recording(tmp_path / "a.rrd")


def test_a_channel_that_is_not_there_or_has_another_shape(honest, properties, plant, tmp_path, monkeypatch):
    from spherical_wrist.recording import writer

    described = writer.description_of

    def forged(channel):
        entry = described(channel)
        return {**entry, "axes": [], **({"axes": ["a"] * 20} if channel.name == "rate" else {})}

    monkeypatch.setattr(writer, "description_of", forged)
    write_recording(tmp_path / "a.rrd", honest, plant, properties, 1)
    with pytest.raises(RecordingError, match="cannot be read"):
        load_recording(tmp_path / "a.rrd")
    monkeypatch.setattr(writer, "description_of", described)
    less = honest.replaced()
    del less.channels["saturated"]
    write_recording(tmp_path / "a.rrd", less, plant, properties, 1)
    with pytest.raises(RecordingError, match="lacks 'saturated'"):
        load_recording(tmp_path / "a.rrd")
