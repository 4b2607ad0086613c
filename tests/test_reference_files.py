"""Recorded motions as people have them: every usual form of file gives the same motion, and flaws are told."""

import json
import os
import time
from datetime import UTC, datetime, timedelta

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.spatial.transform import Rotation

from rigs import one_line
from spherical_wrist import Experiment, simulate
from spherical_wrist.errors import ParameterError
from spherical_wrist.prepare.cache import RunCache
from spherical_wrist.reference import BeatingHeart, Chirp, Lissajous, Recorded, Step, Suture
from spherical_wrist.simulation.rollouts import roll_out

TIME = np.arange(300) * 0.01
EPOCH = 1_700_000_000
NS = np.int64(EPOCH * 10**9) + np.arange(300) * 10**7
RATE, ACCELERATION = 0.45, 0.55
"""Bounds of the true motion [rad/s, rad/s²]."""


def truth(at):
    """A smooth motion, slow enough that every peak above its bounds comes from the file."""
    return Rotation.from_rotvec(np.c_[0.3 * np.sin(1.3 * at), 0.2 * np.sin(0.9 * at), 0.1 * np.sin(at)])


def true_acceleration(time, step=1e-3):
    def rate(at):
        return (truth(at - step).inv() * truth(at + step)).as_rotvec() / (2.0 * step)

    return (rate(time + step) - rate(time - step)) / (2.0 * step)


def wxyz(time=TIME):
    return truth(time).as_quat(scalar_first=True)


def xyzw(time=TIME):
    return truth(time).as_quat()


def text_of(header, *columns, by=",", digits=".9f"):
    """A table; columns of integers and words are written as they are."""

    def written(value):
        return format(value, digits) if isinstance(value, float) else str(value)

    flat = [part for column in columns for part in (np.asarray(column).T if np.ndim(column) > 1 else [column])]
    lines = [by.join(written(value) for value in row) for row in zip(*(list(part) for part in flat), strict=True)]
    return "\n".join(([header] if header else []) + lines) + "\n"


def error_of(reference, time=TIME):
    """Largest angle [rad] between a motion and the true one, both from their first attitude, away from its ends."""
    motion = reference.motion(time)
    got, true = Rotation.from_quat(motion["attitude"], scalar_first=True), truth(time)
    return ((got[:1].inv() * got).inv() * (true[:1].inv() * true)).magnitude().max()


def written(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


KITTI = np.concatenate([truth(TIME).as_matrix(), np.full((300, 3, 1), 0.7)], axis=2).reshape(-1, 12)
POSITION = np.full((300, 3), 0.25)
ROS = "%time,field.header.seq,field.header.stamp,field.pose.position.x,field.pose.position.y,field.pose.position.z," + (
    ",".join(f"field.pose.orientation.{axis}" for axis in "xyzw")
)
PAIR = NS // 10**9, NS % 10**9
ROS2 = "time,header.stamp.sec,header.stamp.nanosec,pose.position.x,pose.position.y,pose.position.z," + (
    ",".join(f"pose.orientation.{axis}" for axis in "xyzw")
)
EUROC = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []"
STAMPS = [f"{EPOCH + k // 100}.{k % 100:02d}0000000" for k in range(300)]
DATES = [str(datetime(2024, 5, 1, tzinfo=UTC) + timedelta(seconds=0.01 * k)) for k in range(300)]
PLAIN = text_of("time,qw,qx,qy,qz", TIME, wxyz())
GIVEN = "time=1, w=2, x=3, y=4, z=5"

FILES = {
    "plain": (PLAIN, {}),
    "TUM": (text_of("# truth\n# timestamp tx ty tz qx qy qz qw", STAMPS, POSITION, xyzw(), by=" "), {}),
    "TUM without names": (text_of("", STAMPS, POSITION, xyzw(), by="  "), {}),
    "EuRoC": (text_of(EUROC, NS, POSITION, wxyz()), {}),
    "EuRoC with a unit": (
        text_of(EUROC.replace("p,", "p [ns],") + ", v_x [m s^-1]", NS, POSITION, wxyz(), TIME, by=", "), {},
    ),
    "KITTI at a rate": (text_of("", KITTI, by=" ", digits=".9e"), {"rate": 100.0}),
    "ROS": (text_of(ROS, NS + 777, range(300), NS, POSITION, xyzw()), {"time_unit": "ns"}),
    "ms": (text_of("time,qw,qx,qy,qz", 1e3 * TIME, wxyz()), {"time_unit": "ms"}),
    "ns": (text_of("timestamp,qw,qx,qy,qz", NS, wxyz()), {"time_unit": "ns"}),
    "ms by name": (text_of("Time (ms);w;x;y;z", range(0, 3000, 10), wxyz(), by=";"), {}),
    "us by name": (text_of("timestamp_us,q_w,q_x,q_y,q_z", NS // 1000, wxyz()), {}),
    "dates": (text_of("stamp,rot.w,rot.x,rot.y,rot.z", DATES, wxyz()), {}),
    "dates without zone": (text_of("stamp,w,x,y,z", [date[:-6] for date in DATES], wxyz()), {}),
    "decimal commas": (PLAIN.replace(",", ";").replace(".", ","), {}),
    "decimal commas and spaces": (text_of("", TIME, wxyz(), by=" ").replace(".", ","), {"columns": GIVEN}),
    "quoted decimal commas": (
        "t,w,x,y,z\n" + "".join(
            '"' + '","'.join(f"{value:.9f}".replace(".", ",") for value in row) + '"\n' for row in np.c_[TIME, wxyz()]
        ),
        {},
    ),
    "tabs, byte-order mark and carriage returns": (
        "\ufeff" + PLAIN.replace(",", "\t").replace("\n", "\r\n"), {},
    ),
    "of a spreadsheet": ("sep=;\n" + PLAIN.replace(",", ";").replace(".", ","), {}),
    "UTF-16": (PLAIN.encode("utf-16"), {}),
    "comments and empty lines": (PLAIN.replace("\n0.5", "\n# half a second\n\n  % more\n0.5"), {}),
    "names after spaces": (text_of("  time   qw qx  qy qz", TIME, wxyz(), by="   "), {}),
    "trailing commas": (PLAIN.replace("\n", ",\n"), {}),
    "columns by name": (text_of("stamp,q0,q1,q2,q3", TIME, wxyz()), {"columns": "time=stamp, w=q0, x=q1, y=q2, z=q3"}),
    "scalar last": (
        text_of("s,q1,q2,q3,q4", TIME, xyzw()), {"columns": {"time": "s", "w": "q4", "x": "q1", "y": "q2", "z": "q3"}},
    ),
    "columns by number": (text_of("", TIME, wxyz()), {"columns": GIVEN}),
    "rad": (
        text_of("t,a,b,c", TIME, truth(TIME).as_rotvec()), {"columns": "time=t, rx=a, ry=b, rz=c"},
    ),
    "deg": (
        text_of("t,a,b,c", TIME, truth(TIME).as_rotvec(degrees=True)),
        {"columns": "time=t, rx_deg=a, ry_deg=b, rz_deg=c"},
    ),
    "ROS 2": (text_of(ROS2, NS + 777, *PAIR, POSITION, xyzw()), {}),
    "ROS 1 in two columns": (text_of("stamp_secs,stamp_nsecs,qx,qy,qz,qw", *PAIR, xyzw()), {}),
    "seconds and nanoseconds": (text_of("# sec nanosec qw qx qy qz", *PAIR, wxyz(), by=" "), {}),
    "two columns by number": (text_of("", *PAIR, wxyz()), {"columns": "sec=1, nanosec=2, w=3, x=4, y=5, z=6"}),
    "roll, pitch and yaw": (
        text_of("t,yaw,pitch,roll", TIME, truth(TIME).as_euler("ZYX")),
        {"columns": "time=t, roll=roll, pitch=pitch, yaw=yaw"},
    ),
    "angles in degrees": (
        text_of("sec,nanosec,heading,p,r", *PAIR, truth(TIME).as_euler("ZYX", degrees=True)),
        {"columns": "sec=sec, nanosec=nanosec, roll_deg=r, pitch_deg=p, yaw_deg=heading"},
    ),
    "matrix from 0": (
        text_of(
            "t," + ",".join(f"R{i}{j}" for i in "012" for j in "012"), TIME, truth(TIME).as_matrix().reshape(-1, 9)
        ),
        {},
    ),
    "real and imaginary": (text_of("t,qr,qi,qj,qk", TIME, wxyz()), {}),
    "signs that flip": (text_of("t,w,x,y,z", TIME, wxyz() * np.where(np.arange(300) % 7 < 3, -1.0, 1.0)[:, None]), {}),
    "not quite normal": (text_of("t,w,x,y,z", TIME, wxyz() * np.linspace(0.99, 1.01, 300)[:, None]), {}),
}  # fmt: skip


@pytest.mark.parametrize("form", FILES)
def test_every_usual_form_gives_the_same_motion(tmp_path, form):
    content, settings = FILES[form]
    reference = Recorded(file=written(tmp_path / "motion.txt", content), **settings)
    assert error_of(reference) < 2e-7
    assert np.linalg.norm(reference.motion(TIME)["acceleration"], axis=1).max() < ACCELERATION
    assert reference.warnings(2.0) == ()
    assert reference.whole() == pytest.approx(2.99, abs=1e-12)


@pytest.mark.parametrize("form", ["TUM", "EuRoC", "ns", "us by name", "dates", "ROS", "ROS 2"])
def test_large_times_lose_no_digits(tmp_path, form):
    """As double-precision numbers, nanoseconds since 1970 are multiples of 256, and seconds of 2.4e-7."""
    content, settings = FILES[form]
    same = Recorded(file=written(tmp_path / "plain.txt", FILES["plain"][0]))
    reference = Recorded(file=written(tmp_path / "motion.txt", content), **settings)
    asked = np.linspace(0.0, 2.99, 500)
    assert np.array_equal(reference.motion(asked)["acceleration"], same.motion(asked)["acceleration"])


@pytest.mark.parametrize("kind", ["index of pandas", "integers", "integers with a unit", "text", "times of day", "two"])
def test_parquet_as_others_write_it(tmp_path, kind):
    names = {"index of pandas": "__index_level_0__", "integers": "t", "text": "stamp"}
    name = names.get(kind, "time_ns" if kind == "integers with a unit" else "time")
    times = pa.array(NS)
    if kind in ("index of pandas", "times of day"):
        times = times.cast(pa.timestamp("ns") if kind == "index of pandas" else pa.duration("ns"))
    if kind == "text":
        times = pa.array(DATES)
    columns = dict(zip(("qw", "qx", "qy", "qz"), wxyz().T, strict=True))
    stamp = {"header.stamp.sec": PAIR[0], "header.stamp.nanosec": PAIR[1].astype(np.uint32)}
    stamp = stamp if kind == "two" else {name: times}
    pq.write_table(pa.table({**columns, **stamp}), tmp_path / "a.parquet")
    unit = {"time_unit": "ns"} if kind == "integers" else {}
    assert error_of(Recorded(file=tmp_path / "a.parquet", **unit)) < 1e-12


def test_kitti_has_its_times_in_another_file_which_the_recording_carries(tmp_path, monkeypatch):
    poses = written(tmp_path / "00.txt", text_of("", KITTI, by=" ", digits=".9e"))
    times = written(tmp_path / "times.txt", "".join(f"{t:e}\n" for t in TIME))
    reference = Recorded(file=poses, times=times)
    assert error_of(reference) < 1e-7
    experiment = Experiment(reference=reference, duration=0.05)
    run = simulate(experiment)
    assert {"reference.file", "reference.times"} <= set(run.embedded_files.places)
    folder = tmp_path / "elsewhere"
    run.embedded_files.unpack(folder)
    times.unlink()
    again = simulate(Experiment(**run.embedded_files.described(run.description, folder)))
    assert np.array_equal(again.attitude, run.attitude)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes on this system")
def test_a_pipe_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for file in (tmp_path / "pipe", "/dev/zero"):
        with pytest.raises(ParameterError, match="no file that can be read twice"):
            Recorded(file=file).motion(TIME)


@pytest.mark.parametrize("column", ["lists", "long text"])
def test_parquet_that_unpacks_to_much_is_refused_before_it_is_read(tmp_path, column):
    """A text of a megabyte that stands 100,000 times takes a megabyte in the file, and a hundred gigabytes outside."""
    rows = 100_000
    numbers = dict.fromkeys(("qw", "qx", "qy", "qz"), pa.array(np.zeros(rows)))
    if column == "lists":
        numbers["qw"] = pa.array([[0.0]] * rows)
        numbers["time"] = pa.array(np.arange(float(rows)))
    else:
        numbers["time"] = pa.DictionaryArray.from_arrays(np.zeros(rows, np.int32), ["1" * 2**20])
    pq.write_table(pa.table(numbers), tmp_path / "a.parquet", store_schema=column == "lists")
    with pytest.raises(ParameterError, match=r"values of type list|more than 64 characters"):
        Recorded(file=tmp_path / "a.parquet").motion(TIME)


@pytest.mark.parametrize("line", [" " * 900_000 + "x", "(" * 60_000, "1" + " " * 900_000 + "2", "#" * 900_000])
def test_a_strange_line_takes_no_time(tmp_path, line):
    before = time.perf_counter()
    for content in (line, f"{line}\n{PLAIN}", PLAIN.replace(",", " ") + line):
        try:
            Recorded(file=written(tmp_path / "a.csv", content)).motion(TIME)
        except ParameterError as error:
            one_line(error)
    assert time.perf_counter() - before < 5.0


# --- words


@pytest.mark.parametrize(
    ("form", "said"),
    [
        ("TUM", "TUM trajectory, quaternion in the order x, y, z, w"),
        ("TUM without names", "no names, eight columns: TUM"),
        ("EuRoC", "EuRoC ground truth"),
        ("KITTI at a rate", "KITTI poses"),
        ("ROS", "from field.pose.orientation.w, field.pose.orientation.x"),
        ("decimal commas", "quaternion w, x, y, z from qw, qx, qy, qz, separated by semicolons, decimal commas"),
        ("scalar last", "quaternion from time=s, w=q4, x=q1, y=q2, z=q3"),
        ("us by name", "times in microseconds"),
    ],
)
def test_it_says_what_was_recognised(tmp_path, form, said):
    content, settings = FILES[form]
    summary = Recorded(file=written(tmp_path / "motion.txt", content), **settings).about()
    assert said in summary
    assert "300 rows at 100 Hz over 2.99 s, no gaps; peaks of 0.44 rad/s and 0.53 rad/s²; largest step 0.25°" in summary
    assert "\n" not in summary


def test_it_says_how_far_smoothing_moves_rows(tmp_path):
    file = written(tmp_path / "a.csv", PLAIN)
    before, after = (
        Rotation.from_quat(Recorded(file=file, smoothing=T).motion(TIME)["attitude"], scalar_first=True)
        for T in (0, 0.3)
    )
    moved = np.degrees((before.inv() * after).magnitude().max())
    told = Recorded(file=file, smoothing=0.3).about()
    assert f"smoothing of 0.3 s moves rows by up to {moved:.2g}°" in told


# --- rows that are left out


def rows_with(change):
    lines = PLAIN.splitlines(keepends=True)
    return "".join(change(lines))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (rows_with(lambda rows: [*rows[:101], rows[100], *rows[101:]]), "data row 101 with the time and the attitude"),
        (
            rows_with(lambda rows: [*rows[:9], *rows[8:9] * 2, *rows[9:50], *rows[49:50], *rows[50:]]),
            "3 rows (the first: data row 9) with the time and the attitude of the row before, left out",
        ),
        (rows_with(lambda rows: [*rows[:51], "0.5,nan,nan,nan,nan\n", *rows[52:]]), "data row 51 without an attitude"),
        (
            rows_with(lambda rows: [*rows[:51], "0.5,,,,\n", "0.51,0,0,0,0\n", *rows[53:]]),
            "2 rows (the first: data row 51) without an attitude",
        ),
    ],
)  # fmt: skip
def test_rows_that_say_nothing_are_left_out_and_told(tmp_path, content, said):
    reference = Recorded(file=written(tmp_path / "a.csv", content))
    assert error_of(reference) < 1e-6
    (warning,) = reference.warnings(2.0)
    assert said in warning


# --- what is refused, and what to do


def complaint(path, content, **settings):
    with pytest.raises(ParameterError) as caught:
        Recorded(file=written(path, content), **settings).motion(np.zeros(1))
    return one_line(caught.value)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (text_of("time,qw,qx,qy,qz", 1e3 * TIME, wxyz()), "milliseconds (10 from row to row): give reference.time"),
        (text_of("timestamp,qw,qx,qy,qz", NS, wxyz()), "nanoseconds (1e+07 from row to row): give reference.time"),
        (text_of("t,w,x,y,z", NS // 1000, wxyz()), "look like microseconds"),
        (text_of("t,w,x,y,z", 250 * np.arange(300), wxyz()), "milliseconds or microseconds"),
        (text_of("t,w,x,y,z", 2.0 * np.arange(300), wxyz()), "if they are seconds, a longer reference.largest_gap"),
        (text_of("t,w,x,y,z", 0.6 * np.arange(300), wxyz()), "if they are seconds, a longer reference.largest_gap"),
        (PLAIN.replace("\n2.99", "\n3.6"), "data row 300 is more than largest_gap"),
        (text_of("", KITTI, by=" "), "give reference.rate [Hz], rows in a second, or reference.times"),
        (text_of("", TIME, wxyz()), "5 columns have no names: say which is which by number"),
        (text_of("t,q1,q2,q3,q4", TIME, wxyz()), "q1 … do not say which one is the scalar w: name them"),
        (text_of("t,a_w,a_x,a_y,a_z,b_w,b_x,b_y,b_z", TIME, wxyz(), wxyz()), "several attitudes ('a_w', 'b_w' …)"),
        (text_of("t,roll,pitch,yaw", TIME, POSITION), "it has 't', 'roll', 'pitch', 'yaw'; say of roll, pitch and yaw"),
        (text_of("sec,nanosec,qw,qx,qy,qz", range(300), [10**9] * 300, wxyz()), "has no nanoseconds from 0 to 999,999"),
        (text_of("sec,nanosec,qw,qx,qy,qz", range(300), [-1] * 300, wxyz()), "row 1 has no nanoseconds from 0 to"),
        (text_of("sec,nanosec,qw,qx,qy,qz", [10**15] * 300, range(300), wxyz()), "row 1 has no number of seconds"),
        (PLAIN.replace("\n1.0", "\n0.9"), "data row 101 is not later than the row before"),
        (rows_with(lambda rows: [*rows[:101], rows[100][:12] + "1,0,0,0\n", *rows[101:]]),
         "row 101 has the time of the row before and another attitude: if rows are evenly spaced, give reference.rate"),
        (text_of("t,w,x,y,z", TIME, 1.7 * wxyz()), "norm is not 1 to within 0.02 (and 299 more): other col"),
        (PLAIN.replace("qz", "qz,more"), "its header has 6 names, and a row 5 numbers"),
        ("t,w,x,y,z\n" + "1," * 3_000_000 + "1\n", "line of more than 1048576 characters"),
        (b"\x7fELF\x00\x01", "neither a table in text, nor Parquet"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_says_how_it_can(tmp_path, content, said):
    assert said in complaint(tmp_path / "a.csv", content)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"columns": "time=time, w=nothing, x=qx, y=qy, z=qz"}, "it has no column 'nothing'; it has 'time', 'qw'"),
        ({"columns": "time=9, w=2, x=3, y=4, z=5"}, "it has no column '9'"),
        ({"columns": "time=time, rx=time, ry=qx, rz=qy"}, "names a column twice"),
        ({"times": "short"}, "it has 3 times, and the motion 300 rows"),
        ({"times": "wide"}, "it has 2 columns: one of times is needed"),
        ({"times": "missing"}, "no such file"),
        ({"rate": 1.0}, "more than largest_gap"),
        (
            {"time_unit": "ns"},
            "less than 1e-06 s later than the row before (and 298 more): give another reference.time",
        ),
    ],
)
def test_settings_that_do_not_fit_the_file_are_refused(tmp_path, settings, said):
    written(tmp_path / "short", "0\n1\n2\n")
    written(tmp_path / "wide", "a,b\n0,1\n")
    settings = {name: tmp_path / value if name == "times" else value for name, value in settings.items()}
    assert said in complaint(tmp_path / "a.csv", PLAIN, **settings)


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ("w=1", "the parts of one attitude are needed"),
        ("time=1, w=2, x=3, y=4, z=5, q=6", "unknown role of a column 'q'"),
        ("time=1, time=2, w=2, x=3, y=4, z=5", "each role once"),
        ("t", "time=NAME, w=NAME"),
        ("sec=1, w=2, x=3, y=4, z=5", "a stamp is time, or sec and nanosec together"),
        ("time=1, sec=2, nanosec=3, w=2, x=3, y=4, z=5", "a stamp is time, or sec and nanosec together"),
        ("time=1, roll=2, pitch=3, yaw_deg=4", "roll, pitch, yaw in rad, or roll_deg"),
        ({"time": "t", "w": "a", "x": "b", "y": "c"}, "the parts of one attitude are needed"),
    ],
)
def test_columns_that_are_no_attitude_are_refused(columns, said):
    with pytest.raises(ParameterError) as caught:
        Recorded(columns=columns)
    assert said in one_line(caught.value)


@pytest.mark.parametrize(("roles", "advised"), [("rx=a, ry=b, rz=c", "rx_deg"), ("roll=a, pitch=b, yaw=c", "roll_deg")])
def test_degrees_are_not_taken_for_radians(tmp_path, roles, advised):
    turning = np.c_[np.zeros((300, 2)), np.linspace(0.0, 90.0, 300)]
    said = complaint(tmp_path / "a.csv", text_of("t,a,b,c", TIME, turning), columns=f"time=t, {roles}")
    assert "two turns and more" in said
    assert advised in said


# --- flaws


def noisy(time, size, seed=1):
    return truth(time) * Rotation.from_rotvec(np.random.default_rng(seed).normal(0.0, size, (len(time), 3)))


def flawed(path, time, rotations, digits=".9f", matrices=False):
    if matrices:
        names = ",".join(f"r{i}{j}" for i in "123" for j in "123")
        content = np.round(rotations.as_matrix().reshape(-1, 9), 2)
        return written(path, text_of(f"t,{names}", time, content, digits=digits))
    return written(path, text_of("t,w,x,y,z", time, rotations.as_quat(scalar_first=True), digits=digits))


LONG = np.arange(400) * 0.01


def turned_from(row, angle, rows=None, time=LONG):
    after = np.arange(len(time)) >= row
    if rows is not None:
        after &= np.arange(len(time)) < row + rows
    return Rotation.from_rotvec(np.outer(after * np.radians(angle), (0.0, 0.6, 0.8))) * truth(time)


BURSTS = np.repeat(LONG[4::5], 5) + np.tile(np.arange(5) * 2e-4, 80)
JITTER = np.sort(LONG + np.random.default_rng(0).uniform(-4e-3, 4e-3, 400))
ROUNDED = np.round(np.arange(120) / 30.0, 2)
FLAWS = {
    "bursts": (BURSTS, truth(LONG), {}, "rate", "belong to these stamps", 2e-3),
    "jitter": (JITTER, truth(LONG), {}, "rate", "belong to these stamps", 2e-3),
    "rounded times": (ROUNDED, truth(np.arange(120) / 30.0), {}, "rate", "by reference.rate=30", 2e-3),
    "a jump that stays": (LONG, turned_from(180, 32.8), {}, "jump", "data row 181 by 32.", 1e-3),
    "a row elsewhere": (LONG, turned_from(180, 20.0, 1), {}, "jump", "data row 181 by 20", 1e-3),
    "rows elsewhere": (LONG, turned_from(180, 60.0, 3), {}, "jump", "data row 181 by 60", 1e-3),
    "two decimals": (LONG, truth(LONG), {"matrices": True}, "smoothing", "belongs to rounding to 2 decimals", 0.02),
    "three decimals": (LONG, truth(LONG), {"digits": ".3f"}, "smoothing", "rounding to 3 decimals", 2e-3),
    "noise": (LONG, noisy(LONG, 2e-3), {}, "smoothing", "belongs to noise of about 2 mrad", 5e-3),
    "little noise": (LONG, noisy(LONG, 1e-4), {}, "smoothing", "belongs to noise of about 0.098 mrad", 5e-4),
}


@pytest.mark.parametrize("flaw", FLAWS)
def test_a_flaw_is_told_with_the_setting_that_helps(tmp_path, flaw):
    """With that setting the motion is the true one again, down to its acceleration."""
    time, rotations, form, setting, said, error = FLAWS[flaw]
    reference = Recorded(file=flawed(tmp_path / "a.csv", time, rotations, **form))
    (warning,) = reference.warnings(2.0)
    assert said in warning
    helped = reference.sizing()
    assert f"reference.{setting}={getattr(helped, setting):g}" in warning
    assert helped == reference.replaced(**{setting: getattr(helped, setting)})
    assert helped.warnings(2.0) == ()
    asked = np.linspace(0.4, 3.6, 500)
    assert error_of(helped, asked) < error
    rough, calm = (np.linalg.norm(each.motion(asked)["acceleration"], axis=1).max() for each in (reference, helped))
    assert rough > 2.0 * ACCELERATION
    assert calm < 1.3 * ACCELERATION
    wrong = helped.motion(asked)["acceleration"] - true_acceleration(asked)
    assert np.linalg.norm(wrong, axis=1).max() < 0.4 * ACCELERATION


@pytest.mark.parametrize("rate", [30, 100, 1000])
@pytest.mark.parametrize(
    "motion",
    [Lissajous(), BeatingHeart(), Suture(), Step(), Chirp(), None],
    ids=lambda motion: getattr(motion, "name", "uneven"),
)
def test_a_good_file_is_told_nothing_about(tmp_path, motion, rate):
    """However fast the motion, and however uneven its true times."""
    time = np.arange(0.0, 3.0, 1.0 / rate)
    if motion is None:
        time[1:-1] += np.random.default_rng(1).uniform(-0.3, 0.3, len(time) - 2) / rate
        rotations = truth(time)
    else:
        rotations = Rotation.from_quat(motion.motion(time)["attitude"], scalar_first=True)
    reference = Recorded(file=flawed(tmp_path / "a.csv", time, rotations))
    assert reference.warnings(2.0) == ()
    assert reference.sizing() is reference


def test_a_body_at_rest_is_no_flaw(tmp_path):
    still = Rotation.from_rotvec(np.zeros((400, 3)))
    assert Recorded(file=flawed(tmp_path / "a.csv", LONG, still)).warnings(2.0) == ()


def test_a_turn_too_far_to_be_interpolated_can_be_taken_out(tmp_path):
    file = flawed(tmp_path / "a.csv", LONG, turned_from(180, 120.0))
    with pytest.raises(ParameterError, match=r"reference\.jump=1 takes it out"):
        Recorded(file=file).motion(TIME)
    helped = Recorded(file=file, jump=1.0)
    assert error_of(helped, LONG) < 1e-4
    assert "1 turn of more than 1 rad taken out" in helped.about()
    with pytest.raises(ParameterError, match=r"would take out 399 of its 399 turns .* give a larger one"):
        Recorded(file=file, jump=1e-9).motion(TIME)


@pytest.mark.parametrize("flaw", ["bursts", "a jump that stays", "noise"])
def test_a_flaw_does_not_size_the_disturbance(tmp_path, flaw):
    """Twenty-five per cent of what the motion needs, not of what its flaw would."""
    time, rotations, form, *_ = FLAWS[flaw]
    good = Recorded(file=flawed(tmp_path / "good.csv", LONG, truth(LONG)))
    bad = Recorded(file=flawed(tmp_path / "bad.csv", time, rotations, **form))
    sizes = [
        np.abs(simulate(Experiment(reference=reference, law="pd", duration=3.9)).disturbance).max()
        for reference in (good, bad)
    ]
    assert sizes[1] == pytest.approx(sizes[0], rel=0.25)


# --- the end of a motion


def test_the_whole_motion(tmp_path):
    file = written(tmp_path / "a.csv", PLAIN)
    for given in (
        {"reference": f"recorded:{file}"},
        {"reference": {"name": "recorded", "file": str(file), "after": "repeat"}},
    ):
        assert Experiment(**given, duration="whole").duration == pytest.approx(2.99, abs=1e-12)
    experiment = Experiment(reference={"name": "recorded", "file": file, "speed": 1.3}, duration="whole")
    assert experiment.duration == pytest.approx(2.3, abs=1e-12)
    assert experiment.replaced(control_period=0.004, duration="whole").duration == pytest.approx(2.3, abs=1e-12)
    assert experiment.reference.warnings(experiment.duration) == ()
    toml = written(tmp_path / "a.toml", f'duration = "whole"\nreference = "recorded:{file}"\n')
    assert Experiment.from_toml(toml).duration == pytest.approx(2.99, abs=1e-12)
    with pytest.raises(ParameterError, match="has no end"):
        Experiment(duration="whole")


def test_figures_end_with_the_motion(tmp_path):
    """The steady window of a short motion is its second half, whatever the run does after it."""
    file = written(tmp_path / "a.csv", PLAIN)
    short = {"reference": {"name": "recorded", "file": str(file), "speed": 2.99 / 1.6}, "law": "pd"}
    run, longer = (simulate(Experiment(**short, duration=duration)) for duration in (1.6, 2.5))
    assert run.measurement.steady_until is None
    assert longer.measurement.steady_until == pytest.approx(1.6)
    assert longer.measurement.steady_from == pytest.approx(0.8)
    window = (longer.time >= 0.7999) & (longer.time <= 1.6001)
    size = np.linalg.norm(longer.error[window], axis=1)
    assert longer.metrics.rms_error_rad == pytest.approx(np.sqrt(np.mean(size**2)), rel=1e-12)
    assert longer.metrics.max_error_rad == pytest.approx(size.max(), rel=1e-12)
    (warning,) = Experiment(**short).reference.warnings(2.5)
    assert "it ends at 1.6 s, and the run at 2.5 s" in warning
    assert "--duration whole" in warning


def test_the_warnings_of_a_motion_are_those_of_its_runs(tmp_path):
    file = flawed(tmp_path / "a.csv", BURSTS, truth(LONG))
    experiment, loops = Experiment(reference=f"recorded:{file}", law="pd", duration=5.0), []
    roll_out(
        [lambda: experiment], RunCache(), stop=lambda: bool(loops), keep=lambda loop, _: loops.append(loop), chunk=10
    )
    bursts, early = loops[0].warnings[:2]
    assert (bursts, early) == experiment.reference.warnings(5.0)
    assert "reference.rate=100" in bursts
    assert "--duration whole" in early


def test_a_changed_file_changes_the_run(tmp_path):
    file = written(tmp_path / "a.csv", PLAIN)
    experiment = Experiment(reference=f"recorded:{file}", duration=0.02, law="pd")
    before = simulate(experiment)
    written(file, text_of("time,qw,qx,qy,qz", TIME, wxyz(3.0 * TIME)))
    assert not np.array_equal(simulate(experiment).desired_attitude, before.desired_attitude)


def test_the_command_lasts_as_long_as_the_motion_and_says_what_it_is(wrist, tmp_path):
    file = written(tmp_path / "motion.csv", PLAIN)
    arguments = ["run", "--reference", f"recorded:{file}", "--set", "reference.speed=10", "--law", "pd"]
    code, out, _ = wrist(*arguments, "--duration", "whole")
    assert code == 0
    assert "0.299 s at 1000 Hz" in out
    assert "motion motion.csv: quaternion w, x, y, z from qw, qx, qy, qz" in " ".join(out.split())
    code, out, _ = wrist(*arguments, "--duration", "0.5", "--json")
    told = json.loads(out)
    assert (code, told["duration_s"]) == (0, 0.5)
    assert told["motion"] == Recorded(file=file).about()
    code, out, error = wrist(*arguments, "--duration", "all")
    assert (code, out) == (2, "")
    assert "'all' is neither a number of seconds nor whole" in error


@pytest.mark.parametrize(
    ("option", "name", "said"),
    [
        ("--reference", "tum.txt", "a motion in a file is given as recorded:tum.txt"),
        ("--reference", "motions/euroc.csv", "a motion in a file is given as recorded:motions/euroc.csv"),
        ("--reference", "mine.py", "no such file 'mine.py'"),
        ("--reference", "lissajou", "did you mean 'lissajous'?"),
    ],
)
def test_a_file_without_what_it_is_comes_with_advice(wrist, option, name, said):
    code, _, err = wrist("run", option, name, "--no-recording")
    assert (code, err.count("\n")) == (2, 1)
    assert said in err
