"""The report on a rule base, and its picture."""

import ast
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.text import Text

import spherical_wrist.fuzzy
from rigs import one_line
from sampling import some
from spherical_wrist.control import FuzzySlidingComputedTorque
from spherical_wrist.errors import ParameterError
from spherical_wrist.fuzzy import Linear, Mamdani, Rule, RuleBase, Sugeno, Triangular, Variable, report
from spherical_wrist.fuzzy.picture import picture

VALUES = ("N", "Z", "P")
Y = Variable.even("y", VALUES)
HOLED = Variable(
    "x", -1, 1,
    {
        "N": Triangular(left=-1, peak=-1, right=-0.2),
        "Z": Triangular(left=-0.5, peak=0, right=0.1),
        "P": Triangular(left=0.3, peak=1, right=1),
    },
)  # fmt: skip
WITH_GAP = Sugeno(RuleBase.table(HOLED, Y, [[1.0, 2.0, 1.0], [3.0, 4.0, 3.0], [1.0, 0.5, 1.0]]))
SINGLE = RuleBase((HOLED,), (Rule(HOLED.is_("N"), 1.0), Rule(HOLED.is_("Z") | HOLED.is_("P"), 2.0)))


def of(*values):
    """One input with triangles at −1, −½, 0, ½, 1 and these rule weights there: α is linear between them."""
    x = Variable.even("x", ("A", "B", "C", "D", "E"))
    return Sugeno(RuleBase((x,), tuple(Rule(x.is_(v), w) for v, w in zip("ABCDE", values, strict=True))))


# --- the report


def test_a_gap_is_found_where_it_is():
    """No set holds above 0.01 from 0.1 − 0.001 to 0.3 + 0.007: 0.208 of 2 in x, whatever y (max over y's sets ≥ ½)."""
    found = report(WITH_GAP, points=1001, threshold=0.01)
    columns = found.first[found.gaps.any(axis=1)]
    assert found.gap_share == pytest.approx(0.104, abs=0.001)
    assert columns.min() == pytest.approx(0.099, abs=0.0021)
    assert columns.max() == pytest.approx(0.307, abs=0.0021)
    assert not found.positive
    assert found.lowest > 0.0
    assert "Gaps: no rule fires above 0.01 on 10.4 %" in found.lines()[0]
    assert "without a value elsewhere" in found.lines()[1]


def test_a_rule_left_out_leaves_a_gap():
    """Of 3 × 3 products of triangles the middle one is missing: a hole about the origin, and only there."""
    x = Variable.even("x", VALUES)
    full = RuleBase.table(x, Y, [[1.0] * 3] * 3, "product")
    rules = tuple(rule for rule in full.rules if rule.label != "Z Z")
    found = report(Sugeno(RuleBase((x, Y), rules, "product")), 201, threshold=0.02)
    i, j = np.nonzero(found.gaps)
    assert 0.0 < found.gap_share < 0.01
    assert max(np.abs(found.first[i]).max(), np.abs(found.second[j]).max()) < 0.03
    assert report(Sugeno(full), 201).gap_share == 0.0


@pytest.mark.parametrize(
    ("weights", "positive", "right", "left"),
    [
        ((1, 2, 4, 2, 1), True, "falls", "falls"),
        ((1, 2, 4, 5, 6), True, "rises", "falls"),
        ((3, 3, 3, 3, 3), True, "is constant", "is constant"),
        ((1, 5, 4, 2, -1), False, "falls", "rises (by up to 1) and falls (by up to 4)"),
        ((0, 1, 1, 1, 2), False, "rises", "falls"),
        ((4, 2, 1, 3, 2), True, "rises (by up to 2) and falls (by up to 1)", "rises"),
    ],
)
def test_sign_and_monotonicity_on_either_side_of_zero(weights, positive, right, left):
    found = report(of(*weights))
    assert (found.lowest, found.highest) == (pytest.approx(min(weights)), pytest.approx(max(weights)))
    assert found.positive == positive
    assert (found.trend(1), found.trend(-1)) == (right, left)
    assert ("NOT positive" in found.lines()[1]) != positive


def test_a_universe_without_a_side_has_no_trend_on_it():
    x = Variable.even("x", ("A", "B"), low=0.0, high=2.0)
    found = report(Sugeno(RuleBase((x,), (Rule(x.is_("A"), 1.0), Rule(x.is_("B"), 2.0)))))
    assert (found.trend(1), found.trend(-1)) == ("rises", "")
    assert found.lines()[-1] == "α rises as x rises from 0."


def test_further_inputs_are_held():
    """z = v of a third input alone: 0 in its middle, or where it is held."""
    third = Variable.even("v", VALUES)
    x = Variable.even("x", VALUES)
    rules = tuple(Rule(third.is_(value), Linear(0.0, (0.0, 0.0, 1.0))) for value in VALUES)
    inference = Sugeno(RuleBase((x, Y, third), rules))
    assert report(inference, 5).highest == 0.0
    held = report(inference, 5, held={"v": 0.5})
    assert (held.lowest, held.highest) == (0.5, 0.5)
    assert "Held: v = 0.5." in held.lines()
    picture(inference, held={"v": 0.5}, points=11)
    with pytest.raises(ParameterError) as caught:
        report(inference, held={"x": 0.5})
    assert "valid: v" in one_line(caught.value)


def test_too_few_points_are_refused():
    with pytest.raises(ParameterError, match="at least 3"):
        report(WITH_GAP, points=2)


# --- the picture

FAR = Variable("x", -1, 1, {"far": Triangular(left=2, peak=3, right=4)})
OUTPUT = Variable.even("z", ("S", "L"), low=0.0, high=2.0)
PICTURED = {
    "law": FuzzySlidingComputedTorque().tuner.system(),
    "mamdani": FuzzySlidingComputedTorque(inference="mamdani").tuner.system(),
    "first order": FuzzySlidingComputedTorque(inference="sugeno_first_order").tuner.system(),
    "gap": WITH_GAP,
    "negative": Sugeno(RuleBase.table(HOLED, Y, [[1.0, 2.0, 1.0], [3.0, 4.0, 3.0], [-1.0, 0.5, 1.0]])),
    "constant": Sugeno(RuleBase.table(HOLED, Y, [[2.0] * 3] * 3)),
    "one input": Sugeno(SINGLE),
    "never": Mamdani(RuleBase.table(FAR, Y, [["S"] * 3]), OUTPUT),
}


@pytest.mark.parametrize("inference", some(PICTURED.values(), 3), ids=some(PICTURED, 3))
def test_any_rule_base_is_drawn_and_saved(inference, tmp_path):
    drawn = picture(inference, tmp_path / "rules.svg", title="Rules", points=41)
    assert drawn.report.inference is inference
    assert (tmp_path / "rules.svg").read_bytes().startswith(b"<?xml")


@pytest.mark.parametrize(("ending", "start"), [("png", b"\x89PNG"), ("pdf", b"%PDF")])
def test_a_picture_is_saved_in_the_format_of_its_name(ending, start, tmp_path):
    path = tmp_path / f"rules.{ending}"
    picture(WITH_GAP, path, points=41)
    assert path.read_bytes().startswith(start)


def test_the_same_rule_base_makes_the_same_file(tmp_path):
    files = [tmp_path / name for name in ("a.svg", "b.SVG")]  # also in capitals it is the same format
    for file in files:
        picture(WITH_GAP, file, points=41)
    assert files[0].read_bytes() == files[1].read_bytes()
    assert files[1].read_bytes().startswith(b"<?xml")


@pytest.fixture(scope="module")
def of_the_law():
    return picture(PICTURED["law"], points=41)


def test_the_picture_shows_sets_surface_slices_and_findings(of_the_law):
    drawn = of_the_law
    axes = drawn.figure.findobj(lambda artist: hasattr(artist, "get_xlabel"))
    labels = {panel.get_xlabel() for panel in axes}
    assert {"e / error_scale", "ė / rate_scale", "α"} <= labels
    texts = {text.get_text() for text in drawn.figure.findobj(Text)}
    assert {"NB", "NM", "NS", "Z", "PS", "PM", "PB", "N", "P", "α(e, ė)", "\n".join(drawn.report.lines())} <= texts
    curve = next(line for panel in axes for line in panel.get_lines() if line.get_label() == "ė = 0")
    np.testing.assert_allclose(curve.get_ydata(), PICTURED["law"](curve.get_xdata(), 0.0))


@pytest.mark.parametrize(("name", "said"), [("gap", "hatched: no rule fires"), ("negative", "red: not positive")])
def test_gaps_and_signs_are_marked(of_the_law, name, said):
    def titles(figure):
        return " ".join(panel.get_title() for panel in figure.findobj(lambda artist: hasattr(artist, "get_xlabel")))

    assert said in titles(picture(PICTURED[name], points=41).figure)
    assert said not in titles(of_the_law.figure)


@pytest.mark.parametrize(
    ("path", "advice"),
    [("rules.bmp", ".png, .svg or .pdf"), ("rules", ".png, .svg or .pdf"), ("no/such/folder/rules.png", "create it")],
)
def test_a_path_that_cannot_be_drawn_to_is_refused_in_one_line(path, advice, tmp_path):
    with pytest.raises(ParameterError) as caught:
        picture(WITH_GAP, tmp_path / path)
    assert advice in one_line(caught.value)


def test_matplotlib_is_imported_in_one_file_only_when_drawing():
    for path in Path(spherical_wrist.fuzzy.__file__).parent.glob("*.py"):
        names = {
            (node.module if isinstance(node, ast.ImportFrom) else node.names[0].name).split(".")[0]
            for node in ast.walk(ast.parse(path.read_text()))
            if isinstance(node, ast.Import | ast.ImportFrom)
        }
        assert ("matplotlib" in names) == (path.name == "picture.py")
    code = "import sys, spherical_wrist.control, spherical_wrist.fuzzy.picture; assert 'matplotlib' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
