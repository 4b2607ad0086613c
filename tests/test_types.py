"""Types accept what README and guides write, and what people write like it, and refuse what is wrong.

Checked by mypy, strict, and by Pylance's engine, as a user has them: without this package's own settings and plugins.
Functions without annotations are the reader's style, and allowed; their bodies are checked.
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import spherical_wrist
from sampling import long
from spherical_wrist.guides import NAMES, read_guide

pytestmark = [pytest.mark.slow, long]  # a minute on a cold cache; .ci/run asks for it
ROOT = Path(__file__).parents[1]
SOURCE = Path(spherical_wrist.__file__).parents[1]
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)
FILE = re.compile(r"#\s*([\w./]+\.py)\b")

UNTYPED = {"learning"}
"""Guides that make an environment by its name, of which Gymnasium's types know no attributes."""

RIGHT = """
import numpy as np

import spherical_wrist as sw
from spherical_wrist import Experiment
from spherical_wrist.assertions import RandomWrists, WristGrid, assert_tracks
from spherical_wrist.control import PD, Command, ComputedTorque, Signal
from spherical_wrist.disturbance import Noise
from spherical_wrist.parameters import Vector, quantity
from spherical_wrist.reference import Lissajous


class Mine(sw.Law):
    gain: float = 0.3
    pull: Vector = quantity(0.1, "N·m", "a vector from one number")

    @staticmethod
    def step(signal, parameters, state, command):
        for i in range(3):
            command.torque[i] = parameters.gain * signal.error[i]


class Annotated(sw.Law):
    @staticmethod
    def step(signal: Signal, parameters: object, state: object, command: Command) -> None:
        command.torque[0] = signal.error[0]


experiment = Experiment(law="pd", disturbance=0.25)
Experiment(law=Mine(gain=0.2), com_shift=0.1, motors="A,B,C", model="x.xml", duration="whole", hardware="realistic")
Experiment(law=ComputedTorque, com_shift=np.array([0.0, 0.0, 0.1]), reference={"name": "lissajous", "amplitude": 0.3})
Experiment(law=ComputedTorque(Kp=10000, Kv=200), disturbance=Noise(level=0.2), reference=Lissajous)
print(PD(P=(0.1, 0.2, 0.3), D=0.1).P[0] + experiment.com_shift[1], Lissajous(amplitude=0.4, frequency=[1.0, 1.1, 1.2]))
assert_tracks(Mine, max_tip_error_mm=0.1, family=WristGrid(com_shift=((0.0, 0.0, 0.0),), payload=(0.0, 0.01)))
assert_tracks("pd", rms_error_rad=0.1, family=RandomWrists(samples=20, payload=(0.0, 0.01)), experiment=experiment)
run = sw.simulate("pd", disturbance=0.25, duration=4)
assert run.metrics.max_tip_error_mm < 0.1
assert sw.simulate(experiment, duration=2.0).outcome.status == "completed"
found = sw.compare(["pd", Mine(), "slotine_li", Mine, {"name": "pd"}], cases="default", progress=True, jobs=2)
found.plot().savefig("found.pdf")
print(found.to_pandas().describe(), found.to_xarray().sizes, found.save("found.csv").name.upper())
sw.compare({"mine": Mine, "theirs": "pd"}, cases={"late": {"sensing.delay": 0.002}})
sw.frontier("pd", axes=["delay"], bounds={"max_tip_error_mm": 0.1}).save("frontier.png")
sw.margins(["pd"], at=1.0)
sw.sweep(["pd", Mine()], vary={"mass_scale": {"uniform": [0.5, 1.5]}}, samples=10, seed=3).run(3).save("worst.rrd")
print(sw.load_recording("worst.rrd").error[0], sw.__version__.split("."))
"""

WRONG = (
    'sw.simulat("pd")',
    'sw.simulate("pd", lenght=3)',
    'Experiment(law="pd", disturbanc=0.2)',
    'Experiment(mass_scale="heavy")',
    'sw.compare(["pd", 3])',
    'sw.sweep("pd", vary={}, design="soboll")',
    'PD(P="stiff")',
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The Python of README and guides as files: those that are named, and the rest of each document together."""
    out = tmp_path_factory.mktemp("typed")
    texts = {"readme": (ROOT / "README.md").read_text(encoding="utf-8")}
    for name, text in {**texts, **{name: read_guide(name).text for name in NAMES if name not in UNTYPED}}.items():
        blocks = BLOCK.findall(text)
        for block in blocks:
            if named := FILE.match(block):
                (out / named[1]).write_text(block)
        rest = [block for block in blocks if not FILE.match(block)]
        (out / f"document_{name}.py").write_text("\n".join(rest))
    (out / "right.py").write_text(RIGHT)
    (out / "wrong.py").write_text("\n".join([RIGHT.partition("\nclass")[0], *WRONG]))
    lines = ["[mypy]", "strict = true", "disallow_untyped_defs = false", "disallow_incomplete_defs = false"]
    lines += ["disallow_untyped_calls = false", "[mypy-mujoco.*,scipy.*,pandas.*]", "ignore_missing_imports = true"]
    (out / "mypy.ini").write_text("\n".join(lines))
    settings = {"typeCheckingMode": "standard", "extraPaths": [str(SOURCE)], "include": ["."]}
    (out / "pyrightconfig.json").write_text(json.dumps(settings))
    return out


def mypy(folder):
    """Return the complaints of mypy as file and line."""
    command = ["mypy", "--no-pretty", "--hide-error-context", "--cache-dir", ROOT / ".mypy_cache" / "users", "."]
    return complaints(folder, command, r"^(\w+\.py):(\d+): error: ", {"MYPYPATH": str(SOURCE)})


def pyright(folder):
    """Return the complaints of Pylance's engine as file and line."""
    command = ["basedpyright", "--pythonpath", sys.executable, "-p", "."]
    return complaints(folder, command, r"(\w+\.py):(\d+):\d+ - error: ", {})


def complaints(folder, command, pattern, more):
    environment = {**os.environ, "NO_COLOR": "1", **more}
    done = subprocess.run(
        [sys.executable, "-m", *map(str, command)],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode in (0, 1), done.stdout + done.stderr
    found = re.findall(pattern, done.stdout, re.MULTILINE)
    print(done.stdout)  # pytest shows it where a test fails
    return [(file, int(line)) for file, line in found]


@pytest.mark.parametrize("checker", [mypy, pyright], ids=["mypy", "pyright"])
def test_types_accept_what_is_right_and_refuse_what_is_wrong(folder, checker):
    found = checker(folder)
    assert not [each for each in found if each[0] != "wrong.py"]
    lines = (folder / "wrong.py").read_text().splitlines()
    assert {lines[line - 1] for _, line in found} == set(WRONG)
