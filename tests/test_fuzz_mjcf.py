"""Models from anywhere: mutated wrists make a run or one line, and never end the process."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fuzzing import Command, emptied, examples, outcome
from rigs import mjcf
from spherical_wrist.wrist import default_model

SOURCES = (mjcf(), default_model().read_text())
WORDS = (
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e-320",
    "0",
    "-1",
    "1e9",
    "2147483648",
    "99999999999999999999",
    "word",
    "",
    "0 0 0",
    "1 2",
    "1 0 0 0 0 0 0 0 0",
    "true",
    "τ",
    "auto",
)
ELEMENTS = (
    "<include file='m.xml'/>",
    "<include file='none.xml'/>",
    "<freejoint/>",
    "<joint type='ball'/>",
    "<joint/>",
    "<geom size='1' mass='1'/>",
    "<geom type='mesh' mesh='none'/>",
    "<site name='tip'/>",
    "<inertial pos='0 0 0' mass='0'/>",
    "<frame><body/></frame>",
    "<body mocap='true'/>",
    "<replicate count='1000' offset='1 0 0'><geom size='1'/></replicate>",
    "<composite type='cable' count='5 1 1'/>",
    "<flexcomp name='f' type='grid' count='3 3 3' dim='3'/>",
    "<light/>",
    "<camera/>",
    "<attach model='m' body='b' prefix='p'/>",
    "<plugin plugin='mujoco.pid'/>",
    "<text>",
    "<!--",
    "&amp;",
    "&bad;",
)
SECTIONS = (
    "<asset><mesh name='a' file='none.stl'/></asset>",
    "<asset><mesh name='a' file='bad.stl'/></asset>",
    "<asset><mesh name='a' vertex='0 0 0 1 0 0 0 1 0 nan 0 1'/></asset>",
    "<asset><hfield name='h' nrow='100000' ncol='100000' size='1 1 1 1'/></asset>",
    "<asset><texture name='t' type='2d' builtin='flat' width='100000' height='100000'/></asset>",
    "<asset><hfield name='h' file='bad.stl' size='1 1 1 1'/></asset>",
    "<size memory='1'/>",
    "<size memory='10000G'/>",
    "<size nuserdata='2000000000'/>",
    "<option timestep='nan'/>",
    "<option timestep='0'/>",
    "<option gravity='nan 0 0'/>",
    "<option integrator='implicit'/>",
    "<option iterations='2000000000'/>",
    "<compiler settotalmass='1e-300'/>",
    "<compiler eulerseq='aaa'/>",
    "<compiler meshdir='/'/>",
    "<default class='x'/>",
    "<keyframe><key qpos='nan'/></keyframe>",
    "<contact><pair geom1='a' geom2='b'/></contact>",
    "<equality><weld body1='rotor'/></equality>",
    "<tendon><fixed><joint joint='w' coef='1'/></fixed></tendon>",
    "<sensor><user dim='1000000000'/></sensor>",
    "<sensor><gyro site='tip'/></sensor>",
    "<extension><plugin plugin='x'/></extension>",
    "<custom><numeric name='n' size='1000000000' data='1'/></custom>",
    "<statistic extent='nan'/>",
    "<visual><global offwidth='0'/></visual>",
)
VALUE = re.compile(r'(\w+)="([^"]*)"')
TAG = re.compile(r"<(\w+)\b[^<>]*?/?>")


@st.composite
def mutated(draw):
    """A wrist with some accidents, as bytes."""
    text = draw(st.sampled_from(SOURCES))
    for _ in range(draw(st.integers(1, 3))):
        text = draw(st.sampled_from(ACCIDENTS))(draw, text)
    encoding = draw(st.sampled_from(["utf-8"] * 20 + ["utf-16", "utf-8-sig", "latin-1"]))
    data = text.encode(encoding, errors="replace")
    if draw(st.integers(0, 19)) == 0:
        data = data[: draw(st.integers(0, len(data)))]
    if draw(st.integers(0, 19)) == 0:
        place = draw(st.integers(0, len(data)))
        data = data[:place] + draw(st.binary(min_size=1, max_size=8)) + data[place + draw(st.integers(0, 3)) :]
    return data


def one_of(draw, pattern, text):
    found = list(pattern.finditer(text))
    return found[draw(st.integers(0, len(found) - 1))] if found else None


def changed_number(draw, text):
    """One of the numbers, or the words, of an attribute."""
    found = one_of(draw, VALUE, text)
    if found is None or not found[2].split():
        return text
    words = found[2].split()
    words[draw(st.integers(0, len(words) - 1))] = draw(st.sampled_from(WORDS))
    return text[: found.start(2)] + " ".join(words) + text[found.end(2) :]


def changed_value(draw, text):
    found = one_of(draw, VALUE, text)
    return text if found is None else text[: found.start(2)] + draw(st.sampled_from(WORDS)) + text[found.end(2) :]


def lost_attribute(draw, text):
    found = one_of(draw, VALUE, text)
    return text if found is None else text[: found.start()] + text[found.end() :]


def doubled_attribute(draw, text):
    found = one_of(draw, VALUE, text)
    return text if found is None else text[: found.end()] + " " + found[0] + text[found.end() :]


def renamed_attribute(draw, text):
    found, other = one_of(draw, VALUE, text), one_of(draw, VALUE, text)
    return text if found is None else text[: found.start(1)] + other[1] + text[found.end(1) :]


def lost_tag(draw, text):
    found = one_of(draw, TAG, text)
    return text if found is None else text[: found.start()] + text[found.end() :]


def moved_tag(draw, text):
    found = one_of(draw, TAG, text)
    if found is None:
        return text
    rest = text[: found.start()] + text[found.end() :]
    place = one_of(draw, TAG, rest)
    return rest if place is None else rest[: place.end()] + found[0] + rest[place.end() :]


def doubled_tag(draw, text):
    found = one_of(draw, TAG, text)
    return text if found is None else text[: found.end()] + found[0] + text[found.end() :]


def added_element(draw, text):
    place = one_of(draw, TAG, text)
    return text if place is None else text[: place.end()] + draw(st.sampled_from(ELEMENTS)) + text[place.end() :]


def added_section(draw, text):
    return text.replace("</mujoco>", draw(st.sampled_from(SECTIONS)) + "</mujoco>", 1)


COMMON, RARE = [changed_number, changed_value], [lost_attribute, renamed_attribute, lost_tag, moved_tag, doubled_tag]
ACCIDENTS = [*4 * COMMON, *RARE, added_element, added_section, added_section, doubled_attribute]


@pytest.fixture(scope="module")
def command():
    made = Command()
    yield made
    made.close()


@examples(250)
@given(data=mutated())
def test_any_model_makes_a_run_or_one_line(command, tmp_path, data):
    folder = emptied(tmp_path / "f")
    (folder / "m.xml").write_bytes(data)
    (folder / "bad.stl").write_bytes(b"solid \0\xff" + bytes(100))
    outcome(command, "run", "--model", "m.xml", "--duration", "0.02", "-o", "a.rrd", cwd=folder, made=("a.rrd",))
