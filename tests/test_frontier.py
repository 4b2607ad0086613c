"""Frontiers: the search for a first miss, known crossings of real systems, and what `wrist frontier` prints."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.image import imread
from scipy.optimize import brentq, fsolve
from scipy.spatial.transform import Rotation

from rigs import RigidBody, one_line
from spherical_wrist import Experiment, simulate
from spherical_wrist.comparison.bounds import BOUNDS, Miss, find_miss, read_bounds
from spherical_wrist.comparison.crossing import Crossing, CrossingStatus, first_crossing
from spherical_wrist.comparison.frontier import Edge, frontier
from spherical_wrist.comparison.frontier_picture import frontier_picture
from spherical_wrist.comparison.frontier_report import order, to_dict
from spherical_wrist.comparison.frontier_table import frontier_table
from spherical_wrist.comparison.law_selection import registered
from spherical_wrist.control import ComputedTorque, SlidingComputedTorque
from spherical_wrist.errors import ParameterError, UnknownNameError, WristError
from spherical_wrist.experiment.axes import AXES, chosen_axes
from spherical_wrist.loop.outcome import Outcome, Status
from spherical_wrist.measure.metrics import METRICS, Metrics
from spherical_wrist.picture_style import WIDTHS

# --- the search


@given(st.floats(1e-6, 900.0), st.floats(0.001, 0.3), st.floats(1.1, 10.0))
def test_a_known_crossing_is_found(edge, tolerance, growth):
    found = first_crossing(lambda x: x < edge, 0.01, 1000.0, tolerance, growth)
    assert found.status is CrossingStatus.CROSSING
    assert found.holds < edge <= found.misses
    assert found.misses - found.holds <= tolerance * max(found.misses, 0.01)


@given(st.sets(st.integers(0, 40)), st.floats(1.3, 5.0))
def test_whatever_the_system_no_tested_value_below_the_crossing_missed(bad, growth):
    """Nothing monotonic: the system misses on any of 40 stretches."""

    def holds(x):
        return int(4.0 * x) not in bad

    found = first_crossing(holds, 0.1, 10.0, 0.05, growth)
    if found.status is CrossingStatus.NOMINAL:
        assert 0 in bad
        assert found == Crossing(CrossingStatus.NOMINAL, None, 0.0, (0.0,))
        return
    assert holds(found.holds)
    assert all(holds(x) for x in found.tested if x <= found.holds)
    if found.status is CrossingStatus.CROSSING:
        assert not holds(found.misses)
        assert min(x for x in found.tested if not holds(x)) == found.misses
    else:
        assert found.misses is None
        assert found.holds == 10.0


def test_the_grid_expands_from_the_nominal_to_the_limit_and_no_further():
    never = first_crossing(lambda x: True, 1.0, 10.0, growth=3.0)
    assert never == Crossing(CrossingStatus.NEVER, 10.0, None, (0.0, 1.0, 3.0, 9.0, 10.0))
    island = first_crossing(lambda x: not 2.5 < x < 3.5, 1.0, 10.0, 0.1, growth=3.0)
    assert island.tested[:4] == (0.0, 1.0, 3.0, 2.0)  # the first miss, though all is well at 9 and 10
    assert island.misses == pytest.approx(2.5, rel=0.11)


@pytest.mark.parametrize("wrong", [(0.0, 1.0), (2.0, 1.0), (1.0, 2.0, 0.0), (1.0, 2.0, 1.0), (1.0, 2.0, 0.1, 1.0)])
def test_a_search_without_sense_is_one_line(wrong):
    with pytest.raises(ParameterError) as error:
        first_crossing(lambda x: True, *wrong)
    assert "growth > 1" in one_line(error.value)


# --- systems whose crossings are known


def tip(bound):
    return {"max_tip_error_mm": bound}


TILT = (0.3, 0.2, 0.0)
HOLD = {"reference": {"name": "hold", "rotation": TILT}, "duration": 2.5, "model": None}


def resting_error(nominal, gap, gains):
    """Attitude error [rad] of computed torque at rest, where H Kp e makes up for the torque that its model lacks.

    Args:
        nominal: the wrist.
        gap: that torque [N·m], of the attitude.
        gains: Kp.
    """
    body = RigidBody.of(nominal)
    desired = Rotation.from_rotvec(TILT)

    def balance(e):
        actual = desired * Rotation.from_rotvec(e).inv()
        return body.inertia @ (gains * e) - gap(body, actual.as_quat(scalar_first=True))

    return fsolve(balance, np.zeros(3), xtol=1e-10)


def resting_tip_error(nominal, gap):
    """The same as an error of the tip [mm], with the law's own gains."""
    e = resting_error(nominal, gap, np.array(ComputedTorque().Kp))
    return 1000.0 * np.linalg.norm(Rotation.from_rotvec(e).apply(nominal.lever) - nominal.lever)


def lacking_mass(value):
    return lambda body, attitude: (value - 1.0) * body.gravity(attitude)


def lacking_shift(value):
    def gap(body, attitude):
        down = Rotation.from_quat(attitude, scalar_first=True).inv().apply([0.0, 0.0, -9.81])
        return -np.cross(body.mass * np.array([value, 0.0, 0.0]), down)

    return gap


def lacking_disturbance(value):
    def gap(body, attitude):
        peak = np.abs(body.gravity(Rotation.from_rotvec(TILT).as_quat(scalar_first=True))).max()
        return -value * peak * np.ones(3)

    return gap


def lacking_payload(value):
    """A point mass at the tip; its lever is that of the wrist of the package."""
    lever = Experiment().nominal().lever

    def gap(body, attitude):
        down = Rotation.from_quat(attitude, scalar_first=True).inv().apply([0.0, 0.0, -9.81])
        return -np.cross(value * lever, down)

    return gap


@pytest.mark.parametrize(
    ("axis", "lacking", "far"),
    [
        ("heavier", lacking_mass, 2.0),
        ("lighter", lacking_mass, 0.8),
        ("com", lacking_shift, 0.01),
        ("payload", lacking_payload, 0.005),
        ("disturbance", lacking_disturbance, 1.0),
    ],
)
def test_the_crossing_of_computed_torque_at_rest_is_that_of_statics(nominal, axis, lacking, far):
    (axis,) = chosen_axes([axis])
    bound = 0.5
    expected = brentq(lambda value: resting_tip_error(nominal, lacking(value)) - bound, axis.base, far)
    (edge,) = frontier({"ct": ComputedTorque()}, [axis], HOLD, {}, bounds=tip(bound), tolerance=0.005)
    assert edge.crossing.status is CrossingStatus.CROSSING
    assert axis.deviation(edge.misses) == pytest.approx(axis.deviation(expected), rel=0.006, abs=0.006 * axis.first)
    assert axis.deviation(edge.holds) < axis.deviation(edge.misses)
    assert (edge.miss.metric, edge.miss.value) == ("max_tip_error_mm", pytest.approx(bound, rel=0.01))


def test_a_wrist_that_turns_about_its_tool_misses_by_attitude(nominal):
    """Stiff across the tool and soft about it: the tip stays, which alone hides that the wrist has turned."""
    laws, axes = {"soft": ComputedTorque(Kp=(1e4, 1e4, 400.0), Kv=(200.0, 200.0, 40.0))}, chosen_axes(["disturbance"])

    def turned(value):
        return np.linalg.norm(resting_error(nominal, lacking_disturbance(value), laws["soft"].Kp)) - 0.01

    (edge,) = frontier(laws, axes, HOLD, {}, tolerance=0.005)
    assert edge.misses == pytest.approx(brentq(turned, 0.0, 0.2), rel=0.006, abs=0.006 * axes[0].first)
    assert edge.miss.metric == "max_error_rad"
    assert edge.miss.reason == f"attitude error, largest {edge.miss.value:.4g} rad > 0.01 rad"
    (by_tip,) = frontier(laws, axes, HOLD, {}, bounds=tip(0.1), tolerance=0.1)
    assert by_tip.misses > 1.3 * edge.misses


SHORT = {"duration": 0.6}


@pytest.fixture(scope="module")
def edges():
    laws = {"ct": ComputedTorque(), "sliding": SlidingComputedTorque()}
    return frontier(laws, chosen_axes(), {}, SHORT, bounds=tip(0.2), tolerance=0.5, jobs=2)


def test_the_bound_is_held_before_and_missed_at_the_crossing_on_every_axis(edges):
    """Each axis does to the wrist what it says: built here from its own names."""
    build = {
        "heavier": lambda v: {"mass_scale": v},
        "lighter": lambda v: {"mass_scale": v},
        "com": lambda v: {"com_shift": (v, 0.0, 0.0)},
        "payload": lambda v: {"payload": v},
        "friction": lambda v: {"friction": v},
        "disturbance": lambda v: {"disturbance": {"level": v}},
        "frequency": lambda v: {"disturbance": {"name": "sinusoid", "frequency": v, "level": 0.25} if v else 0.25},
        "delay": lambda v: {"sensing": {"delay": v}},
        "unknown_delay": lambda v: {"sensing": {"delay": v, "timestamped": False}},
        "lag": lambda v: {"actuation": {"lag": v}},
        "noise": lambda v: {"sensing": {"attitude_noise": v}},
    }
    assert set(build) == set(AXES)
    assert [(edge.law, edge.axis.name) for edge in edges] == [(law, axis) for law in ("ct", "sliding") for axis in AXES]
    assert {edge.crossing.status for edge in edges} >= {CrossingStatus.CROSSING, CrossingStatus.NOMINAL}
    for edge in edges:
        perfect = {"mass_scale": 1.0, "disturbance": 0.0, **SHORT}
        law = {"sliding": "sliding_computed_torque", "ct": "computed_torque"}[edge.law]

        def run(value):
            return simulate(Experiment(**{**perfect, **build[edge.axis.name](value), "law": law}))  # noqa: B023

        if edge.holds is not None:
            held = run(edge.holds)
            assert held.outcome.status == "completed"
            assert held.metrics.max_tip_error_mm <= 0.2
        if edge.misses is not None:
            missed = run(edge.misses)
            assert edge.experiment == missed.experiment
            assert edge.miss == find_miss(missed.outcome, missed.metrics, tip(0.2))
            assert edge.miss.metric is None or edge.miss.value > 0.2


@pytest.mark.parametrize("axis", chosen_axes(), ids=lambda axis: axis.name)
def test_values_go_from_the_base_to_the_limit(axis):
    assert axis.value(0.0) == axis.base
    assert axis.value(axis.span) == axis.limit
    assert 0.0 < axis.first < axis.span
    assert axis.deviation(axis.value(axis.first)) == pytest.approx(axis.first, rel=1e-4)  # six digits are kept
    values = [axis.value(deviation) for deviation in np.linspace(0.0, axis.span, 9)]
    assert values == sorted(values, reverse=axis.limit < axis.base)


def test_the_frequency_is_that_of_the_disturbance_of_the_experiment():
    [axis] = chosen_axes(["frequency"])
    square = Experiment(disturbance={"name": "square", "amplitude": 0.003, "phase": 1.0})
    assert axis.change(square, 7.0).disturbance == square.disturbance.replaced(frequency=7.0)
    constant = axis.change(square, 0.0).disturbance
    assert (constant.name, constant.amplitude) == ("constant", 0.003)
    assert axis.change(Experiment(disturbance=0.1), 7.0) == Experiment(
        disturbance={"name": "sinusoid", "level": 0.1, "frequency": 7.0}
    )


def test_no_frequency_beyond_what_the_control_period_shows_is_tested():
    slow = {"control_period": 0.02, "duration": 2.4}
    (edge,) = frontier({"ct": ComputedTorque()}, chosen_axes(["frequency"]), {}, slow, bounds=tip(1e9), tolerance=0.3)
    assert (edge.crossing.status, edge.holds) == (CrossingStatus.NEVER, 20.0)  # of a rate of 50 Hz


# --- bounds


def test_a_miss_is_the_bound_that_is_exceeded_the_most():
    figures = Metrics({"max_tip_error_mm": 0.3, "max_error_rad": 0.02, "reaching_time_s": None})
    done = Outcome(Status.COMPLETED, 1.0)
    assert find_miss(done, figures, {"max_tip_error_mm": 0.3, "max_error_rad": 0.02}) is None
    found = find_miss(done, figures, {"max_tip_error_mm": 0.1, "max_error_rad": 0.005})
    assert found == Miss("max_error_rad", 0.02, "attitude error, largest 0.02 rad > 0.005 rad")
    found = find_miss(done, figures, {"max_tip_error_mm": 0.1, "reaching_time_s": 9.0})
    assert found == Miss("reaching_time_s", None, "surface reached at without a value > 9 s")
    lost = Outcome(Status.DIVERGED, 0.5, "the rate is 1e9 rad/s")
    assert find_miss(lost, figures, {"max_tip_error_mm": 1.0}) == Miss(None, None, str(lost))


def test_bounds_are_read_over_the_usual_ones():
    assert read_bounds([], BOUNDS) == BOUNDS
    assert read_bounds(["max_error_rad = none", "rms_error_rad=1e-3", "max_tip_error_mm=0.2"], BOUNDS) == {
        "max_tip_error_mm": 0.2,
        "rms_error_rad": 1e-3,
    }
    for texts, said in (
        (["max_tip_error=1"], "did you mean 'max_tip_error_mm'"),
        (["max_tip_error_mm"], "METRIC=VALUE"),
        (["max_tip_error_mm=-1"], "greater than 0"),
        (["max_tip_error_mm=0.1mm"], "greater than 0"),
        (["max_error_rad=none", "max_tip_error_mm=none"], "a bound is needed"),
    ):
        with pytest.raises(ParameterError) as error:
            read_bounds(texts, BOUNDS)
        assert said in one_line(error.value)


def test_the_number_of_threads_changes_no_bit(edges):
    some = chosen_axes(["lighter", "frequency", "noise"])
    again = frontier({"ct": ComputedTorque()}, some, {}, SHORT, bounds=tip(0.2), tolerance=0.5, jobs=1)
    before = [edge for edge in edges if edge.law == "ct" and edge.axis in some]
    assert [edge[:-1] for edge in again] == [edge[:-1] for edge in before]  # the last one has a time that was measured


def test_a_run_that_diverges_is_a_miss_and_the_experiment_comes_first():
    laws, mass = {"ct": ComputedTorque()}, chosen_axes(["heavier"])
    (edge,) = frontier(laws, mass, {"disturbance": {"amplitude": 50.0}, "duration": 2.2}, {}, bounds=tip(1e9))
    assert edge.crossing.status is CrossingStatus.NOMINAL
    assert edge.misses == 1.0
    assert edge.experiment.disturbance.amplitude == 50.0
    assert edge.miss.metric is None
    assert edge.miss.reason.startswith("diverged at ")
    (edge,) = frontier(laws, mass, {"duration": 2.2}, {"mass_scale": 3.0, "payload": 0.01}, bounds=tip(1e9))
    assert edge.crossing.status is CrossingStatus.NEVER  # the axis takes the place of what the experiment says of it
    assert edge.experiment.mass_scale == 10.0
    assert edge.experiment.payload == 0.01
    assert edge.experiment.disturbance.level == 0.0


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"bounds": tip(0.0)}, "bound"),
        ({"bounds": {"copper_loss_W": 1.0}}, "spherical motors"),
        ({"tolerance": 2.0}, "tolerance"),
        ({"jobs": 0}, "jobs"),
    ],
)
def test_a_frontier_without_sense_is_one_line(options, said):
    with pytest.raises(WristError) as error:
        frontier({"ct": ComputedTorque()}, chosen_axes(), {}, {"duration": 2.2}, **options)
    assert said in one_line(error.value)
    with pytest.raises(UnknownNameError, match="did you mean 'delay'"):
        chosen_axes(["dely"])
    with pytest.raises(WristError) as error:
        frontier({"ct": ComputedTorque()}, chosen_axes(), {"sensing": {"dely": 1.0}}, {})
    one_line(error.value)


# --- the report

MASS, COM = chosen_axes(["heavier", "com"])


def edge(law, axis, found, misses=None):
    miss = None if misses is None else Miss("max_error_rad", 0.02, "attitude error, largest 0.02 rad > 0.01 rad")
    return Edge(law, axis, Crossing(found, 0.0, misses, (0.0,)), Experiment(), miss)


def test_laws_are_ordered_by_their_mean_rank():
    """Ranks by hand: a is 1 and 2, b is 2 and 1 … and the one that misses at once is last."""
    crossing, never, nominal = CrossingStatus.CROSSING, CrossingStatus.NEVER, CrossingStatus.NOMINAL
    found = [
        edge("c", MASS, nominal, 0.0), edge("c", COM, nominal, 0.0),
        edge("a", MASS, never), edge("a", COM, crossing, 0.01),
        edge("b", MASS, crossing, 0.5), edge("b", COM, crossing, 0.009),
        edge("d", MASS, crossing, 0.4), edge("d", COM, crossing, 0.02),
    ]  # fmt: skip
    assert order(found, dict.fromkeys("cabd"), (MASS, COM)) == ["a", "d", "b", "c"]


def table():
    found = [
        edge("a_law", MASS, CrossingStatus.NEVER), edge("a_law", COM, CrossingStatus.CROSSING, 0.01),
        edge("b_law", MASS, CrossingStatus.CROSSING, 0.5), edge("b_law", COM, CrossingStatus.NOMINAL, 0.0),
    ]  # fmt: skip
    return to_dict(found, {"a_law": ComputedTorque(), "b_law": ComputedTorque()}, (MASS, COM), BOUNDS, 0.02, 1.0)


@pytest.mark.parametrize("width", WIDTHS.values())
def test_rows_of_the_picture_end_at_the_crossings_in_one_order_of_laws(width):
    made = frontier_picture(table(), (MASS, COM), width)
    mass, com = made.axes
    names = [law["law"] for law in table()["laws"]]
    assert [label.get_text() for label in mass.get_yticklabels()] == names == ["a_law", "b_law"]
    assert mass.get_title() == f"{MASS.name} [×]"
    assert mass.get_xlim()[0] == MASS.base == 1.0
    by_tip, by_attitude = table()["laws"][1]["edges"][MASS.name]["by"], table()["laws"][0]["edges"]["com"]["by"]
    of_bounds = dict(zip(table()["bounds"], "os", strict=True))
    ends = ((mass, [10.0, 1.5], [">", of_bounds[by_tip]]), (com, [10.0, None], [of_bounds[by_attitude], "x"]))
    for panel, values, markers in ends:
        stems, marks = panel.lines[::2], panel.lines[1::2]
        assert [mark.get_marker() for mark in marks] == markers
        places = [mark.get_ydata()[0] for mark in marks]
        assert places == sorted(places)
        for stem, mark, end in zip(stems, marks, values, strict=True):
            assert mark.get_xdata()[0] == stem.get_xdata()[-1] == pytest.approx(end or panel.get_xlim()[0])
    meanings = {text.get_text() for text in made.legends[0].get_texts()}
    assert {"no miss up to here", "the nominal wrist misses"} < meanings


def test_one_column_with_every_law_and_axis_fits_a_page_and_says_which_row_is_which():
    laws, axes = registered(), chosen_axes()
    found = [edge(law, axis, CrossingStatus.NEVER) for law in laws for axis in axes]
    shown = to_dict(found, laws, axes, BOUNDS, 0.02, 1.0)
    made = frontier_picture(shown, axes, WIDTHS["one-column"])
    assert made.get_figheight() < 9.5  # of the text on a page of letter paper
    names = [law["law"] for law in shown["laws"]]
    numbers = [label.get_text() for label in made.axes[0].get_yticklabels()]
    assert [text.get_text().split() for text in made.texts] == [list(pair) for pair in zip(numbers, names, strict=True)]
    right = max(text.get_window_extent().x1 for text in made.texts)
    assert right < made.bbox.x1


def test_the_table_for_a_paper():
    found = frontier_table(table(), (MASS, COM))
    assert [column.label for column in found.columns] == ["law", f"{MASS.name} [×]", "com [mm]"]
    assert found.rows == [["a_law", "> 10", 10.0], ["b_law", 1.5, "nominal"]]
    assert found.best == {(0, 1), (0, 2)}


# --- the command line

COARSE = ["--tolerance", "0.9", "--max", "max_tip_error_mm=1"]
QUICK = ["--law", "pd", "--law", "sliding_computed_torque", "--axis", "lighter", "--axis", "noise", "--duration", "0.6"]


def test_json_has_the_promised_keys_and_its_commands_replay_the_miss(wrist):
    code, out, err = wrist(
        "frontier", *QUICK, "--max", "max_tip_error_mm=0.2", "--tolerance", "0.1", "--json", "-o", "out"
    )
    given = json.loads(out)
    assert (code, err) == (0, "")
    assert set(given) == {"bounds", "tolerance", "axes", "laws", "warnings", "versions", "files", "wall_time_s"}
    assert (given["bounds"], given["tolerance"]) == ({"max_tip_error_mm": 0.2, "max_error_rad": 0.01}, 0.1)
    assert [axis["axis"] for axis in given["axes"]] == ["lighter", "noise"]
    sliding, pd = given["laws"]
    assert [sliding["law"], pd["law"]] == ["sliding_computed_torque", "pd"]
    assert {edge["found"] for edge in pd["edges"].values()} == {"misses already at the nominal"}
    assert {edge["by"] for edge in pd["edges"].values()} <= set(given["bounds"])
    for axis in given["axes"]:
        edge = sliding["edges"][axis["axis"]]
        assert edge["found"] == "crossing"
        assert abs(edge["holds"] - axis["base"]) < abs(edge["misses"] - axis["base"])
        code, out, _ = wrist(*shlex.split(edge["command"])[1:], "--no-recording", "--json")
        value = json.loads(out)["metrics"][edge["by"]]
        assert value > given["bounds"][edge["by"]]
        assert f"{value:.4g} {METRICS[edge['by']].unit} > " in edge["reason"]
    assert json.loads(Path("out/frontier.json").read_text()) == given
    assert {path.name for path in Path("out").iterdir()} == {
        f"frontier.{end}" for end in ("json", "md", "pdf", "png", "svg", "tex")
    }
    assert imread("out/frontier.png").ndim == 3


@pytest.mark.parametrize("width", [80, 120])
def test_the_table_fits_the_terminal(wrist, monkeypatch, width):
    monkeypatch.setenv("COLUMNS", str(width))
    long = "adaptive_fuzzy_sliding_computed_torque Kp=400"
    code, out, _ = wrist(
        "frontier", "--law", long, *QUICK[4:], "--law", "pd", "--tolerance", "0.9", "--max", "max_tip_error_mm=1"
    )
    assert code == 0
    assert all(len(line) <= width for line in out.splitlines())
    assert "nominal" in out
    assert "[mrad]" in out
    assert "…" not in "".join(line[45:] for line in out.splitlines())


def test_the_law_that_holds_furthest_stands_out(wrist, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "120")
    _, out, _ = wrist(
        "frontier", *QUICK, "--law", "computed_torque", "--tolerance", "0.9", "--max", "max_tip_error_mm=1"
    )
    rows = [line for line in out.splitlines() if line.lstrip("\x1b[0m").startswith(("pd", "computed", "sliding"))]
    assert len(rows) == 3
    assert [row.count("\x1b[1;32m") for row in rows if "sliding" in row] == [1]
    assert sum(row.count("\x1b[1;32m") for row in rows) == 2


WRONG = [
    ["--law", "computed_tork"],
    ["--axis", "mass"],
    ["--max", "max_tip_error_mm=0"],
    ["--max", "max_tip_error_mm=nan"],
    ["--max", "tip=0.1"],
    ["--tolerance", "1"],
    ["--set", "mas_scale=1"],
    ["--set", "law.K=1", "--law", "pd"],
    ["--duration", "-1"],
    ["--jobs", "0"],
    ["-o", "e.toml"],
    ["none.toml"],
]


@pytest.mark.parametrize("arguments", WRONG, ids=" ".join)
def test_wrong_input_is_one_line_exit_code_2_and_writes_nothing(wrist, arguments):
    Path("e.toml").write_text("mass_scale = 1\n")
    code, out, err = wrist("frontier", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("wrist: error: ")
    assert err.count("\n") == 1
    assert [path.name for path in Path().iterdir()] == ["e.toml"]


def test_ctrl_c_ends_with_its_exit_code_and_writes_nothing(wrist, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("spherical_wrist.simulation.runner.as_completed", interrupted)
    code, out, err = wrist("frontier", *QUICK, "--duration", "3600", "-o", "out")
    assert (code, out, err) == (130, "", "")
    assert not list(Path("out").iterdir())


def test_help_names_every_axis_and_the_usual_bounds(wrist):
    _, out, _ = wrist("frontier", "--help")
    text = " ".join(out.split())
    assert f"{', '.join(AXES)}; may be" in text
    assert " and ".join(f"{name}={bound:g}" for name, bound in BOUNDS.items()) in text


def test_the_guide_has_every_axis(wrist):
    _, out, _ = wrist("guide", "hardware")
    assert [name for name in AXES if name not in out] == []
