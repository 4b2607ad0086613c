"""Recordings of other people that would fill the memory or never end, and what a recording tells of its sender."""

import io
import json
import struct

import numpy as np
import pyarrow as pa
import pytest
import rerun as rr

from forge import archive_of, claiming
from rigs import mjcf, one_line
from spherical_wrist import Experiment, load_recording, record, simulate
from spherical_wrist.compat.rrd import unpacked_size
from spherical_wrist.errors import RecordingError
from spherical_wrist.experiment import packed_files
from spherical_wrist.experiment.embedded_files import EmbeddedFiles, text_without_folders
from spherical_wrist.experiment.packed_files import PackedFiles
from spherical_wrist.prepare.plant import plant_of
from spherical_wrist.recording import seal
from spherical_wrist.recording.runs import properties_of
from spherical_wrist.recording.writer import write_recording


@pytest.fixture(scope="module")
def honest():
    return simulate(Experiment(duration=0.05, law="pd"))


@pytest.fixture(scope="module")
def plant():
    return plant_of(Experiment())


def test_a_file_twice_and_a_file_in_another_archive():
    with pytest.warns(UserWarning, match="Duplicate"):
        twice = archive_of([("a", b"1"), ("a", b"2")])
    with pytest.raises(ValueError, match="two files of one path"):
        PackedFiles(twice)
    nested = PackedFiles(archive_of([("a.zip", archive_of([("b", b"0" * 1000)]))]))
    assert list(nested) == ["a.zip"]
    with pytest.raises(RecordingError, match="damaged"):
        PackedFiles(claiming(50))["model/a.xml"]


def test_looking_at_a_recording_unpacks_nothing(wrist, honest, tmp_path, monkeypatch):
    record(honest, tmp_path / "a.rrd")

    def refuse(*_):
        raise AssertionError("a file was unpacked")

    with monkeypatch.context() as patched:
        patched.setattr(packed_files.PackedFiles, "__getitem__", refuse)
        for command in (["inspect", "a.rrd"], ["inspect", "a.rrd", "--json"], ["diff", "a.rrd", "a.rrd"]):
            assert wrist(*command)[0] == 0
    assert load_recording(tmp_path / "a.rrd").embedded_files == honest.embedded_files


def test_files_that_are_too_large_are_told_before_the_run(tmp_path, monkeypatch):
    monkeypatch.setattr("spherical_wrist.experiment.embedded_files.LARGEST", 1000)
    with pytest.raises(RecordingError, match="--no-recording"):
        EmbeddedFiles.of(Experiment())


# --- sizes of what Rerun unpacks


def framed(**fields):
    """A file of one frame of data and the last one: fields are compression, size and content of the first."""

    def varint(value):
        out = b""
        while value > 127:
            out, value = out + bytes([value & 127 | 128]), value >> 7
        return out + bytes([value])

    content = fields["content"]
    message = b"\x10" + varint(fields.get("compression", 1)) + b"\x18" + varint(fields.get("size", len(content)))
    message += b"\x2a" + varint(len(content)) + content
    return b"RRF2" + bytes(8) + struct.pack("<QQ", 2, len(message)) + message + struct.pack("<QQ", 0, 0)


def stream_of(compression=None):
    sink, batch = io.BytesIO(), pa.record_batch({"a": np.zeros(10_000)})
    with pa.ipc.new_stream(sink, batch.schema, options=pa.ipc.IpcWriteOptions(compression=compression)) as writer:
        writer.write_batch(batch)
    return sink.getvalue()


def test_sizes_are_told_without_unpacking():
    plain = stream_of()
    assert unpacked_size(framed(content=plain), 1 << 30) == len(plain)
    packed = pa.Codec("lz4_raw").compress(plain, asbytes=True)
    assert unpacked_size(framed(content=packed, compression=2, size=len(plain)), 1 << 30) == len(plain)
    assert unpacked_size(framed(content=packed, compression=2, size=1 << 50), 1 << 30) == 1 << 50
    for compression in ("zstd", "lz4"):
        with pytest.raises(ValueError, match="packed as Rerun packs none"):
            unpacked_size(framed(content=stream_of(compression)), 1 << 30)
    for content in (plain[:100], b"\xff" * 50, packed):
        with pytest.raises(ValueError, match=r"."):
            unpacked_size(framed(content=content), 1 << 30)


def test_a_recording_that_is_too_large_for_this_machine(wrist, honest, tmp_path, monkeypatch):
    record(honest, tmp_path / "a.rrd")
    monkeypatch.setattr(seal, "memory", lambda: 4 * (tmp_path / "a.rrd").stat().st_size)
    for command in (
        ["inspect", "a.rrd"],
        ["view", "a.rrd", "--screenshot", "a.png"],
        ["render", "a.rrd", "--frame", "a.png"],
    ):
        code, _, err = wrist(*command)
        assert (code, err.count("\n")) == (2, 1), err
        assert "of memory are too little" in err


# --- the sender

LAW = """
from spherical_wrist.control import Law

class Spring(Law):
    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            command.torque[i] = 0.2 * signal.error[i] + 0.02 * signal.rate_error[i]
"""


def everything_in(path):
    """All text in a recording: of its bytes, and of the components of all entities."""
    yield path.read_bytes()
    for chunk in rr.chunk.RrdReader(path).stream():
        yield chunk.entity_path.encode()
        yield repr(chunk.to_record_batch().to_pydict()).encode()


def test_nothing_in_a_recording_tells_the_folders_of_its_sender(wrist, tmp_path):
    home = tmp_path / "nobodys home"
    home.mkdir()
    (home / "law.py").write_text(LAW)
    (home / "motion.csv").write_text("t,w,x,y,z\n" + "".join(f"{0.1 * k:g},1,0,0,0\n" for k in range(20)))
    shapes = tmp_path / "nobodys shapes"  # the only folder in common is that of both
    shapes.mkdir()
    (shapes / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    mesh = '<asset><mesh name="m" file="../nobodys shapes/a.obj"/></asset>'
    (home / "mine.xml").write_text(mjcf(more=mesh))
    experiment = Experiment(
        law=f"{home / 'law.py'}:Spring", model=home / "mine.xml", duration=0.05, disturbance={"amplitude": 0.001},
        reference={"name": "recorded", "file": home / "motion.csv"},
    )  # fmt: skip
    run = simulate(experiment)
    assert run.experiment.model == home / "mine.xml"
    record(run, tmp_path / "a.rrd")
    for command in (["inspect", "a.rrd"], ["inspect", "a.rrd", "--json"], ["diff", "a.rrd", "a.rrd", "--json"]):
        code, out, _ = wrist(*command)
        assert code == 0
        assert "nobodys" not in out
        assert str(tmp_path) not in out
    assert not [text for text in everything_in(tmp_path / "a.rrd") if b"nobodys" in text]
    described = load_recording(tmp_path / "a.rrd").description
    assert described["law"]["name"] == "law.py:Spring"
    assert (described["model"], described["reference"]["file"]) == ("mine.xml", "motion.csv")
    assert json.dumps(described).count("/") == 0


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("law '/home/me/my laws/a.py:B' raised", "law 'a.py:B' raised"),
        ("OSError: /home/me/x.csv", "OSError: x.csv"),
        ("C:\\Users\\me\\law.py", "law.py"),
        ("~/laws/a.py and (/tmp/b/c.py)", "a.py and (c.py)"),
        ("3 rad/s, N·m/s and 1 / 2", "3 rad/s, N·m/s and 1 / 2"),
    ],
)
def test_folders_in_a_reason(text, shown):
    assert text_without_folders(text) == shown


def test_a_recording_of_an_older_version_shows_no_folders(pytestconfig):
    run = load_recording(pytestconfig.rootpath / "tests" / "recordings" / "format1" / "user_law.rrd")
    assert run.description["law"]["name"] == "my_law.py:Spring"
    with pytest.raises(RecordingError) as error:
        assert run.experiment
    assert "--trust" in one_line(error.value)


@pytest.mark.parametrize(
    "plugin",
    [
        '<plugin plugin="/tmp/evil.so"/>',
        '<plugin plugin="evil"><instance name="t"><config key="file" value="/etc/a"/></instance></plugin>',
        '<plugin plugin="mujoco.sdf.nut"><instance name="t"><config key="radius" value="/etc/a"/></instance></plugin>',
    ],
)
def test_a_model_loads_no_plugin_that_mujoco_does_not_have(wrist, honest, plant, tmp_path, plugin):
    """MuJoCo knows its own plugins only, none of which opens a file; a model cannot name a library."""
    text = mjcf(more=f"<extension>{plugin}</extension>").encode()
    properties = properties_of(honest) | {"files": {"model": {"path": "model/a.xml", "sha256": ""}}}
    write_recording(tmp_path / "a.rrd", honest, plant, properties, 1, archive_of([("model/a.xml", text)]))
    code, _, err = wrist("replay", "a.rrd")
    assert (code, err.count("\n")) == (2, 1), err
    assert "plugin" in err
