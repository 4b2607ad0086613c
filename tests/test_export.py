"""Exports of a run, read back by other means than those that wrote them: every bit is there, with its unit."""

import csv
import json
import math
import struct

import numpy as np
import pyarrow.parquet
import pytest

from spherical_wrist import Experiment, simulate
from spherical_wrist.channels import CHANNELS
from spherical_wrist.errors import ParameterError
from spherical_wrist.inspection import export
from spherical_wrist.inspection.columns import columns
from spherical_wrist.inspection.export import exported

FORMATS = ("csv", "parquet", "npz")


@pytest.fixture(scope="module")
def run():
    """A run with every array, and with the numbers that are the hardest to write."""
    own = {"law": "fuzzy_integral_sliding", "sensing": "realistic", "actuation": "realistic", "seed": 7}
    found = simulate(Experiment(duration=0.3, disturbance={"amplitude": 0.004}, **own), record_every=3)
    torque, surface = found.torque.copy(), found.surface.copy()
    torque[:8, 0] = [np.nan, np.inf, -np.inf, -0.0, 5e-324, 1.7976931348623157e308, 0.1 + 0.2, -1.0 / 3.0]
    surface[5] = np.nan
    return found.replaced(torque=torque, surface=surface)


def write(run, tmp_path, kind):
    path = tmp_path / f"run.{kind}"
    path.write_bytes(b"".join(exported(run, path)))
    return path


def bits(values):
    """Bits of numbers, with one pattern for all that are none."""
    return [struct.pack("<d", math.nan if math.isnan(value) else value) for value in map(float, values)]


def expected(run):
    """Every number of the run by the name that its column should have."""
    axes = {1: ("",), 3: ("_x", "_y", "_z"), 4: ("_w", "_x", "_y", "_z")}
    spelled = {
        "": "", "s": "_s", "m": "_m", "rad": "_rad", "1/s": "_per_s", "N·m": "_Nm", "A": "_A", "rad/s": "_rad_per_s",
        "rad/s²": "_rad_per_s2", "rad/s³": "_rad_per_s3", "rad·s": "_rad_s",
    }  # fmt: skip
    law = run.experiment.law
    state = [f"_{each}{spelled[unit]}" for each, unit in zip(law.state_names(), law.state_units(), strict=True)]
    found = {}
    for name, array in run.channels.items():
        rows = array.reshape(len(run), -1)
        count = rows.shape[1]
        marks = (
            [f"_{k}" for k in range(count)] if name == "current" else state if name == "law_state" else axes.get(count)
        )
        found |= {f"{name}{mark}{spelled[CHANNELS[name].unit]}": rows[:, k] for k, mark in enumerate(marks)}
    return found


def test_every_column_has_a_name_with_its_unit(run):
    names = [column.name for column in columns(run)]
    assert names == list(expected(run))
    assert names[:3] == ["time_s", "attitude_w", "attitude_x"]
    assert {"error_x_rad", "rate_y_rad_per_s", "slope_z_per_s", "torque_x_Nm", "current_23_A", "condition"} <= set(
        names
    )


def test_csv_gives_every_bit_back(run, tmp_path):
    with write(run, tmp_path, "csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    truth = expected(run)
    assert header == list(truth)
    assert len(rows) == len(run)
    for name, texts in zip(header, zip(*rows, strict=True), strict=True):
        assert bits(texts) == bits(truth[name]), name
    assert rows[0][header.index("torque_x_Nm")] == "nan"
    assert max(len(text.lstrip("-0.").partition("e")[0].replace(".", "")) for row in rows for text in row) <= 17


def test_parquet_gives_every_bit_back_with_units_and_the_experiment(run, tmp_path):
    table = pyarrow.parquet.read_table(write(run, tmp_path, "parquet"))
    truth = expected(run)
    assert table.column_names == list(truth)
    for name in truth:
        assert table.column(name).null_count == 0
        assert bits(table.column(name).to_numpy()) == bits(truth[name]), name
    assert table.schema.field("error_x_rad").metadata[b"unit"] == b"rad"
    assert table.schema.field("torque_z_Nm").metadata[b"unit"].decode() == "N·m"
    told = {name.decode(): json.loads(text) for name, text in table.schema.metadata.items()}
    assert told["experiment"] == run.description
    assert Experiment(**told["experiment"]) == run.experiment
    assert told["metrics"] == dict(run.metrics)
    assert told["versions"] == run.versions
    assert told["record_every"] == 3


def test_npz_gives_every_array_back_without_pickle(run, tmp_path):
    with np.load(write(run, tmp_path, "npz"), allow_pickle=False) as archive:
        for name, array in run.channels.items():
            assert archive[name].shape == array.shape
            assert archive[name].tobytes() == array.tobytes(), name
        assert json.loads(str(archive["experiment"])) == run.description
        assert json.loads(str(archive["metrics"])) == dict(run.metrics)
        assert json.loads(str(archive["units"]))["torque"] == "N·m"


@pytest.mark.parametrize("kind", FORMATS)
def test_pieces_make_the_same_file_however_small_they_are(run, tmp_path, monkeypatch, kind):
    """Memory is bounded by a piece; in the end there is one table, and the same run makes the same bytes."""
    whole = write(run, tmp_path, kind).read_bytes()
    assert write(run, tmp_path, kind).read_bytes() == whole
    monkeypatch.setattr(export, "ROWS", 7)
    path = tmp_path / f"run.{kind}"
    pieces = list(exported(run, path))
    assert len(pieces) > 10
    path.write_bytes(b"".join(pieces))
    if kind == "parquet":
        assert pyarrow.parquet.read_table(path).num_rows == len(run)
    else:
        assert path.read_bytes() == whole


def test_ideal_hardware_has_no_columns_of_its_own(tmp_path):
    plain = simulate(Experiment(law="pd", duration=0.01, disturbance=0))
    names = [column.name for column in columns(plain)]
    assert names[-1] == "saturated"
    assert not [name for name in names if name.startswith(("measured", "current", "law_state"))]
    for kind in FORMATS:
        assert write(plain, tmp_path, kind).stat().st_size > 0


@pytest.mark.parametrize("name", ["run.xls", "run", "run.csv.gz", ".csv"])
def test_another_name_is_an_error_with_the_valid_ones(run, tmp_path, name):
    with pytest.raises(ParameterError, match=r"must end in \.csv, \.parquet or \.npz"):
        exported(run, tmp_path / name)
