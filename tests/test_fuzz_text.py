"""Experiments, suites, campaigns and settings from anywhere make a result or one line."""

import json

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fuzzing import Command, emptied, examples, outcome

BASES = {
    "run": {
        "law": {"name": "fuzzy_sliding_computed_torque", "K": [0.05, 0.05, 0.03]},
        "reference": {"name": "beating_heart", "premature": 0.1},
        "disturbance": {"name": "noise", "level": 0.25},
        "sensing": {"name": "realistic", "delay": 0.0015},
        "actuation": {"name": "spherical_motor", "failed": [3]},
        "mass_scale": 1.2, "com_shift": [0.0, 0.0, 0.001], "payload": 0.01, "friction": 1e-4, "damping": 1e-4,
        "duration": 0.02, "control_period": 0.001, "physics_period": 0.001, "steady_from": 0.01, "seed": 3,
    },
    "compare": {"case": [{"name": "a", "meaning": "b", "mass_scale": 1.5, "sensing": {"delay": 0.002}}, {"name": "c"}]},
    "sweep": {
        "laws": ["pd", {"name": "computed_torque", "Kp": 100}], "samples": 2, "design": "sobol", "seed": 1, "batch": 2,
        "hardware": "realistic", "experiment": {"duration": 0.02, "disturbance": {"name": "noise", "level": 0.2}},
        "vary": {"mass_scale": {"uniform": [0.5, 1.5]}, "com_shift.x": {"normal": [0.0, 0.001]}, "payload": [0, 0.01]},
    },
}  # fmt: skip
COMMANDS = {
    "run": ("run", "f.toml", "-o", "a.rrd"),
    "compare": ("compare", "--cases", "f.toml", "--law", "pd", "--duration", "0.02"),
    "sweep": ("sweep", "f.toml", "-o", "c", "--workers", "0", "--threads", "1"),
}
NUMBERS = st.one_of(
    st.sampled_from([0, -1, 1, 2**63, -(2**63), 10**30, 0.0, -0.0, 1e308, -1e308, 5e-324, 1e-9, 1e9, 1.5, 1000]),
    st.sampled_from([float("nan"), float("inf"), -float("inf")]),
    st.floats(1e-6, 10.0),
)
TEXTS = st.one_of(
    st.text(max_size=8), st.sampled_from(["pd", "hold", "recorded", "none.py:Law", "/", "~", "\0", "a.b"])
)
PLAIN = st.one_of(NUMBERS, TEXTS, st.booleans())
VALUES = st.one_of(
    PLAIN, st.lists(PLAIN, max_size=4), st.dictionaries(TEXTS, PLAIN, max_size=3),
    st.just([]), st.just({}), st.integers(2, 300).map(lambda depth: json.loads("[" * depth + "]" * depth)),
)  # fmt: skip


def toml(value):
    """A value in TOML."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "{" + ", ".join(f"{toml(str(key))} = {toml(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, str):
        return json.dumps(value).replace("\x7f", "\\u007f")
    return repr(value)


def places(value, path=()):
    """Every place in nested tables and lists."""
    for key, each in value.items() if isinstance(value, dict) else enumerate(value):
        yield (*path, key)
        if isinstance(each, dict | list):
            yield from places(each, (*path, key))


@st.composite
def documents(draw, base):
    """A valid file in which values are changed, lost, renamed and added; as bytes, sometimes damaged."""
    table = json.loads(json.dumps(base))
    for _ in range(draw(st.integers(1, 3))):
        found = list(places(table))
        if not found:
            break
        *path, key = draw(st.sampled_from(found))
        owner = table
        for each in path:
            owner = owner[each]
        what = draw(st.sampled_from(["change", "change", "change", "lose", "rename", "add"]))
        if what == "change":
            owner[key] = draw(VALUES)
        elif what == "lose":
            del owner[key]
        elif isinstance(owner, dict):
            owner[draw(TEXTS)] = owner.pop(key) if what == "rename" else draw(VALUES)
    text = "".join(f"{toml(key)} = {toml(each)}\n" for key, each in table.items())
    try:
        data = text.encode(draw(st.sampled_from([*["utf-8"] * 12, "utf-8-sig", "utf-16", "latin-1"])), errors="replace")
    except UnicodeEncodeError:
        data = text.encode("utf-8", errors="surrogatepass")
    if draw(st.integers(0, 14)) == 0:
        place = draw(st.integers(0, len(data)))
        data = data[:place] + draw(st.binary(max_size=4)) + data[place + draw(st.integers(0, 40)) :]
    return data


@pytest.fixture(scope="module")
def command():
    made = Command()
    yield made
    made.close()


def check(command, folder, kind, data):
    folder = emptied(folder / "f")
    (folder / "f.toml").write_bytes(data)
    outcome(command, *COMMANDS[kind], cwd=folder, made=("a.rrd", "c"))


@examples(150)
@given(data=documents(BASES["run"]))
@example(data=b"")
@example(data=b"\xef\xbb\xbfduration = 0.02")
@example(data=b"x = " + b"[" * 100_000)
@example(data=b"physics_period = 1e-320")
@example(data=b"duration = 0.02\ncom_shift = 1e308")
@example(data=b"duration = 0.02\nmass_scale = 1e308")
@example(data=b"duration = 0.02\npayload = 1e308")
def test_any_experiment(command, tmp_path, data):
    check(command, tmp_path, "run", data)


@examples(60)
@given(data=documents(BASES["compare"]))
@example(data=b"case = []")
def test_any_suite_of_cases(command, tmp_path, data):
    check(command, tmp_path, "compare", data)


@examples(40)
@given(data=documents(BASES["sweep"]))
def test_any_campaign(command, tmp_path, data):
    check(command, tmp_path, "sweep", data)


@examples(60)
@given(
    name=st.one_of(
        TEXTS, st.sampled_from(["law.K", "law", "seed", "duration", "model", "reference.amplitude", "law.name"])
    ),
    value=st.one_of(VALUES.map(toml), TEXTS),
)
def test_any_setting(command, tmp_path, name, value):
    text = f"{name}={value}".replace("\0", "").encode(errors="replace").decode()
    outcome(command, "run", "--duration", "0.02", "--no-recording", "--set", text, cwd=emptied(tmp_path / "f"))
