"""Recorded motions: files of known motions come back; what is no motion is refused in one line."""

import json
import os

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rigs import one_line
from spherical_wrist import Experiment, WristError
from spherical_wrist.errors import ParameterError, UnknownNameError
from spherical_wrist.experiment.description import with_changes
from spherical_wrist.reference import Lissajous, Recorded, Reference, jigsaws
from spherical_wrist.reference.recorded_rows import LAST_ROW

TRUTH = Lissajous(amplitude=(0.4, 0.5, 0.6))
QUATERNION = ["time", "qw", "qx", "qy", "qz"]
MATRIX = ["time", *(f"r{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3))]
ARMS = ("master_left", "master_right", "slave_left", "slave_right")


def rotations(motion):
    return Rotation.from_quat(motion["attitude"], scalar_first=True)


def rows_of(time, turned):
    return np.column_stack([time, turned.as_quat(scalar_first=True)])


def write_csv(path, names, rows, delimiter=",", comments=""):
    np.savetxt(path, rows, delimiter=delimiter, header=delimiter.join(names), comments=comments, fmt="%.17g")
    return path


def write_parquet(path, names, rows):
    pq.write_table(pa.table(dict(zip(names, rows.T, strict=True))), path)
    return path


def jigsaws_rows(arms):
    """Rows of 76 numbers, 19 an arm: position, rotation matrix, two velocities, gripper; from the published layout."""
    random = np.random.default_rng(0)
    blocks = []
    for arm in ARMS:
        matrices = arms[arm].as_matrix().reshape(-1, 9)
        n = len(matrices)
        blocks += [random.normal(size=(n, 3)), matrices, random.normal(size=(n, 6)), random.normal(size=(n, 1))]
    return np.hstack(blocks)


def write_jigsaws(path, arms):
    np.savetxt(path, jigsaws_rows(arms), fmt="%14.6f")
    return path


@pytest.fixture
def truth_file(tmp_path):
    """Four seconds of the known motion at 100 Hz."""
    time = np.arange(401) * 0.01
    return write_csv(tmp_path / "truth.csv", QUATERNION, rows_of(time, rotations(TRUTH.motion(time))))


def wiggle(time, axis, size=0.3, frequency=0.5):
    return Rotation.from_rotvec(np.outer(size * np.sin(2 * np.pi * frequency * time), axis))


# --- the motion comes back


@pytest.mark.parametrize(("rate", "largest"), [(30, 2e-4), (100, 2e-6), (1000, 2e-10)])
@pytest.mark.parametrize("even", [True, False])
def test_a_known_motion_comes_back_at_any_rate(tmp_path, rate, largest, even):
    """Attitudes up to where the world frame is; the error falls with the fourth power of the step."""
    time = np.arange(4 * rate + 1) / rate
    if not even:
        time[1:-1] += np.random.default_rng(1).uniform(-0.2, 0.2, len(time) - 2) / rate
    file = write_csv(tmp_path / "a.csv", QUATERNION, rows_of(time + 17.25, rotations(TRUTH.motion(time))))
    asked = np.linspace(0.0, 4.0, 3001)
    got, true = Recorded(file=file, largest_gap=1.0).motion(asked), TRUTH.motion(asked)
    moved = (rotations(got)[:1].inv() * rotations(got)).inv() * (rotations(true)[:1].inv() * rotations(true))
    assert moved.magnitude().max() < largest * (1 if even else 5)
    assert np.abs(got["rate"] - true["rate"]).max() < 20 * rate * largest
    assert np.abs(got["acceleration"] - true["acceleration"]).max() < 200 * rate**2 * largest


def test_the_motion_is_relative_to_its_mean(truth_file):
    """For even steps, the mean over all rows with the outer two counted half, as SciPy finds it."""
    motion = Recorded(file=truth_file).motion(np.arange(401) * 0.01)
    weights = np.r_[0.5, np.ones(399), 0.5]
    assert rotations(motion).mean(weights=weights).magnitude() < 1e-12
    source = rotations(TRUTH.motion(np.arange(401) * 0.01))
    expected = source.mean(weights=weights).inv() * source
    np.testing.assert_allclose((rotations(motion).inv() * expected).magnitude(), 0.0, atol=1e-12)


def test_rows_that_are_dense_somewhere_do_not_pull_the_mean(tmp_path):
    time = np.r_[np.linspace(0.0, 1.0, 1001), np.linspace(1.1, 4.0, 30)]
    motion = Recorded(
        file=write_csv(tmp_path / "a.csv", QUATERNION, rows_of(time, wiggle(time, (1, 0, 0), 0.5, 0.25)))
    ).motion(np.linspace(0.0, 4.0, 2001))
    assert rotations(motion).mean().magnitude() < 2e-3


def test_world_and_body_frames_do_not_matter(tmp_path):
    """Another world gives the same motion; another body the same one seen from there."""
    time = np.arange(200) / 50
    source = rotations(TRUTH.motion(time))
    world, body = Rotation.from_rotvec([1.0, -2.0, 0.5]), Rotation.from_rotvec([0.3, 0.7, -1.1])
    asked = np.linspace(-1.0, 5.0, 500)
    plain, moved, other = (
        Recorded(file=write_csv(tmp_path / f"{k}.csv", QUATERNION, rows_of(time, turned))).motion(asked)
        for k, turned in enumerate((source, world * source, source * body))
    )
    np.testing.assert_allclose(moved["attitude"], plain["attitude"], atol=1e-12)
    np.testing.assert_allclose(moved["acceleration"], plain["acceleration"], atol=1e-9)
    np.testing.assert_allclose(body.apply(other["rate"]), plain["rate"], atol=1e-11)
    np.testing.assert_allclose(
        (body * rotations(other) * body.inv() * rotations(plain).inv()).magnitude(), 0, atol=1e-12
    )


def test_all_formats_hold_the_same_motion(tmp_path):
    time = np.arange(150) / 40 + 1e3
    turned = rotations(TRUTH.motion(time))
    quaternions, matrices = rows_of(time, turned), np.column_stack([time, turned.as_matrix().reshape(-1, 9)])
    short = ["T", "W", "X", "Y", "Z"]
    extra = ["note", *QUATERNION[::-1]]
    files = [
        write_csv(tmp_path / "a.csv", QUATERNION, quaternions),
        write_parquet(tmp_path / "a.parquet", QUATERNION, quaternions),
        write_csv(tmp_path / "b.txt", QUATERNION, quaternions, comments="# "),
        write_csv(tmp_path / "c.csv", short, quaternions, delimiter=";"),
        write_csv(tmp_path / "d.csv", ["timestamp", *short[1:]], quaternions, delimiter="\t"),
        write_csv(tmp_path / "e.csv", extra, np.column_stack([np.arange(150), quaternions[:, ::-1]])),
        write_csv(tmp_path / "f.csv", MATRIX, matrices),
        write_parquet(tmp_path / "g.bin", MATRIX, matrices),
    ]
    asked = np.linspace(-1.0, 5.0, 500)
    first = Recorded(file=files[0]).motion(asked)
    for file in (*files[2:6],):
        assert np.array_equal(Recorded(file=file).motion(asked), first), file
    for file in (files[1], *files[6:]):  # numbers of Parquet have lost digits of large times
        np.testing.assert_allclose(Recorded(file=file).motion(asked)["attitude"], first["attitude"], atol=1e-12)
        np.testing.assert_allclose(Recorded(file=file).motion(asked)["rate"], first["rate"], atol=1e-10)


@pytest.mark.parametrize("kind", [pa.timestamp("us", tz="UTC"), pa.timestamp("ns"), pa.duration("ms")])
def test_parquet_times_may_be_dates(tmp_path, kind):
    time = np.arange(100) / 50
    rows = rows_of(time, rotations(TRUTH.motion(time)))
    unit = {"us": 1e6, "ns": 1e9, "ms": 1e3}[kind.unit]
    dates = pa.array(np.round((time + 1000.0) * unit).astype(np.int64)).cast(kind)
    columns = dict(zip(QUATERNION[1:], rows.T[1:], strict=True))
    pq.write_table(pa.table({"time": dates, **columns}), tmp_path / "dated.parquet")
    plain = write_parquet(tmp_path / "plain.parquet", QUATERNION, rows)
    asked = np.linspace(0.0, 2.0, 200)
    got, expected = (Recorded(file=file).motion(asked) for file in (tmp_path / "dated.parquet", plain))
    np.testing.assert_allclose(got["rate"], expected["rate"], atol=1e-11)


def test_the_sign_of_a_quaternion_does_not_matter(tmp_path, truth_file):
    rows = np.loadtxt(truth_file, delimiter=",", skiprows=1)
    rows[:, 1:] *= np.random.default_rng(3).choice([-1.0, 1.0], (len(rows), 1))
    flipped = write_csv(tmp_path / "b.csv", QUATERNION, rows)
    asked = np.linspace(-1.0, 6.0, 700)
    got, plain = Recorded(file=flipped).motion(asked), Recorded(file=truth_file).motion(asked)
    np.testing.assert_allclose(got["attitude"], plain["attitude"], atol=1e-13)
    np.testing.assert_allclose(got["acceleration"], plain["acceleration"], atol=1e-9)


def test_rounding_in_the_file_is_put_right(tmp_path):
    time = np.arange(60) / 30
    matrices = rotations(TRUTH.motion(time)).as_matrix().reshape(-1, 9)
    file = write_csv(tmp_path / "a.csv", MATRIX, np.column_stack([time, np.round(matrices, 3)]))
    motion = Recorded(file=file).motion(time)
    exact = write_csv(tmp_path / "b.csv", MATRIX, np.column_stack([time, matrices]))
    gap = rotations(motion).inv() * rotations(Recorded(file=exact).motion(time))
    assert 1e-6 < gap.magnitude().max() < 2e-3
    np.testing.assert_allclose(np.linalg.norm(motion["attitude"], axis=1), 1.0, atol=1e-15)


def test_a_spin_of_many_turns_goes_on(tmp_path):
    """Eight radians about the tool: farther than any rotation vector; its rate must stay."""
    time = np.arange(0.0, 2.0001, 0.02)
    turned = Rotation.from_rotvec(np.outer(4.0 * time, (0.0, 0.0, 1.0)))
    motion = Recorded(file=write_csv(tmp_path / "a.csv", QUATERNION, rows_of(time, turned))).motion(
        np.linspace(0.0, 2.0, 999)
    )
    np.testing.assert_allclose(motion["rate"], np.tile((0.0, 0.0, 4.0), (999, 1)), atol=2e-5)
    assert np.linalg.norm(np.diff(motion["attitude"], axis=0), axis=1).max() < 0.005


# --- what is done to it


@pytest.mark.parametrize("scale", [0.0, 0.5, 2.0])
def test_scale_multiplies_the_angles_from_the_mean(truth_file, scale):
    time = np.arange(401) * 0.01
    plain, scaled = (Recorded(file=truth_file, scale=factor).motion(time) for factor in (1.0, scale))
    np.testing.assert_allclose(rotations(scaled).as_rotvec(), scale * rotations(plain).as_rotvec(), atol=1e-12)


def test_scale_knows_angles_beyond_half_a_turn(tmp_path):
    time = np.arange(0.0, 6.0, 0.02)
    excursion = 4.5 * np.exp(-(((time - 3.0) / 0.5) ** 2))
    turned = Rotation.from_rotvec(np.outer(excursion, (0.0, 0.0, 1.0)))
    file = write_csv(tmp_path / "a.csv", QUATERNION, rows_of(time, turned))
    angle = rotations(Recorded(file=file, scale=0.5).motion(time)).as_rotvec()[:, 2]
    np.testing.assert_allclose(angle - angle[0], 0.5 * (excursion - excursion[0]), atol=1e-9)


def test_what_turns_fully_cannot_be_scaled(tmp_path):
    time = np.arange(0.0, 4.0, 0.02)
    turned = Rotation.from_rotvec(np.outer(4.0 * time, (0.0, 0.0, 1.0)))
    file = write_csv(tmp_path / "a.csv", QUATERNION, rows_of(time, turned))
    with pytest.raises(ParameterError, match="leave scale at 1") as caught:
        Recorded(file=file, scale=0.9).motion(time)
    one_line(caught.value)


def test_speed_is_a_scale_of_time(truth_file):
    time = np.linspace(-1.0, 6.0, 400)
    plain, fast = Recorded(file=truth_file).motion(2.5 * time), Recorded(file=truth_file, speed=2.5).motion(time)
    assert np.array_equal(fast["attitude"], plain["attitude"])
    np.testing.assert_allclose(fast["rate"], 2.5 * plain["rate"], rtol=1e-15)
    np.testing.assert_allclose(fast["acceleration"], 6.25 * plain["acceleration"], rtol=1e-15)


@pytest.mark.parametrize("smoothing", [0.03, 0.1])
@pytest.mark.parametrize("frequency", [1.0, 3.0])
def test_smoothing_is_a_low_pass_without_lag(tmp_path, smoothing, frequency):
    """A small sine keeps its phase and is left with 1/(1 + (2π f T)⁴) of its size, away from the ends."""
    time = np.arange(0.0, 12.0, 0.01)
    file = write_csv(tmp_path / "a.csv", QUATERNION, rows_of(time, wiggle(time, (0.6, 0.0, 0.8), 1e-3, frequency)))
    asked = np.linspace(4.0, 8.0, 801)
    angle = rotations(Recorded(file=file, smoothing=smoothing).motion(asked)).as_rotvec() @ (0.6, 0.0, 0.8)
    share = 1.0 / (1.0 + (2 * np.pi * frequency * smoothing) ** 4)
    wave = np.column_stack([np.sin(2 * np.pi * frequency * asked), np.cos(2 * np.pi * frequency * asked), asked**0])
    sine, cosine, _ = np.linalg.lstsq(wave, angle, rcond=None)[0]
    assert sine == pytest.approx(1e-3 * share, rel=2e-3)
    assert abs(cosine) < 2e-6


def test_smoothing_takes_noise_away(tmp_path):
    time = np.arange(0.0, 8.0, 0.02)
    noise = Rotation.from_rotvec(np.random.default_rng(2).normal(0.0, 2e-3, (len(time), 3)))
    file = write_csv(tmp_path / "a.csv", QUATERNION, rows_of(time, wiggle(time, (0, 0, 1), 0.5, 0.3) * noise))
    asked = np.linspace(0.5, 7.5, 2000)
    rough, smooth = (Recorded(file=file, smoothing=value).motion(asked) for value in (0.0, 0.08))
    true = -0.5 * (2 * np.pi * 0.3) ** 2 * np.sin(2 * np.pi * 0.3 * asked)
    errors = [np.std(motion["acceleration"][:, 2] - true) for motion in (rough, smooth)]
    assert errors[1] < 0.02 * errors[0]
    assert errors[1] < 0.3


# --- before and after


def jumps(reference, at, gap=1e-7):
    """Changes of attitude, rate and acceleration across an instant."""
    motion = reference.motion(np.array([at - gap, at + gap]))
    return [np.abs(np.diff(motion[name], axis=0)).max() for name in ("attitude", "rate", "acceleration")]


def test_it_comes_to_rest_after_its_end_and_from_rest_before_its_start(truth_file):
    held = Recorded(file=truth_file, blend=0.4)
    for at in (-0.4, 0.0, 4.0, 4.4):
        attitude, rate, acceleration = jumps(held, at)
        assert attitude < 1e-6
        assert rate < 1e-5
        assert acceleration < 1e-3
    for still in ([-100.0, -0.4], [4.4, 1e9]):
        motion = held.motion(np.array(still))
        assert np.array_equal(motion["attitude"][0], motion["attitude"][1])
        np.testing.assert_allclose(motion["rate"], 0.0, atol=1e-12)
        np.testing.assert_allclose(motion["acceleration"], 0.0, atol=1e-11)
    end, rest = held.motion(np.array([4.0, 4.4]))
    expected = Rotation.from_rotvec(0.2 * end["rate"] + 0.4**2 / 12 * end["acceleration"])
    gap = rotations(end).inv() * rotations(rest) * expected.inv()
    assert gap.magnitude() < 0.1 * expected.magnitude()
    assert expected.magnitude() > 0.05


def test_it_repeats_for_ever_with_a_smooth_way_back(truth_file):
    repeated = Recorded(file=truth_file, after="repeat", blend=0.8)
    time = np.linspace(0.0, 4.8, 500)
    once = repeated.motion(time)
    for cycle in (-1, 1, 1000):
        again = repeated.motion(time[1:-1] + 4.8 * cycle)
        np.testing.assert_allclose(again["attitude"], once["attitude"][1:-1], atol=1e-10)
        np.testing.assert_allclose(again["acceleration"], once["acceleration"][1:-1], atol=1e-7)
    held = Recorded(file=truth_file).motion(time[time <= 4.0])
    np.testing.assert_allclose(once["rate"][time <= 4.0], held["rate"], atol=1e-12)
    for at in (4.0, 4.8, 8.8, 9.6):
        attitude, rate, acceleration = jumps(repeated, at)
        assert (attitude, rate, acceleration) < (1e-6, 1e-5, 1e-3)
        assert rate < 1e-5
        assert acceleration < 1e-3


def test_a_repeated_turn_does_not_flip_the_quaternion(tmp_path):
    """A turn and a bit a cycle: the quaternion comes back negative, and must go on from there."""
    time = np.arange(0.0, 3.0, 0.02)
    turned = Rotation.from_rotvec(np.outer(2.3 * time, (0.0, 1.0, 0.0)))
    file = write_csv(tmp_path / "a.csv", QUATERNION, rows_of(time, turned))
    repeated = Recorded(file=file, after="repeat", blend=1.0)
    motion = repeated.motion(np.arange(-10.0, 30.0, 1e-3))
    assert np.linalg.norm(np.diff(motion["attitude"], axis=0), axis=1).max() < 0.01
    assert np.abs(np.diff(motion["acceleration"], axis=0)).max() < 1.0


# --- JIGSAWS


@pytest.fixture
def arms():
    time = np.arange(120) / 30.0
    axes = np.vstack([np.eye(3), [[0.6, 0.0, 0.8]]])
    return {
        arm: Rotation.from_rotvec([0.0, 2.0, float(k)]) * wiggle(time, axis, 0.3 + 0.1 * k)
        for k, (arm, axis) in enumerate(zip(ARMS, axes, strict=True))
    }


@pytest.mark.parametrize("arm", [None, *ARMS])
def test_jigsaws_is_recognised_and_the_arm_is_taken(tmp_path, arms, arm):
    file = write_jigsaws(tmp_path / "Suturing_B001.txt", arms)
    chosen = Recorded(file=file, smoothing=0.0, **({"arm": arm} if arm else {}))
    true = arms[arm or "slave_right"]
    time = np.arange(120) / 30.0
    got = rotations(chosen.motion(time))
    gap = (got[:1].inv() * got).inv() * (true[:1].inv() * true)
    assert gap.magnitude().max() < 5e-6
    assert got.magnitude().max() > 0.25


def test_jigsaws_is_smoothed_and_others_are_not(tmp_path, arms, truth_file):
    file = write_jigsaws(tmp_path / "a.txt", arms)
    time = np.linspace(0.0, 3.9, 400)
    assert np.array_equal(Recorded(file=file).motion(time), Recorded(file=file, smoothing=0.04).motion(time))
    assert not np.array_equal(Recorded(file=file).motion(time), Recorded(file=file, smoothing=0.0).motion(time))
    assert np.array_equal(Recorded(file=truth_file).motion(time), Recorded(file=truth_file, smoothing=0.0).motion(time))


def test_a_rotation_matrix_is_read_row_by_row(tmp_path, arms):
    """Columns 62 to 64 of a JIGSAWS file, counted from 1, are x̂ · of the body's three axes; r12 is row 1, column 2."""
    rows = jigsaws_rows(arms)
    np.testing.assert_allclose(rows[:, 60:63], arms["slave_right"].as_matrix()[:, 0, :])
    time = np.arange(120) / 30.0
    matrices = arms["slave_right"].as_matrix()
    columns = {f"r{i + 1}{j + 1}": matrices[:, i, j] for i in range(3) for j in range(3)}
    pq.write_table(pa.table({"t": time, **columns}), tmp_path / "a.parquet")
    np.savetxt(tmp_path / "a.txt", rows, fmt="%.17g")
    table, text = (Recorded(file=tmp_path / name, smoothing=0.0).motion(time) for name in ("a.parquet", "a.txt"))
    np.testing.assert_allclose(table["attitude"], text["attitude"], atol=1e-12)
    np.testing.assert_allclose(table["rate"], text["rate"], atol=1e-11)


# --- how it is given


def test_it_is_named_with_its_file(truth_file):
    expected = Recorded(file=truth_file)
    assert Reference.resolve(f"recorded:{truth_file}", default="hold") == expected
    assert Reference.resolve({"name": f"recorded:{truth_file}", "arm": "slave_left"}, default="hold") == Recorded(
        file=truth_file, arm="slave_left"
    )
    assert Reference.resolve({"name": "recorded", "file": truth_file}, default="hold") == expected
    assert Reference.member(f"recorded:{truth_file}") is Recorded
    changed = with_changes({"reference": f"recorded:{truth_file}"}, {"reference.arm": "master_left"})
    assert Experiment(**changed).reference.arm == "master_left"


def test_a_description_makes_the_same_experiment_again(truth_file, monkeypatch):
    monkeypatch.chdir(truth_file.parent)
    experiment = Experiment(reference={"name": f"recorded:{truth_file.name}", "scale": 0.5, "after": "repeat"})
    assert experiment.reference.file == truth_file
    description = json.loads(json.dumps(experiment.model_dump(mode="json")))
    monkeypatch.chdir("/")
    assert Experiment(**description) == experiment
    assert np.array_equal(
        Experiment(**description).reference.motion(np.arange(3.0)), experiment.reference.motion(np.arange(3.0))
    )


def test_a_changed_file_is_read_anew(truth_file):
    reference = Recorded(file=truth_file)
    before = reference.motion(np.ones(1))
    rows = np.loadtxt(truth_file, delimiter=",", skiprows=1)
    rows[:, 1:] = rows[::-1, 1:]
    write_csv(truth_file, QUATERNION, rows)
    os.utime(truth_file, ns=(1, 1))
    assert not np.array_equal(reference.motion(np.ones(1)), before)
    truth_file.unlink()
    with pytest.raises(ParameterError, match="no such file"):
        reference.motion(np.ones(1))


@pytest.mark.parametrize(
    ("given_", "error", "said"),
    [
        ("recorded:", ParameterError, "path of a file"),
        ({"name": "recorded:a.csv", "file": "b.csv"}, ParameterError, "give one"),
        ({"name": "recorded", "arm": "left"}, ParameterError, "'slave_right'"),
        ({"name": "recorded", "after": "stop"}, ParameterError, "'hold' or 'repeat'"),
        ({"name": "recorded", "scale": -1}, ParameterError, "scale"),
        ({"name": "recorded", "blend": 0}, ParameterError, "blend"),
        ({"name": "recorded", "fil": "a.csv"}, ParameterError, "did you mean 'file'"),
        ("recroded:a.csv", UnknownNameError, "did you mean 'recorded'"),
        ("lissajous:a.csv", UnknownNameError, "did you mean 'lissajous'"),
    ],
)
def test_what_it_cannot_be_is_refused_in_one_line(given_, error, said):
    with pytest.raises(error) as caught:
        Reference.resolve(given_, default="hold")
    assert said in one_line(caught.value)


def test_without_a_file_it_says_how_to_give_one():
    with pytest.raises(ParameterError) as caught:
        Recorded().motion(np.zeros(1))
    assert "recorded:FILE" in one_line(caught.value)
    assert "reference.file" in str(caught.value)


# --- files that are no motion

GOOD = "time,qw,qx,qy,qz\n" + "".join(f"{0.1 * k:.1f},1,0,0,0\n" for k in range(6))
MATRICES = ",".join(MATRIX) + "\n" + "".join(f"{0.1 * k:.1f},1,0,0,0,1,0,0,0,1\n" for k in range(6))
NUMBERS = " ".join(["1"] * 76) + "\n"


def complaint(path, content, **parameters):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(ParameterError) as caught:
        Recorded(file=path, **parameters).motion(np.zeros(1))
    said = one_line(caught.value)
    assert str(path) in said
    return said


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "empty"),
        ("time,qw,qx,qy,qz\n", "no rows"),
        ("\n\n", "no rows"),
        ("# only a comment\n", "no rows"),
        ("time,a,b\n1,2,3\n", "it has 'time', 'a', 'b'"),
        ("qw,qx,qy,qz\n1,0,0,0\n", "no times (time, t or timestamp)"),
        ("time,time,qw,qx,qy,qz\n0,0,1,0,0,0\n", "more than one column 'time'"),
        ("time,qw,qx,qy,qz\n0,1,0,0,0\n1,1,0,0,0\n2,1,0,0,0\n", "at least 4 rows are needed; it has 3"),
        (GOOD + "soon,1,0,0,0\n", "data row 7 has the time 'soon'"),
        (GOOD + "0.6,1,0,0,none of it\n", "'qz'"),
        (GOOD + "0.6,1,0,0\n", "Expected 5 columns, got 4"),
        (GOOD + "0.6,1,inf,0,0\n", "data row 7 has no finite attitude"),
        (GOOD + "inf,1,0,0,0\n", "data row 7 has no finite time"),
        (GOOD + "0.5,0.99,0.1,0,0\n0.6,1,0,0,0\n", "data row 7 has the time of the row before and another attitude"),
        (GOOD + "0.4,1,0,0,0\n0.3,1,0,0,0\n", "data row 7 is not later than the row before (and 1 more)"),
        (GOOD + "0.4,1,0,0,0\n", "data row 7 is not later"),
        (GOOD + "0.5000001,1,0,0,0\n", "data row 7 is less than 1e-06 s later"),
        (GOOD + "1.6,1,0,0,0\n", "data row 7 is more than largest_gap = 0.5 s later"),
        (GOOD + "0.6,1,0.3,0,0\n", "data row 7 has a quaternion whose norm"),
        (GOOD + "0.6,1e300,1e300,0,0\n", "data row 7 has a quaternion whose norm"),
        (GOOD + "0.6,0.6,0.8,0,0\n", "data row 7 turns by 106°"),
        (MATRICES + "0.6,1,0,0,0,1,0,0,0,-1\n", "data row 7 has a matrix"),
        (MATRICES + "0.6,1,0.1,0,0,1,0,0,0,1\n", "data row 7 has a matrix"),
        (MATRICES + "0.6,1e200,0,0,0,1,0,0,0,1\n", "data row 7 has a matrix"),
        (NUMBERS * 5, "data row 1 has a matrix"),
        (NUMBERS + "1 2 3\n", "76 numbers"),
        (NUMBERS + NUMBERS.replace("1", "x"), "76 numbers"),
        (b"\xff\xfe\x00\x01,", "neither a table in text, nor Parquet, nor"),
        (b"PAR1 and no more", "damaged"),
        (GOOD.replace("0.0,", "-1.7e308,") + "1.7e308,1,0,0,0\n", "it has 3 of different times"),
    ],
)
def test_what_is_no_motion_is_refused_in_one_line(tmp_path, content, said):
    assert said in complaint(tmp_path / "wrong.csv", content)


def test_parquet_with_words_is_refused(tmp_path):
    table = pa.table({"time": [0.0, 0.1, 0.2, 0.3], **{name: ["a", "b", "c", "d"] for name in QUATERNION[1:]}})
    pq.write_table(table, tmp_path / "a.parquet")
    assert "numbers" in complaint(tmp_path / "b.parquet", (tmp_path / "a.parquet").read_bytes())


def test_smoothing_needs_five_rows(tmp_path):
    four = "".join(GOOD.splitlines(keepends=True)[:5])
    assert "5 rows" in complaint(tmp_path / "a.csv", four, smoothing=0.1)
    assert len(Recorded(file=tmp_path / "a.csv").motion(np.zeros(1))) == 1


def test_rotations_too_uneven_for_a_spline_are_refused(tmp_path):
    """Found by search: the cubic through the quaternions swings almost through zero, where it has no direction."""
    rows = """0.0000612 0.7721 -0.3369 0.0882 -0.5317\n0.0532302 0.7375 -0.2441 0.0953 -0.6224
        0.0581990 0.2178 -0.3964 -0.3316 -0.8279\n2.8888767 -0.4722 -0.4693 -0.3924 -0.6347
        3.1885182 -0.1942 -0.6341 -0.4449 -0.6019\n3.2515545 0.1708 -0.7578 -0.3248 -0.5395
        3.2990145 0.1686 -0.7209 -0.3424 -0.5785"""
    content = "t,w,x,y,z\n0,1,0,0,0\n" + "\n".join(",".join(row.split()) for row in rows.splitlines())
    assert "too far between data rows 5 and 6" in complaint(tmp_path / "a.csv", content, largest_gap=5.0)


def test_an_end_too_fast_for_a_way_back_is_refused(tmp_path):
    time = np.linspace(0.0, 0.2, 60)
    turned = Rotation.from_rotvec(np.outer(36.5 * time, (0.0, 0.0, 1.0)))
    content = write_csv(tmp_path / "a.csv", QUATERNION, rows_of(time, turned)).read_bytes()
    assert "shorter blend" in complaint(tmp_path / "a.csv", content, after="repeat", blend=0.5)
    assert len(Recorded(file=tmp_path / "a.csv", after="repeat", blend=0.02).motion(time)) == 60


def test_a_folder_is_no_file(tmp_path):
    with pytest.raises(ParameterError) as caught:
        Recorded(file=tmp_path).motion(np.zeros(1))
    assert "cannot be read" in one_line(caught.value)


def test_a_file_of_endless_rows_is_refused_without_reading_it_all(tmp_path):
    path = tmp_path / "long.csv"
    with path.open("w") as file:
        file.write("time,w,x,y,z\n")
        for _ in range(LAST_ROW // 100_000 + 1):
            file.write("1,1,0,0,0\n" * 100_000)
    with pytest.raises(ParameterError) as caught:
        Recorded(file=path).motion(np.zeros(1))
    assert "more than 1000000 rows" in one_line(caught.value)
    path.unlink()


def test_parquet_of_endless_rows_is_refused_without_reading_it(tmp_path):
    many = pa.array(np.zeros(LAST_ROW + 1))
    pq.write_table(pa.table(dict.fromkeys(QUATERNION, many)), tmp_path / "long.parquet")
    with pytest.raises(ParameterError, match="more than 1000000 rows"):
        Recorded(file=tmp_path / "long.parquet").motion(np.zeros(1))


def test_jigsaws_of_endless_rows_is_refused(tmp_path, arms, monkeypatch):
    monkeypatch.setattr(jigsaws, "LAST_ROW", 100)
    file = write_jigsaws(tmp_path / "long.txt", arms)
    with pytest.raises(ParameterError, match="more than 100 rows"):
        Recorded(file=file).motion(np.zeros(1))


@pytest.fixture(scope="module")
def samples(tmp_path_factory):
    """A file of each format, and one to write fuzz into."""
    folder = tmp_path_factory.mktemp("fuzz")
    time = np.arange(40) / 30.0
    turned = rotations(TRUTH.motion(time))
    rows = rows_of(time, turned)
    csv = write_csv(folder / "a.csv", QUATERNION, rows).read_bytes()
    parquet = write_parquet(folder / "a.parquet", QUATERNION, rows).read_bytes()
    jigsaws = write_jigsaws(folder / "a.txt", dict.fromkeys(ARMS, turned)).read_bytes()
    return folder / "fuzz", (csv, parquet, jigsaws)


def is_a_motion_or_refused(path, content, **parameters):
    path.write_bytes(content)
    try:
        motion = Recorded(file=path, **parameters).motion(np.linspace(-1.0, 3.0, 50))
    except WristError as error:
        one_line(error)
    else:
        np.testing.assert_allclose(np.linalg.norm(motion["attitude"], axis=1), 1.0, atol=1e-12)
        assert np.isfinite(motion["acceleration"]).all()


@given(content=st.binary(max_size=400))
def test_any_bytes_are_a_motion_or_refused(samples, content):
    is_a_motion_or_refused(samples[0], content)
    is_a_motion_or_refused(samples[0], b"PAR1" + content + b"PAR1")
    is_a_motion_or_refused(samples[0], b"time,qw,qx,qy,qz\n" + content)


@given(kind=st.integers(0, 2), cut=st.floats(0.0, 1.0))
def test_a_truncated_file_is_a_motion_or_refused(samples, kind, cut):
    path, contents = samples
    is_a_motion_or_refused(path, contents[kind][: int(cut * len(contents[kind]))])


@given(
    kind=st.integers(0, 2),
    places=st.lists(st.tuples(st.floats(0.0, 1.0, exclude_max=True), st.integers(0, 255)), min_size=1, max_size=4),
    after=st.sampled_from(["hold", "repeat"]),
)
def test_a_damaged_file_is_a_motion_or_refused(samples, kind, places, after):
    path, contents = samples
    content = bytearray(contents[kind])
    for place, byte in places:
        content[int(place * len(content))] = byte
    is_a_motion_or_refused(path, bytes(content), after=after, largest_gap=1e3)


@given(
    rows=st.lists(st.tuples(st.floats(1e-5, 10.0), *[st.floats(-1.0, 1.0)] * 3), min_size=4, max_size=12),
    scale=st.floats(0.0, 3.0),
    after=st.sampled_from(["hold", "repeat"]),
)
def test_any_rotations_at_any_times_are_a_motion_or_refused(samples, rows, scale, after):
    """However uneven the times and far apart the rotations."""
    steps, *vectors = np.array(rows).T
    turned = Rotation.from_rotvec(np.stack(vectors, axis=1))
    path = write_csv(samples[0].with_suffix(".csv"), QUATERNION, rows_of(np.cumsum(steps), turned))
    is_a_motion_or_refused(path, path.read_bytes(), scale=scale, after=after, largest_gap=100.0)
