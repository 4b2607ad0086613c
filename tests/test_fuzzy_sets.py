"""Fuzzy sets, linguistic variables and rules, eq. (26)–(28): closed forms, scikit-fuzzy, cases worked by hand."""

import numpy as np
import pytest
import skfuzzy
from hypothesis import given
from hypothesis import strategies as st

from rigs import one_line
from spherical_wrist.errors import ParameterError, UnknownNameError
from spherical_wrist.fuzzy import (
    ERROR_VALUES,
    RATE_VALUES,
    Bell,
    Gaussian,
    Is,
    Linear,
    Rule,
    RuleBase,
    Trapezoidal,
    Triangular,
    Variable,
    around,
)

SHAPES = ("triangular", "trapezoidal", "bell", "gaussian")
anything = st.one_of(st.floats(-3.0, 3.0), st.floats(-1e300, 1e300), st.sampled_from([-np.inf, np.inf, 0.0, 5e-324]))
corners = st.lists(st.floats(-2.0, 2.0), min_size=4, max_size=4).map(sorted).filter(lambda c: c[1] - c[0] > 1e-6)
widths = st.floats(0.01, 3.0)
GRID = np.linspace(-3.0, 3.0, 1201)


# --- membership functions, eq. (26)


@given(corners)
def test_triangles_and_trapezoids_of_equation_26_are_those_of_scikit_fuzzy(corner):
    a, b, c, d = corner
    np.testing.assert_allclose(
        Trapezoidal(left=a, first=b, last=c, right=d)(GRID), skfuzzy.trapmf(GRID, [a, b, c, d]), atol=1e-12
    )
    np.testing.assert_allclose(Triangular(left=a, peak=b, right=d)(GRID), skfuzzy.trimf(GRID, [a, b, d]), atol=1e-12)


@given(st.floats(-2.0, 2.0), widths, st.floats(0.5, 5.0))
def test_bells_and_gaussians_of_equation_26_are_those_of_scikit_fuzzy(centre, width, steepness):
    bell = Bell(centre=centre, width=width, steepness=steepness)
    np.testing.assert_allclose(bell(GRID), skfuzzy.gbellmf(GRID, width, steepness, centre), rtol=1e-10)
    np.testing.assert_allclose(
        Gaussian(centre=centre, deviation=width)(GRID), skfuzzy.gaussmf(GRID, centre, width), rtol=1e-10, atol=1e-300
    )


def test_membership_functions_worked_by_hand():
    """Triangle 1, 2, 4: half-way up 1.5 → 1/2; half-way down 3 → 1/2; 3.5 → 1/4.

    Trapezoid 0, 1, 2, 4: 3 → 1/2. Bell of width 2 and steepness 1 about 1: 1 / (1 + (2/2)²) = 1/2 at 3 and 1 / (1 + 4)
    at 5. Gaussian of deviation 1/2 about 0: exp(−½) at 1/2.
    """
    assert Triangular(left=1, peak=2, right=4)([0, 1, 1.5, 2, 3, 3.5, 4, 9]).tolist() == [0, 0, 0.5, 1, 0.5, 0.25, 0, 0]
    assert Trapezoidal(left=0, first=1, last=2, right=4)([-1, 0.5, 1, 1.5, 2, 3, 4]).tolist() == [
        0,
        0.5,
        1,
        1,
        1,
        0.5,
        0,
    ]
    np.testing.assert_allclose(Bell(centre=1, width=2, steepness=1)([1, 3, -1, 5]), [1, 0.5, 0.5, 0.2])
    np.testing.assert_allclose(Gaussian(centre=0, deviation=0.5)([0, 0.5]), [1, np.exp(-0.5)])


def test_a_vertical_side_belongs_to_the_set():
    assert Triangular(left=0, peak=0, right=1)([-1e-12, 0, 0.5]).tolist() == [0, 1, 0.5]
    assert Trapezoidal(left=0, first=0, last=1, right=1)([-0.1, 0, 1, 1.1]).tolist() == [0, 1, 1, 0]


@given(st.sampled_from(SHAPES), st.floats(-2.0, 2.0), widths, st.lists(anything, min_size=1, max_size=5))
def test_degrees_lie_between_zero_and_one_and_keep_their_shape(shape, centre, width, x):
    degrees = around(shape, centre, width)([x, x])
    assert degrees.shape == (2, len(x))
    assert ((degrees >= 0.0) & (degrees <= 1.0)).all()
    assert around(shape, centre, width)(centre) == 1.0


@given(st.sampled_from(SHAPES), st.floats(-2.0, 2.0), widths, st.floats(0.0, 3.0))
def test_symmetric_sets_are_symmetric_fall_outwards_and_are_a_half_half_way(shape, centre, width, distance):
    one = around(shape, centre, width)
    assert one(centre + distance) == pytest.approx(one(centre - distance), abs=1e-9)
    assert one(centre + distance) >= one(centre + distance + 0.01) - 1e-12
    assert one([centre - 0.5 * width, centre + 0.5 * width]) == pytest.approx([0.5, 0.5])


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Triangular(left=2, peak=1, right=3), "left ≤ peak ≤ right"),
        (lambda: Triangular(left=1, peak=1, right=1), "not all of them the same"),
        (lambda: Trapezoidal(left=0, first=2, last=1, right=3), "left ≤ first ≤ last ≤ right"),
        (lambda: Bell(centre=0, width=0), "width"),
        (lambda: Bell(centre=0, width=1, steepness=-1), "steepness"),
        (lambda: Gaussian(centre=np.nan, deviation=1), "centre"),
        (lambda: Gaussian(centre=0, deviation=1, width=2), "unknown parameter 'width'"),
        (lambda: around("square", 0, 1), "triangular"),
        (lambda: Variable("x", 1, 1, {"A": around("bell", 0, 1)}), "low < high"),
        (lambda: Variable("x", 0, np.inf, {"A": around("bell", 0, 1)}), "low < high"),
        (lambda: Variable("x", 0, 1, {}), "no set"),
        (lambda: Variable("x", 0, 1, {"A": abs}), "no membership function"),
        (lambda: Variable.even("x", ["A"]), "two or more"),
        (lambda: Variable.even("x", ["A", "A"]), "different names"),
    ],
)
def test_wrong_sets_and_variables_are_refused_in_one_line(make, said):
    with pytest.raises(ParameterError) as caught:
        make()
    assert said in one_line(caught.value)


# --- linguistic variables


def test_the_papers_linguistic_values():
    assert ERROR_VALUES == ("NB", "NM", "NS", "Z", "PS", "PM", "PB")
    assert RATE_VALUES == ("N", "Z", "P")


@given(st.sampled_from(["triangular", "trapezoidal"]), st.integers(2, 9), anything)
def test_triangles_and_trapezoids_are_a_partition_of_unity(shape, count, x):
    """Also beyond the universe, whose ends then hold."""
    degrees = Variable.even("x", [str(i) for i in range(count)], shape).degrees(x)
    assert sum(degrees.values()) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_neighbours_cross_at_one_half(shape):
    """Peaks at −1, 0, 1: at ½ the sets Z and P hold to ½ each, and N hardly."""
    degrees = Variable.even("x", RATE_VALUES, shape).degrees(0.5)
    assert (degrees["Z"], degrees["P"]) == (pytest.approx(0.5), pytest.approx(0.5))
    assert degrees["N"] < 0.02


@given(st.sampled_from(SHAPES), anything)
def test_evenly_spaced_sets_are_mirror_images(shape, x):
    variable = Variable.even("e", ERROR_VALUES, shape)
    there, back = variable.degrees(x), variable.degrees(-x)
    for value, mirrored in zip(ERROR_VALUES, ERROR_VALUES[::-1], strict=True):
        assert there[value] == pytest.approx(back[mirrored], abs=1e-12)


def test_variables_are_frozen():
    variable = Variable.even("x", RATE_VALUES)
    with pytest.raises(TypeError):
        variable.sets["N"] = around("bell", 0, 1)
    with pytest.raises(AttributeError):
        variable.low = -2.0


# --- rules, eq. (27) and (28)

X, Y = Variable.even("x", RATE_VALUES), Variable.even("y", RATE_VALUES)


def strengths(antecedent, x, y, **norms):
    return float(RuleBase((X, Y), (Rule(antecedent, 1.0),), **norms).strengths(x, y)[0])


def test_rules_of_equations_27_and_28_worked_by_hand():
    """At x = ¼: Z 3/4, P 1/4. At y = −½: N 1/2, Z 1/2.

    x is Z and y is N: min 1/2, product 3/8. x is P or y is N: max 1/2, 1/4 + 1/2 − 1/8 = 5/8. (x is Z or x is P) and
    y is Z: min(3/4, 1/2) = 1/2; (3/4 + 1/4 − 3/16) / 2 = 13/32.
    """
    both = {"conjunction": "product", "disjunction": "probabilistic_sum"}
    assert strengths(X.is_("P"), 0.25, -0.5) == 0.25
    assert strengths(X.is_("Z") & Y.is_("N"), 0.25, -0.5) == 0.5
    assert strengths(X.is_("Z") & Y.is_("N"), 0.25, -0.5, **both) == 3 / 8
    assert strengths(X.is_("P") | Y.is_("N"), 0.25, -0.5) == 0.5
    assert strengths(X.is_("P") | Y.is_("N"), 0.25, -0.5, **both) == 5 / 8
    assert strengths((X.is_("Z") | X.is_("P")) & Y.is_("Z"), 0.25, -0.5) == 0.5
    assert strengths((X.is_("Z") | X.is_("P")) & Y.is_("Z"), 0.25, -0.5, **both) == 13 / 32


@given(anything, anything, st.sampled_from(SHAPES))
def test_pairs_of_norms_are_each_others_de_morgan_dual(x, y, shape):
    """1 − (a AND b) = (1 − a) OR (1 − b)."""
    a, b = (around(shape, 0.3, 0.8)(each) for each in (x, y))
    assert 1 - min(a, b) == max(1 - a, 1 - b)
    assert 1 - a * b == pytest.approx((1 - a) + (1 - b) - (1 - a) * (1 - b), abs=1e-12)


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.sampled_from(RATE_VALUES), st.sampled_from(RATE_VALUES))
def test_and_is_at_most_either_part_and_or_at_least(x, y, first, second):
    a, b = float(X.degrees(x)[first]), float(Y.degrees(y)[second])
    for conjunction in ("min", "product"):
        assert strengths(X.is_(first) & Y.is_(second), x, y, conjunction=conjunction) <= min(a, b)
    for disjunction in ("max", "probabilistic_sum"):
        assert strengths(X.is_(first) | Y.is_(second), x, y, disjunction=disjunction) >= max(a, b) - 1e-15


@pytest.mark.parametrize("shape", ["triangular", "trapezoidal"])
def test_the_papers_21_rules_are_labelled_and_with_products_a_partition_of_unity(shape):
    """The 7 × 3 states below eq. (48)."""
    e, rate = Variable.even("e", ERROR_VALUES, shape), Variable.even("ė", RATE_VALUES, shape)
    base = RuleBase.table(e, rate, np.ones((7, 3)).tolist(), "product")
    assert len(base.rules) == 21
    assert [rule.label for rule in base.rules][:4] == ["NB N", "NB Z", "NB P", "NM N"]
    assert str(base.rules[0]) == "if e is NB and ė is N then 1"
    x, y = np.meshgrid(np.linspace(-1.2, 1.2, 41), np.linspace(-1.2, 1.2, 41))
    np.testing.assert_allclose(base.strengths(x, y).sum(axis=0), 1.0, atol=1e-12)


def test_rules_read_as_sentences():
    antecedent = (X.is_("N") | X.is_("P")) & Y.is_("Z")
    assert str(Rule(antecedent, "big")) == "if (x is N or x is P) and y is Z then big"
    assert str(Rule(X.is_("N"), Linear(1.0, (2.0, -3.0)))) == "if x is N then 1 +2·x1 -3·x2"
    assert Rule(X.is_("N"), 1.0).label == "x is N"
    assert Rule(X.is_("N"), 1.0, "R1").label == "R1"


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: X.is_("NB"), "unknown value of x 'NB'"),
        (lambda: RuleBase((X,), ()), "at least one rule"),
        (lambda: RuleBase((X, X), (Rule(X.is_("N"), 1.0),)), "names must differ"),
        (lambda: RuleBase((X,), (Rule(Is("z", "N"), 1.0),)), "unknown variable 'z'"),
        (lambda: RuleBase((X,), (Rule(Is("x", "Q"), 1.0),)), "unknown value of x 'Q'"),
        (lambda: RuleBase((X,), (Rule(X.is_("N"), 1.0), Rule(X.is_("N"), 2.0))), "labelled 'x is N'"),
        (lambda: RuleBase((X,), (Rule(X.is_("N"), 1.0),), "and"), "min, product"),
        (lambda: RuleBase((X,), (Rule(X.is_("N"), 1.0),), disjunction="or"), "max, probabilistic_sum"),
        (lambda: RuleBase.table(X, Y, [[1.0] * 3] * 2), "3 × 3"),
        (lambda: RuleBase((X,), (Rule(X.is_("N"), 1.0),)).strengths(1.0, 2.0), "2 inputs given, 1 needed: x"),
    ],
)
def test_wrong_rules_are_refused_in_one_line(make, said):
    with pytest.raises((ParameterError, UnknownNameError)) as caught:
        make()
    assert said in one_line(caught.value)
