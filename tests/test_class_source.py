"""Classes that no file is named for: their source is recorded, and a replay of it is the same to the last bit."""

import linecache
import subprocess
import sys
import textwrap
import warnings
from types import ModuleType

import numpy as np
import pytest

from rigs import one_line
from spherical_wrist import Experiment, load_recording, record, simulate
from spherical_wrist.class_source import SourceError, class_source
from spherical_wrist.inspection.replay import replay

SCRIPT = """
import math
import numpy as np
from typing import Annotated, ClassVar
from pydantic import Field
import my_gains
from my_gains import twice
from spherical_wrist import Experiment, record, simulate
from spherical_wrist.control import Law, LawState, choice
from spherical_wrist.disturbance import Disturbance
from spherical_wrist.parameters import Positive, quantity
from spherical_wrist.reference import Reference, motion_of
from spherical_wrist.sensing import Sensing

DAMPING, AXIS = 0.02, np.array([0.6, 0.0, 0.8])
Small = Annotated[float, Field(lt=1.0)]
TABLE = {"pi": (np.pi, [1, float("inf")]), 2: np.float32(0.5)}


def clip(value, most):
    return most if value > most else -most if value < -most else value


class Base(Law):
    '''Stiffness.'''

    stiffness: Positive = quantity(0.2, "N·m/rad", "stiffness")
    small: Small = 0.5
    note: ClassVar[str] = "a"


class Mine(Base):
    damping: float = DAMPING

    class State(LawState):
        count: float = 0.0

    @staticmethod
    def step(signal, parameters, state, command):
        state.count += math.sqrt(1.0)
        for i in range(3):
            torque = my_gains.STIFFNESS * signal.error[i] + twice(parameters.damping) * signal.rate_error[i]
            command.torque[i] = clip(torque, 0.3)


class Spiral(Reference):
    growth: float = 0.05

    def motion(self, time):
        w = TABLE["pi"][0] * 2 * TABLE[2]
        angle = self.growth * time * np.sin(w * time)
        rate = self.growth * (np.sin(w * time) + time * w * np.cos(w * time))
        acceleration = self.growth * (2 * w * np.cos(w * time) - time * w**2 * np.sin(w * time))
        half = 0.5 * angle[:, None]
        attitude = np.hstack([np.cos(half), np.sin(half) * AXIS])
        return motion_of(attitude, rate[:, None] * AXIS, acceleration[:, None] * AXIS)


class Kick(Disturbance):
    def shape(self, random):
        sign = random.choice([-1.0, 1.0], 3)
        return lambda time: np.where(np.abs(time - 0.05) < 0.02, 1.0, 0.0)[:, None] * sign


run = simulate(Experiment(duration=0.1, law=Mine(damping=0.03), reference=Spiral(), disturbance=Kick(amplitude=0.01)))
record(run, "run.rrd")
"""
GAINS = "STIFFNESS = 0.2\n\n\ndef twice(x):\n    return 2.0 * x\n"


def test_a_script_is_replayed_elsewhere(tmp_path):
    """Its classes come in files of their own: what else the script does is not done again."""
    (tmp_path / "script.py").write_text(SCRIPT)
    (tmp_path / "my_gains.py").write_text(GAINS)
    done = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    (tmp_path / "script.py").unlink()
    (tmp_path / "my_gains.py").unlink()
    run = load_recording(tmp_path / "run.rrd", trust=True)
    law = run.embedded_files.files["law/mine.py"].decode()
    assert "simulate" not in law
    assert set(run.embedded_files.files) == {
        "model/wrist.xml", "law/mine.py", "law/my_gains.py", "reference/spiral.py", "disturbance/kick.py",
    }  # fmt: skip
    assert run.description["law"] == {"name": "mine.py:Mine", "stiffness": 0.2, "small": 0.5, "damping": 0.03}
    assert replay(tmp_path / "run.rrd", trust=True).identical


CELLS = (
    "import numpy as np\nfrom spherical_wrist.control import Law\nGAIN = 0.1",
    "GAINS = np.full(3, GAIN)",
    """
    class Mine(Law):
        stiffness: float = 0.2

        @staticmethod
        def step(signal, parameters, state, command):
            for i in range(3):
                command.torque[i] = parameters.stiffness * signal.error[i] + GAINS[i] * signal.rate_error[i]
    """,
    "GAINS = np.full(3, 0.02)",
)


@pytest.fixture
def notebook(monkeypatch):
    """A namespace in which cells are run, as a notebook does it."""
    module = ModuleType("notebook_of_mine")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    number = 0

    def run(cell, known=True):
        nonlocal number
        number += 1
        text, file = textwrap.dedent(cell).strip() + "\n", f"<cell {number}>"
        if known:
            monkeypatch.setitem(linecache.cache, file, (len(text), None, text.splitlines(keepends=True), file))
        exec(compile(text, file, "exec"), vars(module))
        return vars(module)

    return run


def test_the_cells_of_a_notebook_are_replayed_with_the_values_that_they_had(notebook, tmp_path):
    for cell in CELLS:
        scope = notebook(cell)
    run = simulate(Experiment(duration=0.05, law=scope["Mine"]()))
    notebook("GAINS = np.full(3, 0.9)")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        record(run, tmp_path / "run.rrd")
    assert replay(tmp_path / "run.rrd", trust=True).identical
    assert load_recording(tmp_path / "run.rrd", trust=True).experiment.law.name == "mine"


HOLDER = "class Holder:\n    def f(self):\n        return thing"


@pytest.mark.parametrize(
    ("cells", "known", "reason"),
    [
        ((HOLDER,), False, "the source of 'Holder' is not known"),
        (("class A: pass", "thing = A()", HOLDER, "del A"), True, "does not stand alone: name 'A' is not defined"),
        (("class A: pass", "globals()['thing'] = A()", HOLDER), True, "'thing' is a A, which cannot be written down"),
        (("thing = list(range(10**6))", HOLDER, "thing[0] = 1"), True, None),
        (("import numpy as np", "thing = np.array(['a'])", HOLDER), True, "too large, or not of numbers"),
        (("import numpy as np", "thing = np.zeros(10**6)", HOLDER), True, "too large, or not of numbers"),
        (("class A: pass", "thing = A()", HOLDER), True, None),
        (("from functools import partial as p", "thing = p(max, 1)", HOLDER), True, None),
        (("thing = open", HOLDER), True, None),
        (("from math import sqrt as thing", HOLDER), True, None),
        (("import os.path as thing", HOLDER), True, None),
        (("def g(n): return g(n - 1) + h(n) if n else 1\ndef h(n): return g(n - 1)", "thing = g", HOLDER), True, None),
    ],
)
def test_what_cannot_be_written_down_is_said(notebook, cells, known, reason):
    for cell in cells:
        scope = notebook(cell, known)
    if reason is None:
        again = {}
        exec(class_source(scope["Holder"])[0], again)
        assert type(again["Holder"]().f()).__name__ == type(scope["Holder"]().f()).__name__
        return
    with pytest.raises(SourceError) as error:
        class_source(scope["Holder"])
    assert reason in one_line(error.value)


def test_a_run_whose_law_cannot_be_carried_is_recorded_with_a_warning(notebook, tmp_path):
    for cell in CELLS:
        scope = notebook(cell, known=False)
    run = simulate(Experiment(duration=0.05, law=scope["Mine"]()))
    with pytest.warns(UserWarning, match="cannot be replayed elsewhere: it has no source of its law"):
        record(run, tmp_path / "run.rrd")
    assert load_recording(tmp_path / "run.rrd").description["law"]["name"] == "mine"


def test_constants_are_read_as_the_same_values(notebook):
    values = (1, -0.0, 1e-320, float("inf"), True, None, "a\n'\"", b"\0", (1,), (), [[]], {"a": {1: (2.5,)}})
    arrays = (
        np.arange(6.0).reshape(2, 3),
        np.array([np.nan, np.inf]),
        np.float32(0.1),
        np.zeros((0, 3), dtype=np.int8),
    )
    notebook("values = arrays = None\nclass Holder:\n    def f(self):\n        return values, arrays")
    scope = notebook("pass")
    scope["values"], scope["arrays"] = values, arrays
    text, _ = class_source(scope["Holder"])
    again = {}
    exec(text, again)
    got_values, got_arrays = again["Holder"]().f()
    assert repr(got_values) == repr(values)
    for got, array in zip(got_arrays, arrays, strict=True):
        assert (got.dtype, got.shape, got.tobytes()) == (array.dtype, array.shape, array.tobytes())
