"""Mamdani and Sugeno inference, eq. (29)–(33) and (47): hand-worked cases, and scikit-fuzzy on random rule bases."""

import itertools

import numpy as np
import pytest
import skfuzzy
from hypothesis import given
from hypothesis import strategies as st

from rigs import one_line
from sampling import count
from spherical_wrist.errors import ParameterError
from spherical_wrist.fuzzy import (
    Linear,
    Mamdani,
    Rule,
    RuleBase,
    Sugeno,
    Trapezoidal,
    Triangular,
    Variable,
    around,
    sugeno,
    table_error,
    tabulate,
)
from spherical_wrist.fuzzy.mamdani import coa, cog, max_min, sum_min

VALUES = ("N", "Z", "P")
X, Y = Variable.even("x", VALUES), Variable.even("y", VALUES)
METHODS = list(itertools.product(("max_min", "sum_min"), ("coa", "cog")))

# --- worked by hand: U = 0, 1, 2, 3, 4; S = (0, 1, ½, 0, 0), L = (0, 0, ½, 1, 0); rules S at ¾, S at ½, L at ¼

U = np.arange(5.0)
S, L = np.array([0, 1, 0.5, 0, 0]), np.array([0, 0, 0.5, 1, 0])
STRENGTHS, SETS = np.array([[0.75], [0.5], [0.25]]), np.array([S, S, L])
OUTPUT = Variable("z", 0, 4, {"S": Triangular(left=0, peak=1, right=3), "L": Triangular(left=1, peak=3, right=4)})
ON = {"on": Triangular(left=0, peak=1, right=2)}


def mamdani_by_hand(**methods):
    """Three inputs, of which each fires one of the rules to its own degree."""
    inputs = tuple(Variable(name, 0, 1, ON) for name in "abc")
    rules = tuple(Rule(v.is_("on"), then) for v, then in zip(inputs, ("S", "S", "L"), strict=True))
    return Mamdani(RuleBase(inputs, rules), OUTPUT, points=5, **methods)


def test_equation_30_max_min_aggregation_by_hand():
    """Cut off: S at ¾ (0, ¾, ½, 0, 0), S at ½ (0, ½, ½, 0, 0), L at ¼ (0, 0, ¼, ¼, 0). Maximum: (0, ¾, ½, ¼, 0)."""
    assert max_min(STRENGTHS, SETS).tolist() == [[0, 0.75, 0.5, 0.25, 0]]
    assert mamdani_by_hand().aggregated(0.75, 0.5, 0.25).tolist() == [0, 0.75, 0.5, 0.25, 0]


def test_equation_31_sum_min_aggregation_by_hand():
    """The same three sets added up: (0, 5/4, 5/4, 1/4, 0)."""
    assert sum_min(STRENGTHS, SETS).tolist() == [[0, 1.25, 1.25, 0.25, 0]]
    assert mamdani_by_hand(aggregation="sum_min").aggregated(0.75, 0.5, 0.25).tolist() == [0, 1.25, 1.25, 0.25, 0]


def test_equations_32_and_33_defuzzification_by_hand():
    """COA, eq. (33), of max-min: (¾ + 2·½ + 3·¼) / (3/2) = (5/2) / (3/2) = 5/3.

    COA of sum-min: (5/4 + 2·5/4 + 3·1/4) / (11/4) = (18/4) / (11/4) = 18/11. COG, eq. (32), sums over the three rules
    before anything is aggregated: 18/11 whatever the aggregation.
    """
    assert coa(U, max_min(STRENGTHS, SETS)) == pytest.approx(5 / 3)
    assert coa(U, sum_min(STRENGTHS, SETS)) == pytest.approx(18 / 11)
    assert cog(U, STRENGTHS, SETS) == pytest.approx(18 / 11)
    found = {(a, d): float(mamdani_by_hand(aggregation=a, defuzzification=d)(0.75, 0.5, 0.25)) for a, d in METHODS}
    assert found == {
        ("max_min", "coa"): pytest.approx(5 / 3),
        ("max_min", "cog"): pytest.approx(18 / 11),
        ("sum_min", "coa"): pytest.approx(18 / 11),
        ("sum_min", "cog"): pytest.approx(18 / 11),
    }


NINE = [[1.0, 2.0, 1.0], [3.0, 4.0, 3.0], [1.0, 2.0, 1.0]]


def test_equations_29_and_47_sugeno_inference_by_hand():
    """At x = ¼: Z 3/4, P 1/4; at y = −½: N 1/2, Z 1/2.

    Product: ζ = 3/8, 3/8, 1/8, 1/8 of θ = 3, 4, 1, 2: (9 + 12 + 1 + 2) / 8 = 3. Minimum: ½, ½, ¼, ¼, which add up to
    3/2: (3/2 + 2 + 1/4 + 1/2) / (3/2) = 17/6.
    """
    assert Sugeno(RuleBase.table(X, Y, NINE, "product"))(0.25, -0.5) == pytest.approx(3.0)
    assert Sugeno(RuleBase.table(X, Y, NINE, "min"))(0.25, -0.5) == pytest.approx(17 / 6)


def test_equation_29_first_order_sugeno_by_hand():
    """At x = ¼: Z 3/4 with 1 + 2x = 3/2, P 1/4 with 3 − 4x = 2: 9/8 + 1/2 = 13/8. Beyond 1: P alone, 3 − 4 = −1."""
    rules = Rule(X.is_("Z"), Linear(1.0, (2.0,))), Rule(X.is_("P"), Linear(3.0, (-4.0,)))
    inference = Sugeno(RuleBase((X,), rules))
    assert inference.order == 1
    np.testing.assert_allclose(inference([0.25, 1.0, 7.0]), [13 / 8, -1.0, -1.0])
    assert Sugeno(RuleBase.table(X, Y, NINE)).order == 0


def test_where_no_rule_fires_there_is_no_output():
    base = RuleBase((X,), (Rule(X.is_("N"), 1.0),))
    assert np.isnan(Sugeno(base)([0.0, 0.5, 1.0])).all()
    assert Sugeno(base)(-0.5) == 1.0
    for aggregation, defuzzification in METHODS:
        rules = RuleBase((X,), (Rule(X.is_("N"), "S"),))
        found = Mamdani(rules, OUTPUT, aggregation, defuzzification)([-0.5, 0.5])
        assert np.isfinite(found).tolist() == [True, False]


# --- against scikit-fuzzy


def random_variable(random, name, low, high):
    """Two to five sets of any shape; the outermost are at the ends, so that something fires nearly everywhere."""
    count = random.integers(2, 6)
    centres = np.linspace(low, high, count) + random.uniform(-0.1, 0.1, count) * (high - low) / count
    shapes = random.choice(["triangular", "trapezoidal", "bell", "gaussian"], count)
    reaches = random.uniform(0.8, 1.5, count) * (high - low) / (count - 1)
    return Variable(
        name, low, high,
        {f"{name}{i}": around(str(s), c, r) for i, (s, c, r) in enumerate(zip(shapes, centres, reaches, strict=True))},
    )  # fmt: skip


def random_antecedent(random, variables):
    first, second, third = (v.is_(str(random.choice(list(v.sets)))) for v in random.choice(variables, 3))
    kind = random.integers(5)
    return [first, first & second, first | second, (first | second) & third, (first & second) | third][kind]


def random_mamdani(seed, conjunction="min", disjunction="max", **methods):
    random = np.random.default_rng(seed)
    inputs = random_variable(random, "p", -2.0, 1.0), random_variable(random, "q", 0.0, 5.0)
    peaks = np.sort(random.uniform(1.0, 9.0, 4))
    output = Variable(
        "z",
        0,
        10,
        {f"z{i}": Triangular(left=c - 1, peak=c, right=c + random.uniform(0.2, 1)) for i, c in enumerate(peaks)},
    )
    rules = tuple(
        Rule(random_antecedent(random, inputs), f"z{random.integers(4)}", f"R{i}")
        for i in range(random.integers(2, 12))
    )
    return Mamdani(RuleBase(inputs, rules, conjunction, disjunction), output, points=4001, **methods)


def firing(antecedent, degrees, conjunction, disjunction):
    """The firing strength from scikit-fuzzy's degrees, written without the package's norms."""
    if hasattr(antecedent, "value"):
        return degrees[antecedent.variable][antecedent.value]
    parts = [firing(part, degrees, conjunction, disjunction) for part in antecedent.parts]
    if type(antecedent).__name__ == "And":
        return np.fmin.reduce(parts) if conjunction == "min" else np.prod(parts, axis=0)
    return np.fmax.reduce(parts) if disjunction == "max" else 1 - np.prod([1 - p for p in parts], axis=0)


def skfuzzy_set(membership, x):
    """The same set by scikit-fuzzy's own function."""
    m = membership
    match type(m).__name__:
        case "Triangular":
            return skfuzzy.trimf(x, [m.left, m.peak, m.right])
        case "Trapezoidal":
            return skfuzzy.trapmf(x, [m.left, m.first, m.last, m.right])
        case "Bell":
            return skfuzzy.gbellmf(x, m.width, m.steepness, m.centre)
    return skfuzzy.gaussmf(x, m.centre, m.deviation)


NORMS = list(itertools.product(("min", "product"), ("max", "probabilistic_sum")))


@pytest.mark.parametrize(("conjunction", "disjunction"), NORMS)
@pytest.mark.parametrize("seed", range(count(2, 10)))
def test_mamdani_agrees_with_scikit_fuzzys_functions_on_random_rule_bases(seed, conjunction, disjunction):
    """Its membership functions and its centroid, an exact integral: ours are the sums of eq. (32)–(33)."""
    random = np.random.default_rng(100 + seed)
    p, q = random.uniform(-2.0, 1.0, 20), random.uniform(0.0, 5.0, 20)
    for aggregation, defuzzification in METHODS:
        ours = random_mamdani(seed, conjunction, disjunction, aggregation=aggregation, defuzzification=defuzzification)
        variables = dict(zip("pq", ours.rules.variables, strict=True))
        degrees = {
            name: {value: skfuzzy_set(m, x) for value, m in variables[name].sets.items()}
            for name, x in {"p": p, "q": q}.items()
        }
        universe = np.linspace(0.0, 10.0, 4001)
        cut = [
            np.fmin(
                firing(rule.antecedent, degrees, conjunction, disjunction)[:, None],
                skfuzzy_set(ours.output.sets[rule.then], universe),
            )
            for rule in ours.rules.rules
        ]
        summed = (aggregation, defuzzification) != ("max_min", "coa")
        joined = np.sum(cut, axis=0) if summed else np.max(cut, axis=0)
        found = ours(p, q)
        for k in range(20):
            if joined[k].max() > 1e-6:
                assert found[k] == pytest.approx(skfuzzy.defuzz(universe, joined[k], "centroid"), abs=1e-4)


@pytest.mark.parametrize("seed", range(8))
def test_mamdani_agrees_with_scikit_fuzzys_control_system(seed):
    """Its whole inference: min, max, max-min, eq. (30), and the centroid."""
    pytest.importorskip("networkx", reason="skfuzzy.control needs networkx")
    from skfuzzy import control

    ours = random_mamdani(seed)
    grids = {v.name: np.linspace(v.low, v.high, 31) for v in ours.rules.variables}
    theirs = {name: control.Antecedent(grid, name) for name, grid in grids.items()}
    theirs["z"] = control.Consequent(np.linspace(0.0, 10.0, 4001), "z", defuzzify_method="centroid")
    for variable in (*ours.rules.variables, ours.output):
        for value, membership in variable.sets.items():
            theirs[variable.name][value] = skfuzzy_set(membership, theirs[variable.name].universe)

    def translated(antecedent):
        if hasattr(antecedent, "value"):
            return theirs[antecedent.variable][antecedent.value]
        first, second = map(translated, antecedent.parts)
        return first & second if type(antecedent).__name__ == "And" else first | second

    rules = [control.Rule(translated(r.antecedent), theirs["z"][r.then], label=r.label) for r in ours.rules.rules]
    system = control.ControlSystemSimulation(control.ControlSystem(rules))
    random = np.random.default_rng(seed)
    used = {statement.variable for rule in ours.rules.rules for statement in rule.antecedent.statements()}
    for _ in range(10):
        # on its grid, between whose points it interpolates the degrees
        point = {name: float(random.choice(grids[name])) for name in "pq"}
        if ours.rules.strengths(*point.values()).max() < 1e-6:
            continue
        for name in used:
            system.input[name] = point[name]
        system.compute()
        assert ours(*point.values()) == pytest.approx(system.output["z"], abs=1e-3)


# --- properties

thetas = st.lists(st.tuples(*[st.floats(0.01, 100.0)] * 3), min_size=3, max_size=3)
shapes = st.sampled_from(["triangular", "trapezoidal", "bell", "gaussian"])
inputs = st.one_of(st.floats(-3.0, 3.0), st.sampled_from([-np.inf, -1.0, 0.0, 1.0, np.inf]))
norms = st.sampled_from(["min", "product"])


@given(inputs, inputs, thetas, shapes, norms)
def test_sugeno_lies_between_the_weights_and_equal_weights_come_back(x, y, theta, shape, conjunction):
    first, second = Variable.even("x", VALUES, shape), Variable.even("y", VALUES, shape)
    found = Sugeno(RuleBase.table(first, second, theta, conjunction))(x, y)
    assert np.min(theta) * (1 - 1e-12) <= found <= np.max(theta) * (1 + 1e-12)
    same = Sugeno(RuleBase.table(first, second, [[theta[0][0]] * 3] * 3, conjunction))(x, y)
    assert same == pytest.approx(theta[0][0])


@given(inputs, inputs, thetas, shapes, norms)
def test_sugeno_of_any_order_is_symmetric(x, y, theta, shape, conjunction):
    """Inputs, rules and slopes turned round change nothing."""
    first, second = Variable.even("x", VALUES, shape), Variable.even("y", VALUES, shape)
    there = [[Linear(cell, (i - 0.5, 2.0 * j)) for j, cell in enumerate(row)] for i, row in enumerate(theta)]
    back = [[Linear(cell.offset, (-cell.slopes[0], -cell.slopes[1])) for cell in row[::-1]] for row in there[::-1]]
    one = Sugeno(RuleBase.table(first, second, there, conjunction))(x, y)
    two = Sugeno(RuleBase.table(first, second, back, conjunction))(-x, -y)
    assert one == pytest.approx(two, rel=1e-9, abs=1e-9)


@given(inputs, inputs, thetas)
def test_equation_47_as_compiled_is_the_general_inference(x, y, theta):
    general = Sugeno(RuleBase.table(X, Y, theta, "product"))
    assert sugeno(x, y, np.array(theta)) == pytest.approx(float(general(x, y)), rel=1e-12)


@given(inputs, inputs, shapes, norms, st.sampled_from(METHODS), st.permutations("SMLMLSLSM"))
def test_mamdani_stays_within_the_sets_is_symmetric_and_does_not_depend_on_the_order(
    x, y, shape, conjunction, how, cells
):
    output = Variable(
        "z", 0, 4, {"S": around("triangular", 1, 0.5), "M": around("bell", 2, 0.5), "L": around("gaussian", 3, 0.5)}
    )
    first, second = Variable.even("x", VALUES, shape), Variable.even("y", VALUES, shape)
    then = np.array(cells).reshape(3, 3)
    base = RuleBase.table(first, second, then.tolist(), conjunction)
    found = Mamdani(base, output, *how)(x, y)
    assert 0.0 < found < 4.0
    turned = RuleBase.table(first, second, then[::-1, ::-1].tolist(), conjunction)
    assert Mamdani(turned, output, *how)(-x, -y) == pytest.approx(float(found), rel=1e-9)
    shuffled = RuleBase((first, second), base.rules[::-1], conjunction)
    assert Mamdani(shuffled, output, *how)(x, y) == pytest.approx(float(found), rel=1e-9)


@pytest.mark.parametrize(("aggregation", "defuzzification"), METHODS)
def test_a_mamdani_rule_alone_says_the_centre_of_its_symmetric_set(aggregation, defuzzification):
    output = Variable("z", 0, 4, {"S": around("trapezoidal", 1, 0.5), "L": around("triangular", 3, 0.5)})
    base = RuleBase.table(X, Y, [["S", "L", "S"], ["L", "S", "L"], ["S", "S", "L"]])
    inference = Mamdani(base, output, aggregation, defuzzification)
    for rule, (x, y) in zip(base.rules, itertools.product((-1, 0, 1), (-1, 0, 1)), strict=True):
        assert inference(x, y) == pytest.approx({"S": 1.0, "L": 3.0}[rule.then])


def test_numbers_arrays_and_many_inputs_give_the_same():
    """Thousands of inputs go through in pieces."""
    inference = random_mamdani(3, aggregation="sum_min")
    random = np.random.default_rng(0)
    p, q = random.uniform(-2.0, 1.0, (60, 40)), random.uniform(0.0, 5.0, (60, 40))
    together = inference(p, q)
    assert together.shape == (60, 40)
    assert together[7, 9] == pytest.approx(float(inference(p[7, 9], q[7, 9])), nan_ok=True)
    assert inference(p[:, :1], q[:1]).shape == (60, 40)
    assert inference(np.empty(0), np.empty(0)).shape == (0,)


# --- tables


def test_a_tables_error_worked_by_hand():
    """z = x² has error h²/4 half-way between points h apart: 1/16 for h = ½; on a lattice 4 times finer that is found.

    From one lattice point to the next the difference changes by 3/64 at most (0, 3/64, 1/16): half of it comes on top.
    """
    rules = tuple(Rule(X.is_("Z") | Y.is_(value), Linear(0.0, (1.0, 0.0)), value) for value in VALUES)

    class Square:
        name = "z"

        def __init__(self):
            self.rules = RuleBase((X, Y), rules)

        def __call__(self, x, y):
            return x**2 + 0.0 * y

    table = tabulate(Square(), (5, 2))
    np.testing.assert_allclose(table[:, 0], [1, 0.25, 0, 0.25, 1])
    assert table_error(Square(), table) == pytest.approx(1 / 16 + 3 / 128)


def test_a_table_with_a_gap_is_refused():
    base = RuleBase.table(
        X, Variable("y", -1, 1, {"far": Trapezoidal(left=0.5, first=0.6, last=1, right=1)}), [[1.0]] * 3
    )
    with pytest.raises(ParameterError, match="no rule fires at x = -1, y = -1"):
        tabulate(Sugeno(base), (9, 9))
    with pytest.raises(ParameterError, match="two inputs"):
        tabulate(Sugeno(RuleBase((X,), (Rule(X.is_("N"), 1.0),))))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Sugeno(RuleBase((X,), (Rule(X.is_("N"), "S"),))), "number or Linear"),
        (lambda: Sugeno(RuleBase((X,), (Rule(X.is_("N"), np.inf),))), "finite"),
        (lambda: Sugeno(RuleBase((X,), (Rule(X.is_("N"), Linear(0.0, (1.0, 2.0))),))), "2 slopes given, 1 needed"),
        (lambda: Mamdani(RuleBase((X,), (Rule(X.is_("N"), 1.0),)), OUTPUT), "name of a set"),
        (lambda: Mamdani(RuleBase((X,), (Rule(X.is_("N"), "M"),)), OUTPUT), "unknown value of z 'M'"),
        (lambda: Mamdani(RuleBase((X,), (Rule(X.is_("N"), "S"),)), OUTPUT, "max"), "max_min, sum_min"),
        (lambda: Mamdani(RuleBase((X,), (Rule(X.is_("N"), "S"),)), OUTPUT, defuzzification="mom"), "coa, cog"),
        (lambda: Mamdani(RuleBase((X,), (Rule(X.is_("N"), "S"),)), OUTPUT, points=1), "at least 2"),
        (lambda: Mamdani(RuleBase((X,), (Rule(X.is_("N"), "S"),)), OUTPUT, points=2), "between two elements"),
    ],
)
def test_wrong_inferences_are_refused_in_one_line(make, said):
    with pytest.raises(ParameterError) as caught:
        make()
    assert said in one_line(caught.value)
