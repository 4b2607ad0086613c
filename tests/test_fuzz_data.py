"""Recordings and recorded motions from anywhere make a result or one line, and never end the process."""

import numpy as np
import pyarrow as pa
import pytest
import rerun as rr
from hypothesis import example, given
from hypothesis import strategies as st
from pyarrow import parquet
from scipy.spatial.transform import Rotation

from fuzzing import Command, emptied, examples, outcome
from sampling import pairs
from spherical_wrist import Experiment, record, simulate

RUN = ("run", "--duration", "0.02", "--no-recording", "--reference")
NUMBERS = ["nan", "inf", "-1", "0", "1e308", "1e-320", "", "word", '"1"', "1,5", "1;2", "τ", "\0", "'", '"', "\n", "\t"]


@pytest.fixture(scope="module")
def command():
    made = Command()
    yield made
    made.close()


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A recording of this package, as bytes."""
    file = tmp_path_factory.mktemp("recording") / "a.rrd"
    record(simulate(Experiment(duration=0.02)), file)
    return file.read_bytes()


@st.composite
def damages(draw):
    """Draw a function that damages bytes."""
    places = draw(
        st.lists(st.tuples(st.floats(0.0, 1.0), st.binary(max_size=6), st.integers(0, 40)), min_size=1, max_size=3)
    )
    kind = draw(st.sampled_from(["cut", "flip", "splice", "double", "repeat"]))

    def damaged(data):
        for place, new, count in places:
            at = int(place * len(data))
            if kind == "cut":
                data = data[:at]
            elif kind == "flip" and at < len(data):
                data = data[:at] + bytes([data[at] ^ (1 << count % 8)]) + data[at + 1 :]
            elif kind == "splice":
                data = data[:at] + new + data[at + count :]
            elif kind == "double":
                data = data + data[:at]
            elif kind == "repeat":
                data = data[:at] + data[max(0, at - count) :]
        return data

    return damaged


@examples(120)
@given(damage=damages())
def test_any_damage_to_a_recording(command, recording, tmp_path, damage):
    folder, data = emptied(tmp_path / "f"), damage(recording)
    (folder / "a.rrd").write_bytes(data)
    answer = outcome(command, "inspect", "a.rrd", cwd=folder)
    assert (answer.code == 0) == (data == recording)


def test_recordings_of_others(command, recording, tmp_path):
    with rr.RecordingStream("another") as other:
        memory = other.memory_recording()
        other.log("a", rr.Scalars(1.0))
        foreign = memory.drain_as_bytes()
    for data in (foreign, recording + recording, recording + foreign, foreign + recording):
        folder = emptied(tmp_path / "f")
        (folder / "a.rrd").write_bytes(data)
        assert outcome(command, "inspect", "a.rrd", cwd=folder).code == 2


def rows(count=40):
    """A motion: times and quaternions."""
    time = 0.02 * np.arange(count)
    turns = Rotation.from_euler("xyz", 0.3 * np.sin(np.outer(time, [5.0, 7.0, 3.0])))
    return time, turns.as_quat(scalar_first=True)


TIME, QUATERNIONS = rows()
CSV = "t,w,x,y,z\n" + "\n".join(",".join(map(repr, map(float, row))) for row in np.column_stack([TIME, QUATERNIONS]))
MATRICES = Rotation.from_quat(QUATERNIONS, scalar_first=True).as_matrix().reshape(-1, 9)
JIGSAWS = "\n".join(
    " ".join(map(repr, map(float, np.concatenate([np.concatenate([np.zeros(3), row, np.zeros(7)])] * 4))))
    for row in MATRICES
)


@st.composite
def tables(draw, text, separator):
    """A table of text in which entries, rows and columns are changed, lost and repeated."""
    lines = [line.split(separator) for line in text.split("\n")]
    for _ in range(draw(st.integers(1, 3))):
        row = draw(st.integers(0, len(lines) - 1))
        column = draw(st.integers(0, max(0, len(lines[row]) - 1)))
        what = draw(st.sampled_from(["entry", "entry", "row", "again", "column", "lost", "sign", "short", "swap"]))
        if what == "entry" and lines[row]:
            lines[row][column] = draw(st.sampled_from(NUMBERS))
        elif what == "row" and len(lines) > 1:
            del lines[row]
        elif what == "again":
            lines.insert(row, list(lines[row]))
        elif what == "column":
            lines[row].append("1")
        elif what == "lost":
            lines = [line[:column] + line[column + 1 :] for line in lines]
        elif what == "sign":
            lines[row] = [f"-{entry}" for entry in lines[row]]
        elif what == "short":
            lines = lines[: draw(st.integers(1, 6))]
        else:
            lines[0], lines[row] = lines[row], lines[0]
    joined = draw(st.sampled_from([separator] * 8 + [";", "\t", " ", ", "]))
    data = "\n".join(joined.join(line) for line in lines).encode(draw(st.sampled_from(["utf-8"] * 9 + ["utf-16"])))
    return draw(damages())(data) if draw(st.integers(0, 5)) == 0 else data


def check_motion(command, tmp_path, data):
    folder = emptied(tmp_path / "f")
    (folder / "m").write_bytes(data)
    outcome(command, *RUN, "recorded:m", cwd=folder)


@examples(150)
@given(data=tables(CSV, ","))
@example(data=b"t,w,x,y,z" + b",a" * 1_000_000)
@example(data=("t,w,x,y,z" + ",a" * 20_000 + ("\n0,1,0,0,0" + ",1" * 20_000) * 5).encode())
@example(data=b"t,w,x,y,z\n" + b"0,1,0,0,0\n" * 10)
@example(data=b"t,w,x,y,z\n" + b"".join(b"%d,0,0,0,0\n" % row for row in range(5)))
@example(data=b"t,w,x,y,z\n0,1,0,0,0\n")
@example(data=b'"t","w","x","y","z"\n' + b"".join(b'"%g","1","0","0","0"\n' % (0.1 * row) for row in range(9)))
@example(data=b"\0" * 1000)
@example(data=b"\n" * 100_000)
def test_any_table(command, tmp_path, data):
    check_motion(command, tmp_path, data)


@examples(50)
@given(data=tables(JIGSAWS, " "))
def test_any_kinematics(command, tmp_path, data):
    check_motion(command, tmp_path, data)


def as_parquet(columns):
    sink = pa.BufferOutputStream()
    parquet.write_table(pa.table(columns), sink)
    return sink.getvalue().to_pybytes()


WHOLE = {"t": pa.array(TIME), **{name: pa.array(QUATERNIONS[:, i]) for i, name in enumerate("wxyz")}}
STRANGE = {
    "text": pa.array([str(value) for value in TIME]), "words": pa.array(["word"] * len(TIME)),
    "nulls": pa.nulls(len(TIME)), "lists": pa.array([[1.0]] * len(TIME)), "tables": pa.array([{"a": 1.0}] * len(TIME)),
    "bytes": pa.array([b"1"] * len(TIME)), "large": pa.array([2**62] * len(TIME)),
    "some nulls": pa.array([None, *TIME[1:]]), "dates": pa.array(np.arange(len(TIME)), pa.timestamp("us")),
    "days": pa.array(np.arange(len(TIME), dtype=np.int32), pa.date32()), "true": pa.array([True] * len(TIME)),
    "decimal": pa.array(np.arange(len(TIME))).cast(pa.decimal128(20)), "half": pa.array(TIME.astype(np.float16)),
    "dictionary": pa.array(TIME).dictionary_encode(), "nanoseconds": pa.array(np.arange(len(TIME)), pa.duration("ns")),
    "infinite": pa.array(np.full(len(TIME), np.inf)),
}  # fmt: skip


@pytest.mark.parametrize(("kind", "name"), pairs(STRANGE, ["t", "w", "x"]))
def test_any_type_of_column(command, tmp_path, kind, name):
    check_motion(command, tmp_path, as_parquet({**WHOLE, name: STRANGE[kind]}))


@examples(80)
@given(damage=damages())
@example(damage=lambda data: as_parquet({}))
@example(damage=lambda data: as_parquet({name: column[:0] for name, column in WHOLE.items()}))
@example(damage=lambda data: as_parquet({f"c{i}": [1.0] for i in range(5000)}))
def test_any_damage_to_a_parquet_file(command, tmp_path, damage):
    check_motion(command, tmp_path, damage(as_parquet(WHOLE)))
