"""Control laws: one contract for all of them, and each rewritten from the paper's equations."""

import re
from math import cos, sin
from typing import Literal, get_args, get_origin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from rigs import one_line
from sampling import count
from spherical_wrist.control import (
    PD,
    ComputedTorque,
    FuzzySlidingComputedTorque,
    Law,
    ModelBasedLaw,
    SlidingComputedTorque,
    choice,
)
from spherical_wrist.control.contract import COMMAND, SIGNAL, LawStatus
from spherical_wrist.control.switching import SATURATION, SIGN, TANH, SwitchingName, switch
from spherical_wrist.errors import ParameterError
from spherical_wrist.loop.compiler import compiled_law
from spherical_wrist.loop.engine import interpreted_step
from spherical_wrist.parameters import Positive, quantity
from spherical_wrist.so3 import cross

every_law = pytest.mark.parametrize("law", Law.members.values(), ids=Law.members)


def signals(count, seed=0):
    """Signals such as a wrist sees: small and large errors, symmetric positive H."""
    random = np.random.default_rng(seed)
    made = np.zeros(count, SIGNAL)
    made["time"] = np.arange(count) * 1e-3
    made["period"] = 1e-3
    for name in ("attitude", "desired_attitude"):
        made[name] = Rotation.random(count, rng=random).as_quat(scalar_first=True)
    size = 10.0 ** random.uniform(-6.0, 0.5, (count, 1))
    made["error"] = size * random.normal(size=(count, 3))
    made["rate_error"] = 20.0 * size * random.normal(size=(count, 3))
    for name in ("rate", "desired_rate", "feed_forward"):
        made[name] = 5.0 * random.normal(size=(count, 3))
    root = random.normal(size=(count, 3, 3))
    made["H"] = 1e-4 * (root @ root.transpose(0, 2, 1) + 3.0 * np.eye(3))
    made["N"] = 0.02 * random.normal(size=(count, 3))
    made["horizon"] = 5e-4
    made["torque_limit"] = (0.25, 0.20, 0.33)
    return made


def steps(law, given, step=None):
    """The commands of a law for signals in a row, and its last state."""
    commands = np.full(len(given) * COMMAND.itemsize // 8, np.nan).view(COMMAND)
    state = law.packed_state()
    run, packed = step or interpreted_step(law), law.packed(float(given["period"][0]))
    for signal, command in zip(given.view(np.recarray), commands.view(np.recarray), strict=True):
        run(signal, packed, state, command)
    return commands, state


def compiled_steps(law, given):
    """The same in machine code, which takes records as they are."""
    commands = np.full(len(given) * COMMAND.itemsize // 8, np.nan).view(COMMAND)
    state = law.packed_state()
    run, packed = compiled_law(law), law.packed(float(given["period"][0]))
    for k in range(len(given)):
        run(given[k], packed, state, commands[k])
    return commands, state


def other(law):
    """The law with other gains: every positive number half as large again."""
    changes = {}
    for name in law.model_fields:
        value = getattr(law(), name)
        if isinstance(value, float | tuple):
            changes[name] = (1.5 * np.array(value)).tolist()
    return law(**changes)


# --- the contract


@every_law
def test_says_where_it_comes_from_and_how_well_it_tracks(law):
    """In its own class: another law may derive from it."""
    assert vars(law)["status"] in set(get_args(LawStatus)) - {"user"}
    assert 0.0 < vars(law)["tracks_to"].rms_rad < law.tracks_to.max_rad


@every_law
def test_names_its_state_with_units_and_meanings(law):
    names, units = law.state_names(), law.state_units()
    assert len(set(names)) == len(units) == law.state_size
    assert law().packed_state().size == max(1, law.state_size)
    for name, field in law.State.model_fields.items():
        assert field.description, name
        assert "unit" in field.json_schema_extra, name


def test_a_users_own_law_stays_out_of_the_packages_list():
    class Mine(Law):
        gain: Positive = quantity(1.0, "", "a gain")

    assert Mine.name == "mine"
    assert type("Derived", (ComputedTorque,), {"__module__": "elsewhere"}).status == Mine.status == "user"
    assert "mine" not in Law.members
    assert not [law for law in Law.members.values() if law.__dict__.get("abstract")]


@every_law
def test_writes_a_finite_torque_and_nothing_else_that_it_was_given(law):
    given = signals(50)
    before, parameters = given.copy(), law().packed()
    commands, _ = steps(law(), given)
    assert given.tobytes() == before.tobytes()
    assert law().packed().tobytes() == parameters.tobytes()
    assert np.isfinite(commands["torque"]).all()
    for name in ("surface", "slope"):
        assert np.isfinite(commands[name]).all() == law.has_surface
        assert np.isnan(commands[name]).all() != law.has_surface


@every_law
def test_is_deterministic(law):
    given = signals(50)
    assert steps(law(), given)[0].tobytes() == steps(law(), given)[0].tobytes()


@every_law
@pytest.mark.parametrize("maker", [interpreted_step, compiled_law], ids=["interpreted", "compiled"])
def test_two_of_a_kind_do_not_interact(law, maker):
    """Steps of one law between those of another: nothing is kept anywhere but in the state."""
    given, pair = signals(12), (law(), other(law))
    alone = [(steps if maker is interpreted_step else compiled_steps)(one, given)[0] for one in pair]
    assert not np.array_equal(alone[0]["torque"], alone[1]["torque"])
    together = [np.full(COMMAND.itemsize // 8 * len(given), np.nan).view(COMMAND) for _ in pair]
    states = [one.packed_state() for one in pair]
    for k in range(len(given)):
        for one, commands, state in zip(pair, together, states, strict=True):
            if maker is interpreted_step:
                maker(one)(given.view(np.recarray)[k], one.packed(), state, commands.view(np.recarray)[k])
            else:
                maker(one)(given[k], one.packed(), state, commands[k])
    for apart, mixed in zip(alone, together, strict=True):
        assert apart.tobytes() == mixed.tobytes()


@every_law
def test_compiled_equals_interpreted(law):
    choices = [{}]
    for name, field in law.model_fields.items():
        if get_origin(field.annotation) is Literal:
            choices += [{name: each} for each in get_args(field.annotation)]
    for chosen in choices:
        given = signals(count(50, 200), seed=3)
        (plain, state), (machine, other_state) = steps(law(**chosen), given), compiled_steps(law(**chosen), given)
        for name in COMMAND.names:
            np.testing.assert_allclose(machine[name], plain[name], rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(other_state, state, rtol=1e-12, atol=1e-15)


@every_law
def test_has_no_preferred_direction(law):
    """Everything turned round turns the torque round: no axis is pushed harder one way than the other."""
    given = signals(50, seed=4)
    turned = given.copy()
    for name in ("error", "rate_error", "rate", "desired_rate", "feed_forward", "N"):
        turned[name] = -given[name]
    for one, two in zip(given, turned, strict=True):
        there, back = (steps(law(), np.array([signal]))[0]["torque"][0] for signal in (one, two))
        np.testing.assert_allclose(back, -there, rtol=1e-12, atol=1e-15)


@every_law
def test_without_error_a_law_with_a_model_asks_for_what_the_model_needs(law):
    given = signals(20, seed=5)
    given["error"] = given["rate_error"] = 0.0
    expected = given["N"] + np.einsum("kij,kj->ki", given["H"], given["feed_forward"])
    if not issubclass(law, ModelBasedLaw):
        expected = given["N"]
    torque = [steps(law(), given[k : k + 1])[0]["torque"][0] for k in range(20)]
    np.testing.assert_allclose(torque, expected, rtol=1e-12, atol=1e-16)


@every_law
def test_parameters_are_packed_in_the_order_of_the_layout(law):
    one = other(law)
    record = one.packed().view(one.layout())[0]
    assert list(one.layout().names)[: len(law.model_fields)] == list(law.model_fields)
    for name, field in law.model_fields.items():
        value = getattr(one, name)
        if isinstance(value, str):
            value = choice(field.annotation, value)
        assert np.array_equal(record[name], np.array(value, float)), name
    assert one.packed().dtype == np.float64
    assert law().layout() == one.layout()


@every_law
def test_parameters_are_frozen(law):
    for name in law.model_fields:
        with pytest.raises((ParameterError, ValidationError)):
            setattr(law(), name, getattr(law(), name))


@every_law
def test_the_class_says_where_the_law_comes_from(law):
    """An equation of the paper, or authors and year; in words of its own, not its base's."""
    assert re.search(r"eq\. \(\d+\)|\(.*, (19|20)\d\d\)", law.__dict__["__doc__"])


@every_law
def test_every_parameter_is_documented_with_its_unit(law):
    assert not [
        name
        for name, field in law.model_fields.items()
        if not (field.description and "unit" in (field.json_schema_extra or {}))
    ]


def refusal(law, **parameters):
    """Return the line with which a law refuses parameters; an empty one where it takes them."""
    try:
        law(**parameters)
    except ParameterError as error:
        return one_line(error)
    return ""


@every_law
def test_a_misspelt_parameter_is_refused_and_the_right_one_named(law):
    for name in law.model_fields:
        misspelt = f"{name}x" if len(name) < 4 else name[:-2] + name[-1]
        message = refusal(law, **{misspelt: 1.0})
        assert misspelt in message
        assert f"did you mean {name!r}" in message


WRONG = {
    "negative": -1.0,
    "not a number": np.nan,
    "infinite": np.inf,
    "nothing": None,
    "word": "many",
    "two": (1.0, 2.0),
    "four": [1.0, 2.0, 3.0, 4.0],
    "one not a number": (1.0, np.nan, 1.0),
    "one negative": np.array([1.0, -1.0, 1.0]),
    "table": {"x": 1.0},
    "matrix": np.ones((2, 2)),
}


@every_law
def test_a_wrong_value_is_refused_in_one_line_that_names_the_parameter(law):
    assert not [
        (name, kind, message)
        for name in law.model_fields
        for kind, wrong in WRONG.items()
        if not (message := refusal(law, **{name: wrong})).startswith(name)
    ]


@every_law
def test_one_number_stands_for_three_axes_and_arrays_are_taken(law):
    for name in law.model_fields:
        value = getattr(law(), name)
        if isinstance(value, tuple) and len(value) == 3:
            assert getattr(law(**{name: 0.7}), name) == (0.7, 0.7, 0.7)
            assert getattr(law(**{name: np.array([0.1, 0.2, 0.3])}), name) == (0.1, 0.2, 0.3)
            assert getattr(law(**{name: [1, 2, 3]}), name) == (1.0, 2.0, 3.0)


SECOND, TORQUE, RADIAN = 7.0, 3.0, 1.9
"""Sizes of a second, a newton metre and a radian in other, made-up units."""

SMALL = 1e-12
"""Size of signals at which sines of angles are the angles, and e × ė and ω × H ω, a torque but for a radian, vanish."""


def factor(unit, radian=RADIAN):
    """Return the factor from ``unit`` to the made-up units."""
    sizes = {"": 1.0, "1": 1.0, "s": SECOND, "Hz": 1.0 / SECOND, "N·m": TORQUE, "rad": radian}
    power = {"²": 2.0, "³": 3.0, "½": 0.5}
    total = 1.0
    for sign, part in zip((1.0, -1.0), f"{unit}/".split("/")[:2], strict=True):
        for token in part.replace("N·m", "Nm").strip("()").split("·"):
            name, exponent = re.fullmatch(r"(\w*?)([²³½]?)", token).groups()
            total *= sizes[name.replace("Nm", "N·m")] ** (sign * power.get(exponent, 1.0))
    return total


def functions_of(function):
    """Return the functions that a function names, and those that they name in turn."""
    named = (function.__globals__.get(name) for name in function.__code__.co_names)
    found = {each for each in named if callable(each)}
    return found.union(*(functions_of(each) for each in found if hasattr(each, "__code__")))


@every_law
@pytest.mark.parametrize("size", [1.0, SMALL])
def test_the_units_of_the_parameters_fit_together(law, size):
    """In other units of time, torque and angle the same law gives the same torque: every unit is the right one.

    Only the radian will do where a law has the sine or the cross product of vectors that are not small.
    """
    true_angles = not {sin, cos, cross}.isdisjoint(functions_of(law.step))
    radian = 1.0 if true_angles and size == 1.0 else RADIAN
    given, one = signals(30, seed=6), other(law)
    for name in ("rate", "desired_rate", "error", "rate_error", "feed_forward", "N"):
        given[name] *= size
    scaled = given.copy()
    for name, unit in {
        "time": "s", "period": "s", "rate": "rad/s", "desired_rate": "rad/s", "error": "rad", "rate_error": "rad/s",
        "feed_forward": "rad/s²", "H": "N·m·s²/rad", "N": "N·m", "horizon": "s", "torque_limit": "N·m",
    }.items():  # fmt: skip
        scaled[name] *= factor(unit, radian)
    changes = {}
    for name, field in law.model_fields.items():
        value = getattr(one, name)
        if isinstance(value, float | tuple):
            changes[name] = (np.array(value) * factor(field.json_schema_extra["unit"], radian)).tolist()
    here, _ = steps(one, given)
    there, _ = steps(law(**changes), scaled)
    for name, unit in {"torque": "N·m", "surface": "rad/s", "slope": "1/s"}.items():
        np.testing.assert_allclose(there[name], here[name] * factor(unit, radian), rtol=1e-9)


# --- each law from the paper


def computed_torque(signal, law):
    """Eq. (14)."""
    acceleration = signal["feed_forward"] + np.diag(law.Kv) @ signal["rate_error"] + np.diag(law.Kp) @ signal["error"]
    return signal["H"] @ acceleration + signal["N"]


SWITCHING = {
    "sign": np.sign,
    "saturation": lambda x: np.clip(x, -1.0, 1.0),
    "tanh": lambda x: 1.0 - 2.0 / (np.exp(2.0 * np.clip(x, -350.0, 350.0)) + 1.0),
}


def switched(law, surface):
    """Eq. (35), with the boundary layer."""
    return np.diag(law.K) @ SWITCHING[law.switching](surface / np.array(law.phi))


def alpha(law, error, rate):
    """Eq. (47): 7 × 3 triangular sets over the scaled error and its rate."""

    def sets(x, count):
        return np.interp(x, np.linspace(-1.0, 1.0, count), np.arange(count, dtype=float))

    def degrees(x, count):
        return np.maximum(0.0, 1.0 - np.abs(sets(x, count) - np.arange(count)))

    scaled = error / np.array(law.error_scale), rate / np.array(law.rate_scale)
    return np.array([degrees(e, 7) @ np.array(law.rules) @ degrees(r, 3) for e, r in zip(*scaled, strict=True)])


AXES = {"Kp": (300.0, 400.0, 500.0), "Kv": (30.0, 0.0, 45.0)}
SLIDING = {**AXES, "K": (0.04, 0.06, 0.02), "slope": 22.0, "phi": (0.2, 0.3, 0.7)}
UNEVEN = np.random.default_rng(1).uniform(0.5, 8.0, (7, 3)).tolist()


@pytest.mark.parametrize("law", [ComputedTorque(), ComputedTorque(**AXES)], ids=["default", "per axis"])
def test_computed_torque_is_equation_14(law):
    given = signals(100, seed=7)
    np.testing.assert_allclose(
        steps(law, given)[0]["torque"], [computed_torque(s, law) for s in given], rtol=1e-11, atol=1e-15
    )


@pytest.mark.parametrize("law", [PD(), PD(P=(0.1, 0.2, 0.3), D=(0.0, 0.02, 0.01))], ids=["default", "per axis"])
def test_pd_is_a_spring_a_damper_and_gravity(law):
    given = signals(100, seed=8)
    expected = given["error"] @ np.diag(law.P) + given["rate_error"] @ np.diag(law.D) + given["N"]
    np.testing.assert_allclose(steps(law, given)[0]["torque"], expected, rtol=1e-12, atol=1e-16)
    assert law.gravity_only


@pytest.mark.parametrize("switching", SWITCHING)
@pytest.mark.parametrize("gains", [{}, SLIDING], ids=["default", "per axis"])
def test_sliding_computed_torque_is_equations_34_and_35(switching, gains):
    law = SlidingComputedTorque(switching=switching, **gains)
    given = signals(100, seed=9)
    commands, _ = steps(law, given)
    surface = law.slope * given["error"] + given["rate_error"]
    expected = [computed_torque(s, law) + switched(law, surface[k]) for k, s in enumerate(given)]
    np.testing.assert_allclose(commands["torque"], expected, rtol=1e-11, atol=1e-15)
    np.testing.assert_allclose(commands["surface"], surface, rtol=1e-12)
    np.testing.assert_allclose(commands["slope"], law.slope)
    assert tuple(law.boundary_layer) == law.phi


@pytest.mark.parametrize("switching", SWITCHING)
@pytest.mark.parametrize(
    "gains",
    [{}, {**SLIDING, "rules": UNEVEN, "error_scale": (0.1, 0.5, 1.0), "rate_scale": (1.0, 3.0, 9.0)}],
    ids=["default", "uneven"],
)
def test_fuzzy_sliding_computed_torque_is_equations_44_to_48(switching, gains):
    law = FuzzySlidingComputedTorque(switching=switching, **gains)
    given = signals(200, seed=10)
    commands, _ = steps(law, given)
    for signal, command in zip(given, commands, strict=True):
        slope = law.slope * alpha(law, signal["error"], signal["rate_error"])
        surface = slope * signal["error"] + signal["rate_error"]
        np.testing.assert_allclose(command["slope"], slope, rtol=1e-11)
        np.testing.assert_allclose(command["surface"], surface, rtol=1e-11, atol=1e-12)
        np.testing.assert_allclose(
            command["torque"], computed_torque(signal, law) + switched(law, surface), rtol=1e-10, atol=1e-12
        )


def test_with_equal_rules_the_fuzzy_law_is_the_sliding_law():
    """A constant α only scales the slope."""
    given = signals(50, seed=11)
    fuzzy = FuzzySlidingComputedTorque(rules=[[2.0] * 3] * 7, slope=15.0)
    np.testing.assert_allclose(
        steps(fuzzy, given)[0]["torque"], steps(SlidingComputedTorque(slope=30.0), given)[0]["torque"], rtol=1e-12
    )


# --- switching functions

KINDS = {"sign": SIGN, "saturation": SATURATION, "tanh": TANH}
numbers = st.one_of(st.floats(-5.0, 5.0), st.floats(-1e300, 1e300), st.just(0.0))
layers = st.floats(1e-3, 1e3)


def test_the_choices_of_a_law_are_the_switching_functions():
    choices = get_args(SlidingComputedTorque.model_fields["switching"].annotation)
    assert {name: choice(SwitchingName, name) for name in choices} == KINDS
    assert set(choices) == set(SWITCHING)


@given(numbers, layers)
def test_switching_functions_have_their_closed_forms(surface, layer):
    assert switch(SIGN, surface, layer) == np.sign(surface)
    assert switch(SATURATION, surface, layer) == np.clip(surface / layer, -1.0, 1.0)
    assert switch(TANH, surface, layer) == pytest.approx(np.tanh(surface / layer), rel=1e-14)


@given(numbers, layers, st.sampled_from(sorted(KINDS.values())))
def test_switching_functions_are_odd_and_bounded(surface, layer, kind):
    value = switch(kind, surface, layer)
    assert -1.0 <= value <= 1.0
    assert switch(kind, -surface, layer) == -value
    assert value * surface >= 0.0


@given(st.floats(-5.0, 5.0), st.floats(0.0, 5.0), layers, st.sampled_from(sorted(KINDS.values())))
def test_switching_functions_never_fall(surface, more, layer, kind):
    assert switch(kind, surface + more, layer) >= switch(kind, surface, layer)


@given(st.floats(-1e-3, 1e-3), layers)
def test_within_the_layer_the_smooth_ones_are_a_gain_of_one_over_phi(share, layer):
    surface = share * layer
    for kind in (SATURATION, TANH):
        assert switch(kind, surface, layer) == pytest.approx(surface / layer, rel=1e-6, abs=1e-300)


@pytest.mark.parametrize("name", ["sign", "saturation", "tanh"])
def test_far_outside_the_layer_all_of_them_are_the_sign(name):
    for surface in (-1e6, -30.0, 30.0, np.inf):
        assert switch(KINDS[name], surface, 1.0) == np.sign(surface)
