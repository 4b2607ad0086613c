"""``wrist inspect`` and ``wrist diff``: pictures, exports, differences, exit codes, and what is left when it fails."""

import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from rigs import one_line
from sampling import some
from spherical_wrist import Experiment, load_recording, record, simulate
from spherical_wrist.colours import AXES, of_components
from spherical_wrist.inspection.curves import telling_rows, view, with_gaps
from spherical_wrist.inspection.difference import difference
from spherical_wrist.inspection.difference_picture import difference_picture
from spherical_wrist.inspection.drawing import figure
from spherical_wrist.inspection.picture import BESIDE, NARROWEST, run_picture
from spherical_wrist.inspection.run_difference import run_difference
from spherical_wrist.inspection.settings import differing_settings
from spherical_wrist.loop.outcome import Outcome, Status
from spherical_wrist.measure.metrics import Metrics
from spherical_wrist.picture_file import picture_content
from spherical_wrist.so3 import rotation_vectors

AMPLITUDE = {"amplitude": 0.004}
"""Of the disturbance [N·m], for which no peak torque has to be found."""


def run(record_every=1, **changes):
    return simulate(Experiment(**{"duration": 0.4, "disturbance": AMPLITUDE, **changes}), record_every=record_every)


@pytest.fixture(scope="module")
def fuzzy():
    return run()


@pytest.fixture(scope="module")
def sheet(fuzzy):
    return run_picture(fuzzy, ["title"])


def titles(drawing):
    """Return the titles above every panel, left and right."""
    return {panel.get_title(loc="left"): panel.get_title(loc="right") for panel in drawing.axes}


def panel_of(drawing, title):
    return next(panel for panel in drawing.axes if panel.get_title(loc="left") == title)


# curves


def test_reduced_curves_keep_every_extreme_and_both_ends():
    rng = np.random.default_rng(1)
    curve = np.sin(np.arange(1e5) / 9e3) + rng.choice([-0.2, 0.2], 100_000)
    curve[54_321] = 3.0
    rows = telling_rows(curve, 100)
    assert len(rows) <= 4 * 101 + 100
    assert (np.diff(rows) > 0).all()
    assert rows[[0, -1]].tolist() == [0, 99_999]
    for first in range(0, 100_000, 1000):
        kept = curve[rows[(rows >= first) & (rows < first + 1000)]]
        assert (kept.min(), kept.max()) == (curve[first : first + 1000].min(), curve[first : first + 1000].max())


def test_reduced_curves_skip_gaps_and_keep_those_that_fill_a_bin():
    curve = np.arange(10_000.0)
    curve[103:108] = np.nan
    curve[5000:5400] = np.nan
    rows = telling_rows(curve, 100)
    assert np.isnan(curve[rows[(rows >= 5000) & (rows < 5400)]]).all()
    assert not np.isnan(curve[rows[(rows >= 0) & (rows < 5000)]]).any()
    assert telling_rows(np.full(10_000, np.nan), 100)[-1] == 9999
    assert telling_rows(curve[:400], 100).tolist() == list(range(400))


def test_rotation_vectors_are_those_of_scipy_with_gaps_where_they_jump():
    attitudes = Rotation.random(500, rng=np.random.default_rng(2))
    found = with_gaps(rotation_vectors(attitudes.as_quat(scalar_first=True)))
    clear = ~np.isnan(found[:, 0])
    assert found[clear] == pytest.approx(attitudes.as_rotvec()[clear], abs=1e-12)
    angles = np.linspace(0.0, 6.0, 601)
    turning = Rotation.from_rotvec(angles[:, None] * [0.0, 0.0, 1.0]).as_quat(scalar_first=True)
    assert np.flatnonzero(np.isnan(with_gaps(rotation_vectors(turning))[:, 2])).tolist() == [
        int(np.argmax(angles > np.pi))
    ]


def test_a_portrait_shows_where_a_run_comes_from_and_another_what_is_left_of_it():
    found = run(law="sliding_mode", initial_error=0.3, duration=2.0)
    panels = run_picture(found, ["title"]).axes
    place = [panel.get_title(loc="left") for panel in panels].index("Phase portrait, z")
    whole, steady = panels[place : place + 2]
    assert whole.get_xlim()[1] > 0.3
    assert whole.lines[-2].get_xdata()[0] == found.error[0, 2]  # the ring
    left = found.error[found.measurement.in_window(found.time), 2]
    assert np.ptp(left) > 0.0
    assert np.ptp(steady.get_xlim()) < 1.2 * np.ptp(np.append(left, 0.0))
    assert not whole.texts + steady.texts
    rate = found.rate_error.copy()
    rate[-3] = 5.0
    steady = run_picture(found.replaced(rate_error=rate), ["title"]).axes[place + 1]
    assert steady.get_ylim()[1] < 1.0
    assert "|ė| = 5 rad/s" in steady.texts[0].get_text()


def test_a_sheet_of_any_width_has_all_panels_and_no_title_over_another(fuzzy):
    names = []
    for width in (NARROWEST, BESIDE):
        made = run_picture(fuzzy, ["title " * 30, "conditions " * 30], width)
        assert made.get_figwidth() == width
        names.append(sorted(panel.get_title(loc="left") for panel in made.axes))
        for panel in made.axes:
            left, right = panel._left_title.get_window_extent(), panel._right_title.get_window_extent()
            assert left.x1 < right.x0 or not right.width
            assert right.x1 < made.bbox.x1
    assert names[0] == names[1]


def test_a_sheet_that_is_too_narrow_is_refused_with_what_fits(wrist):
    run(law="pd").save("a.rrd")
    code, _, err = wrist("inspect", "a.rrd", "--plot", "a.pdf", "--width", "one-column")
    assert (code, Path("a.pdf").exists()) == (2, False)
    assert "wrist plot FILE.rrd" in one_line(err.rstrip())


def test_components_of_an_axis_have_its_colour():
    assert of_components(["x", "y", "z"]) == list(AXES)
    assert of_components(["x 0", "x 1", "z 0"]) == [AXES[0], AXES[0], AXES[2]]
    assert len(set(of_components(["w", "x", "y", "z"]))) == 4
    assert of_components(list(map(str, range(24)))) == []


def test_the_view_of_an_axis_cuts_off_only_what_would_squeeze_the_rest():
    calm = np.linspace(-1.0, 1.0, 1000)
    low, high, cut = view(calm)
    assert (low < -1.0, high > 1.0, cut) == (True, True, False)
    low, high, cut = view(np.append(calm, 50.0))
    assert (1.0 < high < 2.0, cut) == (True, True)
    assert view(np.array([np.nan])) == (-1.0, 1.0, False)
    low, high, cut = view(np.zeros(3))
    assert low < 0.0 < high


def test_figures_are_as_print_has_them():
    assert [figure(value) for value in (None, 0.0, 0.0123, 999.4, 2857.3, 4.676e-4, 1e-7, -2.5e6)] == [
        "—", "0", "0.0123", "999", "2857", "4.68·10⁻⁴", "10⁻⁷", "−2.5·10⁶",
    ]  # fmt: skip


# the sheet of a run


def test_the_sheet_has_what_the_law_has(fuzzy):
    shown = titles(run_picture(fuzzy, ["title", "conditions"]))
    axes = ["Phase portrait, x", "Steady window", "Phase portrait, y", "Phase portrait, z"]
    always = ["Attitude as rotation vector", "Attitude error", "Attitude error, size", "Tip error, size", "Torque"]
    assert list(shown) == [*always, "Sliding surface", "Slope of the surface", *axes]
    assert figure(fuzzy.metrics.rms_error_rad) in shown["Attitude error, size"]
    assert figure(fuzzy.metrics.max_tip_error_mm) in shown["Tip error, size"]
    assert list(titles(run_picture(run(law="pd"), ["pd"]))) == [*always, *axes]
    fixed = titles(run_picture(run(law="sliding_mode"), ["title"]))
    assert "Slope of the surface" not in fixed
    assert "λ = 100 1/s" in fixed["Sliding surface"]
    real = run_picture(run(sensing="realistic", actuation="realistic"), ["title", "conditions"])
    assert {"Sensors: from true to measured attitude", "Motors: delivered − commanded torque"} < set(titles(real))
    real.draw_without_rendering()
    boxes = [panel.get_tightbbox() for panel in real.axes] + [text.get_window_extent() for text in real.texts]
    assert all(real.bbox.containsx(box.x0) and real.bbox.containsx(box.x1) for box in boxes)
    assert not [(a, b) for a, b in combinations(boxes, 2) if a.overlaps(b)]
    assert "wide: commanded" in titles(real)["Torque"]


def test_the_panel_of_the_tip_error_has_the_bound_of_the_run(fuzzy, sheet):
    panel = panel_of(sheet, "Tip error, size")
    (bound,) = {line.get_ydata()[0] for line in panel.lines if line.get_linestyle() == "--"}
    assert bound == fuzzy.measurement.bound == 0.1
    assert "bound 0.1 mm" in panel.get_title(loc="right")
    low, high = panel.get_ylim()
    assert low < bound < high


def test_the_line_of_the_portrait_is_where_the_surface_is_zero():
    found = run(law="sliding_mode", initial_error=(0.05, 0.02, -0.03))
    panel = panel_of(run_picture(found, ["title"]), "Phase portrait, x")
    dashed = next(line for line in panel.lines if line.get_linestyle() == "--")
    e, rate = dashed.get_data()
    assert found.experiment.law.slope * e + rate == pytest.approx(0.0, abs=1e-12)
    layer = panel.collections[0].get_paths()[0].vertices
    values = np.abs(found.experiment.law.slope * layer[:, 0] + layer[:, 1])
    assert values == pytest.approx(found.experiment.law.phi[0])
    integral = titles(run_picture(run(law="boundary_layer_sliding_mode"), ["title"]))
    assert "λαe + ė = 0" in integral["Phase portrait, x"]
    assert "S = 0" in titles(run_picture(found, ["title"]))["Phase portrait, x"]


def test_the_curves_are_those_of_the_run(fuzzy, sheet):
    panel = panel_of(sheet, "Attitude error")
    drawn = {line.get_color(): line for line in panel.lines}
    for colour, values in zip(("#d55e00", "#009e73", "#0072b2"), fuzzy.error.T, strict=True):
        assert (drawn[colour].get_xdata() == fuzzy.time).all()
        assert (drawn[colour].get_ydata() == values).all()


def test_chattering_is_not_smoothed_away():
    found = run(law="fuzzy_sliding_computed_torque", duration=4.0)
    wild = found.torque + np.where(np.arange(len(found)) % 2, 0.03, -0.03)[:, None]
    panel = panel_of(run_picture(found.replaced(torque=wild), ["title"]), "Torque")
    curves = [line.get_ydata() for line in panel.lines if line.get_color() == "#d55e00"]
    assert len(curves[0]) < len(found)
    assert np.abs(np.diff(curves[0])).mean() > 0.03
    assert (curves[0].min(), curves[0].max()) == (wild[:, 0].min(), wild[:, 0].max())


def test_the_svg_of_a_long_run_is_small_well_formed_and_the_same_every_time():
    found = run(law={"name": "sliding_mode", "switching": "sign"}, sensing="realistic")
    again = {name: np.tile(array, (40, 1) if array.ndim == 2 else 40) for name, array in found.channels.items()}
    long = replace(found, channels={**again, "time": 1e-3 * np.arange(40 * len(found))})
    content = picture_content(run_picture(long, ["title"]), Path("a.svg"))
    assert content == picture_content(run_picture(long, ["title"]), Path("b.SVG"))
    assert ET.fromstring(content).tag.endswith("svg")
    assert len(content) < 4e6


@pytest.mark.parametrize("rows", some([3, 1], 2))
def test_a_few_rows_and_a_divergence_can_be_drawn(fuzzy, rows):
    few = replace(fuzzy, channels=fuzzy.rows(slice(0, rows)).channels)
    assert picture_content(run_picture(few, ["title"]), Path("a.svg"))
    lost = few.error.copy()
    lost[-1] = [np.nan, 1e300, np.inf]
    torque = np.full_like(few.torque, np.nan)
    ended = Outcome(Status.DIVERGED, 0.003, "the physics became unstable")
    drawing = run_picture(
        replace(few.replaced(error=lost, attitude=few.attitude * np.nan, torque=torque), outcome=ended), ["title"]
    )
    assert picture_content(drawing, Path("a.png")).startswith(b"\x89PNG")


# differences of runs


def test_settings_differ_by_dotted_name_with_both_values_and_the_unit():
    a = Experiment(law="pd", mass_scale=1.0).model_dump(mode="json")
    b = Experiment(law={"name": "pd", "P": [1, 2, 3]}, payload=0.01, reference="hold").model_dump(mode="json")
    found = {setting.name: setting[1:] for setting in differing_settings(a, b)}
    usual = Experiment(law="pd").law.P
    assert found["law.P"] == ("N·m/rad", list(usual), [1.0, 2.0, 3.0])
    assert found["mass_scale"] == ("", 1.0, 1.25)
    assert found["payload"] == ("kg", 0.0, 0.01)
    assert found["reference.name"] == ("", "lissajous", "hold")
    assert found["reference.amplitude"][0] == "rad"
    assert found["reference.amplitude"][2] is None
    assert next(iter(found)) == "law.P"
    assert differing_settings(a, json.loads(json.dumps(a))) == ()


def test_a_foreign_setting_whose_name_has_dots_is_compared_too():
    found = differing_settings({"a": 1, "law": {"K": 1}}, {"a": 2, "http://x.y/z": 3, "law": {"K": 2}})
    assert [setting.name for setting in found] == ["a", "law.K", "http://x.y/z"]


def test_runs_differ_in_outcome_versions_and_metrics(fuzzy):
    other = run(mass_scale=1.5)
    found = run_difference(fuzzy, other)
    change = found.metrics["rms_error_rad"].change
    assert change == pytest.approx(other.metrics.rms_error_rad / fuzzy.metrics.rms_error_rad - 1.0)
    assert [setting.name for setting in found.settings] == ["mass_scale"]
    assert (found.same, found.versions) == (False, {})
    assert found.series.first.row_a <= 1
    upgraded = replace(fuzzy, versions={**fuzzy.versions, "mujoco": "9"}, wall_time=99.0)
    again = run_difference(fuzzy, upgraded)
    assert again.same
    assert again.versions == {"mujoco": (fuzzy.versions["mujoco"], "9")}
    stopped = replace(fuzzy, outcome=Outcome(Status.INTERRUPTED, 0.4, "stopped on request"))
    assert not run_difference(fuzzy, stopped).same


def test_the_picture_of_a_difference_has_its_sizes(fuzzy):
    torque = fuzzy.torque.copy()
    torque[100:, 2] += 1e-9
    other = fuzzy.replaced(torque=torque)
    drawing = difference_picture(fuzzy, other, difference(fuzzy, other), ("a", "b"))
    (panel,) = drawing.axes
    assert panel.get_ylabel() == "difference [N·m]"
    curve = panel.lines[0]
    assert np.nanmin(curve.get_ydata()) == pytest.approx(1e-9, rel=1e-5)
    assert curve.get_xdata()[~np.isnan(curve.get_ydata())][0] == fuzzy.time[100]
    nothing = difference_picture(fuzzy, fuzzy, difference(fuzzy, fuzzy), ("a", "b"))
    nothing.draw_without_rendering()
    assert nothing.axes[0].texts[0].get_text() == "nothing to draw"


# the commands


def test_inspect_draws_and_exports_what_is_asked_for(wrist, fuzzy):
    record(fuzzy, "a.rrd")
    files = ["a.png", "a.svg", "a.csv", "a.parquet", "a.npz"]
    options = [
        part for file in files for part in ("--plot" if file[2:] in ("png", "svg", "pdf", "pgf") else "--export", file)
    ]
    code, out, err = wrist("inspect", "a.rrd", *options)
    assert (code, err) == (0, "")
    assert all(file in out for file in files)
    assert sorted(path.name for path in Path().iterdir()) == sorted(["a.rrd", *files])
    with Image.open("a.png") as image:
        assert image.width == 2200
    assert pyarrow.parquet.read_table("a.parquet").num_rows == len(fuzzy)
    told = json.loads(wrist("inspect", "a.rrd", "--json", "--export", "b.npz")[1])
    assert (told["plots"], told["exports"]) == ([], ["b.npz"])
    assert "fuzzy_sliding_computed_torque on lissajous" in Path("a.svg").read_text()


@pytest.mark.parametrize("width", [80, 120])
def test_inspect_prints_parameters_with_units_in_whole_lines(wrist, monkeypatch, fuzzy, width):
    monkeypatch.setenv("COLUMNS", str(width))
    record(fuzzy, "a.rrd")
    out = wrist("inspect", "a.rrd")[1]
    assert max(map(len, out.splitlines())) <= width
    for text in ("Kp = 400 1/s²", "K = [0.05, 0.05, 0.03] N·m", "amplitude = 0.004 N·m", "control_period = 0.001 s"):
        assert text in out
    assert f"numba {fuzzy.versions['numba']}" in out


WRONG = [
    ["inspect", "a.rrd", "--plot", "a.jpg"],
    ["inspect", "a.rrd", "--plot", "a"],
    ["inspect", "a.rrd", "--export", "a.xls"],
    ["inspect", "a.rrd", "--export", "none/a.csv"],
    ["inspect", "a.rrd", "--export", "a.csv", "--plot", "none/a.png"],
    ["inspect", "a.rrd", "--plot", "folder.png"],
    ["inspect", "none.rrd", "--plot", "a.png"],
    ["diff", "a.rrd", "none.rrd"],
    ["diff", "a.rrd", "text.rrd"],
    ["diff", "a.rrd"],
    ["diff", "a.rrd", "a.rrd", "--plot", "a.csv"],
    ["diff", "a.rrd", "a.rrd", "--tolerance", "-1"],
    ["diff", "a.rrd", "a.rrd", "--tolerance", "nan"],
    ["diff", "a.rrd", "a.rrd", "--tolerance", "some"],
]


@pytest.mark.parametrize("arguments", WRONG, ids=" ".join)
def test_wrong_input_is_one_line_and_nothing_is_written(wrist, fuzzy, arguments):
    record(fuzzy, "a.rrd")
    Path("folder.png").mkdir()
    Path("text.rrd").write_text("no recording")
    code, out, err = wrist(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith("wrist: error: ")
    assert err.count("\n") == 1
    assert sorted(path.name for path in Path().iterdir()) == ["a.rrd", "folder.png", "text.rrd"]


def test_a_recording_that_contradicts_itself_gives_no_picture(wrist, fuzzy):
    record(
        replace(
            fuzzy, metrics=Metrics({**fuzzy.metrics.available, "rms_error_rad": 1.0}), _experiment=fuzzy.experiment
        ),
        "a.rrd",
    )
    code, _, err = wrist("inspect", "a.rrd", "--plot", "a.png", "--export", "a.csv")
    assert code == 2
    assert "rms_error_rad" in err
    assert [path.name for path in Path().iterdir()] == ["a.rrd"]


def test_diff_says_the_same_where_only_wall_time_and_thinning_differ(wrist, fuzzy):
    record(fuzzy, "a.rrd")
    record(run(record_every=9), "b.rrd")
    assert load_recording("a.rrd").wall_time != load_recording("b.rrd").wall_time
    code, out, err = wrist("diff", "a.rrd", "b.rrd")
    assert (code, err) == (0, "")
    assert "the same experiment with the same series, bit for bit" in out
    assert f"compared: {len(range(0, 400, 9))} instants" in out
    told = json.loads(wrist("diff", "a.rrd", "b.rrd", "--json")[1])
    assert (told["same"], told["experiment"], told["series"]["record_every"]) == (True, {}, {"a": 1, "b": 9})


def test_diff_says_where_runs_part(wrist, fuzzy):
    other = run(mass_scale=1.5, duration=0.3)
    record(fuzzy, "a.rrd")
    record(other, "b.rrd")
    code, out, _ = wrist("diff", "a.rrd", "b.rrd", "--plot", "d.png", "--plot", "d.svg")
    assert code == 1
    for text in ("mass_scale", "1.25", "1.5", "duration", "torque", "N·m", "one goes on"):
        assert text in out
    assert Path("d.png").stat().st_size > 10_000
    code, out, _ = wrist("diff", "a.rrd", "b.rrd", "--json")
    told = json.loads(out)
    assert (code, told["same"]) == (1, False)
    assert told["experiment"]["mass_scale"] == {"unit": "", "a": 1.25, "b": 1.5}
    torque = told["series"]["arrays"]["torque"]
    sizes = np.linalg.norm(fuzzy.torque[:300] - other.torque, axis=1)
    assert torque["largest"] == pytest.approx(sizes.max(), rel=1e-12)
    assert torque["largest_at"]["row_a"] == sizes.argmax()
    assert torque["first"]["row_b"] == np.flatnonzero(sizes)[0]
    assert told["series"]["one_goes_on"]


def test_a_tolerance_makes_small_differences_none(wrist, fuzzy):
    record(fuzzy, "a.rrd")
    rate = fuzzy.rate.copy()
    rate[7, 1] += 1e-7
    record(fuzzy.replaced(rate=rate), "b.rrd")
    assert wrist("diff", "a.rrd", "b.rrd")[0] == 1
    assert wrist("diff", "a.rrd", "b.rrd", "--tolerance", "1e-8")[0] == 1
    code, out, _ = wrist("diff", "a.rrd", "b.rrd", "--tolerance", "1e-6")
    assert code == 0
    assert "within 1e-06 of each unit" in out
