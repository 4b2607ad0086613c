"""Every parameter of a part acts: another value of it changes the run, or the motion.

The parameters are those of every registered sensor, motor, disturbance and reference, and of the plant. A new part
joins by being defined, and a new parameter by being declared.
"""

from importlib import import_module
from itertools import product
from pkgutil import iter_modules
from typing import Annotated, Any, Literal, get_args, get_origin
from unittest import mock

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spherical_wrist import Experiment, simulate
from spherical_wrist.actuation import Actuation
from spherical_wrist.disturbance import Disturbance
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.description import PARTS
from spherical_wrist.parameters import NonNegative, Parameters, matters, quantity
from spherical_wrist.prepare.plant import Perturbation
from spherical_wrist.reference import Reference
from spherical_wrist.sensing import Ideal, Sensing

HARDWARE = [*Sensing.members.values(), *Actuation.members.values()]


def parameters_of(parts):
    """Every parameter of every part."""
    return [(part, name) for part in parts for name in part.model_fields]


TIME = np.linspace(0.0, 20.0, 4001)


def label(value):
    return value if isinstance(value, str) else f"{value.kind} {value.name}"


def needed(part: type[Parameters], name: str, given: dict[str, Any]) -> dict[str, Any]:
    """Values of other parameters, beside those given, with which a parameter acts by its own declaration."""
    if matters(part, name, given):
        return {}
    for other, value in part.model_fields[name].json_schema_extra["acts_with"].items():
        for candidate in others(part, other, given) if value is True else [value]:
            more = {other: candidate}
            if matters(part, name, {**given, **more}):
                return {**needed(part, other, {**given, **more}), **more}
    raise AssertionError(f"{part.__name__}.{name} acts with nothing that can be set")


def others(part: type[Parameters], name: str, given: dict[str, Any]) -> list[Any]:
    """Other valid values of a parameter, from its annotation and its value."""
    field = part.model_fields[name]
    default = given.get(name, field.default)
    found = []
    for value in candidates(field.annotation, default):
        try:
            one = getattr(part(**{**given, name: value}), name)
        except ParameterError:
            continue
        if one != getattr(part(**given), name):
            found.append(value)
    assert found, f"no other value of {part.__name__}.{name} is known: teach this test its type"
    return found


def candidates(annotation: Any, value: Any) -> list[Any]:
    """Values worth a try for a type."""
    if get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    if get_origin(annotation) is Literal:
        return list(get_args(annotation))
    if value is None and any(get_origin(each) is Literal for each in get_args(annotation)):
        return [word for each in get_args(annotation) for word in get_args(each)]
    if annotation is bool:
        return [not value]
    if isinstance(value, tuple) and value:
        return [tuple(scaled(value, size)) for size in (1.5, 0.5)] + [tuple(plus(value))]
    if isinstance(value, tuple):
        return [(1,), 0.3]
    if isinstance(value, int) and not isinstance(value, bool):
        return [value + step for step in (1, 2, -1, -2)]
    if isinstance(value, float) and value:
        return [1.5 * value, 0.5 * value, 0.1 * value]
    inner = [each for each in get_args(annotation) if each is not type(None)]
    return [0.3, 7] if value is None and inner else [0.3]


def scaled(value: tuple[Any, ...], size: float) -> list[Any]:
    return [tuple(scaled(each, size)) if isinstance(each, tuple) else size * each for each in value]


def plus(value: tuple[Any, ...]) -> list[Any]:
    return [0.2 + 0.1 * k + each if isinstance(each, float) else each for k, each in enumerate(value)]


def outcome(**experiment: Any) -> dict[str, bytes]:
    """All arrays and metrics of a short run, as bytes."""
    run = simulate(Experiment(duration=0.3, seed=1, **experiment))
    arrays = {name: array.tobytes() for name, array in run.channels.items()}
    return {**arrays, "metrics": repr(dict(run.metrics)).encode()}


def assert_acts(part: type[Parameters], name: str) -> None:
    """Fails where no other value of the parameter changes anything in a run.

    Both runs go through the model of the faults: alone that a part is not ideal adds what is measured to a run.
    """
    given = needed(part, name, {})
    family = Sensing if issubclass(part, Sensing) else Actuation
    with mock.patch.object(family, "ideal", property(lambda _: False)):
        before = outcome(**{part.kind: part(**given)})
        values = others(part, name, given)
        changed = any(outcome(**{part.kind: part(**{**given, name: value})}) != before for value in values)
    assert changed, f"{part.__name__}.{name} is declared, and nothing in a run depends on it"


@pytest.mark.parametrize(("part", "name"), parameters_of(HARDWARE), ids=label)
def test_every_parameter_of_sensors_and_motors_changes_the_run(part, name):
    assert_acts(part, name)


@pytest.mark.parametrize(("part", "name"), parameters_of(HARDWARE), ids=label)
def test_a_parameter_of_sensors_and_motors_is_random_exactly_where_the_run_depends_on_the_seed(part, name):
    """So that comparisons run every seed of a random case, and only these."""
    given = needed(part, name, {})
    one = part(**{**given, name: others(part, name, given)[0]})
    run = {part.kind: one, "law": "pd", "duration": 0.05}
    first, second = (simulate(Experiment(seed=seed, **run)).attitude.tobytes() for seed in (1, 2))
    assert one.is_random == (first != second)


@pytest.mark.parametrize(("part", "name"), parameters_of(Disturbance.members.values()), ids=label)
def test_every_parameter_of_a_disturbance_changes_the_torque(part, name):
    def torque(given):
        disturbance = part(**given)
        return disturbance.torque(0.01, np.random.default_rng(1), lambda: lambda time: np.ones((len(time), 3)))(
            TIME
        ).tobytes()

    given = needed(part, name, {})
    assert all(torque({**given, name: value}) != torque(given) for value in others(part, name, given))


@pytest.mark.parametrize("name", Perturbation._fields)
def test_every_parameter_of_the_plant_changes_the_run(name):
    before = outcome()
    assert all(outcome(**{name: value}) != before for value in others(Experiment, name, {}))


# --- references


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Recorded motions: one with a gap, and one of two different arms."""
    folder = tmp_path_factory.mktemp("motions")
    time = np.delete(np.arange(301) * 0.01, np.s_[100:130])

    def turned(size):
        return Rotation.from_rotvec(np.outer(np.sin(2.0 * np.pi * 0.5 * time), [size, 0.2, -0.1]))

    rows = np.column_stack([time, turned(0.3).as_quat(scalar_first=True)])
    np.savetxt(folder / "gap.csv", rows, delimiter=",", header="t,w,x,y,z", comments="")
    np.savetxt(folder / "times.txt", 1.1 * time)
    np.savetxt(folder / "other.csv", rows[:, [0, 1, 3, 2, 4]], delimiter=",", header="t,w,x,y,z", comments="")
    still = np.zeros((len(time), 3))
    arms = [
        np.hstack([still, turned(0.1 * k).as_matrix().reshape(-1, 9), still, still, still[:, :1]]) for k in range(1, 5)
    ]
    np.savetxt(folder / "arms.txt", np.hstack(arms), fmt="%14.6f")
    return folder


SETTINGS = {"recorded": {"file": "gap.csv"}, "recorded.arm": {"file": "arms.txt"}}
"""Parameters without which a reference has no motion, or none that a parameter acts on."""
VALUES = {"file": "other.csv", "times": "times.txt", "columns": "time=t, w=w, x=y, y=x, z=z"}
"""Other values of parameters that are files or texts."""


@pytest.mark.parametrize(("reference", "name"), parameters_of(Reference.members.values()), ids=label)
def test_every_parameter_of_a_reference_changes_the_motion(reference, name, files):
    given = SETTINGS.get(f"{reference.name}.{name}", SETTINGS.get(reference.name, {}))
    given = {key: str(files / value) for key, value in given.items()}
    given = {**given, **needed(reference, name, given)}
    if name in VALUES:
        values = [str(files / VALUES[name]) if name in ("file", "times") else VALUES[name]]
    else:
        values = others(reference, name, given)
    before = motion_of(reference, given)
    assert any(motion_of(reference, {**given, name: value}) != before for value in values)


def motion_of(reference, given):
    """The motion as bytes, or the error where the parameters refuse the file."""
    try:
        return reference(**given).motion(TIME).tobytes()
    except ParameterError as error:
        return str(error)


@pytest.mark.parametrize("family", PARTS.values(), ids=lambda family: family.kind)
def test_every_part_that_is_written_is_registered(family):
    """In its room, whose package imports it, so that it is known wherever the room is."""
    room = import_module(f"spherical_wrist.{family.__module__.split('.')[1]}")
    modules = [
        room,
        *(import_module(each.name) for each in iter_modules(getattr(room, "__path__", ()), f"{room.__name__}.")),
    ]
    written = {
        each
        for module in modules
        for each in vars(module).values()
        if isinstance(each, type) and issubclass(each, family) and each is not family and "abstract" not in vars(each)
    }
    assert written == set(family.members.values()) - {Forgotten}
    assert not [each.__name__ for each in written if not hasattr(room, each.__name__)]


# --- the test of the test, and of what is ideal


class Forgotten(Ideal):
    """Sensors with a fault that nobody applies."""

    drift: NonNegative = quantity(0.0, "rad/s", "drift of the attitude")


def test_a_fault_that_nobody_applies_is_found():
    with pytest.raises(AssertionError, match=r"Forgotten\.drift is declared, and nothing in a run depends on it"):
        assert_acts(Forgotten, "drift")
    assert_acts(Forgotten, "delay")


def test_a_fault_that_is_on_is_not_ideal_whoever_declares_it():
    assert Forgotten().ideal
    assert not Forgotten(drift=0.1).ideal


@pytest.mark.parametrize("part", HARDWARE, ids=label)
def test_a_part_is_ideal_exactly_where_nothing_acts(part):
    """A parameter that does not matter leaves ideal hardware ideal, and its run the same to the last bit."""
    assert part().ideal == (part.name == "ideal")
    for name in part.model_fields if part().ideal else ():
        for value in others(part, name, {}):
            one = part(**{name: value})
            assert one.ideal != matters(part, name, {})
            if one.ideal:
                assert outcome(**{part.kind: one})["attitude"] == outcome()["attitude"]


def test_values_of_a_recording_tell_what_matters_too():
    """Lists for tuples, one number for three, and no value at all."""
    told = Sensing(delay=1e-3).model_dump(mode="json")
    assert matters(Sensing, "timestamped", told)
    assert not matters(Sensing, "timestamped", {**told, "delay": 0})
    assert not matters(Sensing, "rate_filter", {})
    assert matters(Disturbance, "level", {"amplitude": None})
    assert not matters(Disturbance, "level", {"amplitude": 0.01})
    assert Sensing(rate_bias=[0.0, 0.0, 1e-9]).acting == ("rate_bias",)
    for delay, loss, rate in product((0.0, 1e-3), (0.0, 0.1), ("measured", "estimated")):
        given = {"delay": delay, "loss": loss, "rate": rate}
        assert matters(Sensing, "timestamped", given) == (bool(delay or loss) or rate == "estimated")


@pytest.mark.parametrize(
    "member", [each for family in PARTS.values() for each in family.members.values()], ids=lambda m: m.name
)
def test_what_is_worked_out_once_is_no_parameter(member):
    part = member(**({"file": "motion.csv"} if "file" in member.model_fields else {}))
    assert part.acting == part.acting
    assert dict(part).keys() == type(part).model_fields.keys()
