"""Layout of the package: imports go downwards, and each library is imported in its own rooms."""

import ast
import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import mujoco
import numpy as np
import pytest

import spherical_wrist
from rigs import one_line
from spherical_wrist.campaign.digest import SHOWING
from spherical_wrist.compat import MissingPartError, private, supported
from spherical_wrist.compat.libmujoco import address_of

ROOT = Path(spherical_wrist.__file__).parent
LEVELS = (
    {
        "arrays", "errors", "channels", "colours", "consent", "plain_text", "picture_axes", "picture_file",
        "picture_style", "memory", "missing_package", "result", "result_table", "seal", "so3", "stages", "versions",
        "package_files",
    },
    {"files", "folder_lock", "compat"},
    {"parameters", "user_file", "class_source", "wrist"},
    {"dynamics", "kinematics", "fuzzy", "reference", "disturbance", "sensing", "actuation"},
    {"control"},
    {"measure"},
    {"loop", "experiment"},
    {"prepare"},
    {"simulation"},
    {"recording"},
    {"inspection", "campaign", "film"},
    {"comparison", "assertions", "tuning", "design", "report", "paper", "stability"},
    {"environment", "guides", "api"},
    {"cli"},
    {"__main__"},
)  # fmt: skip
"""Rooms of the package, lowest level first. A room imports from its own level and from those below."""
LEVEL = {room: level for level, rooms in enumerate(LEVELS) for room in rooms}
ROOMS_OF_LIBRARY = {
    "numba": {"compat", "loop"},
    "llvmlite": {"compat", "loop"},
    "ctypes": {"compat", "loop", "recording"},
    "rerun": {"compat", "recording"},
    "pyarrow": {"reference", "campaign", "inspection", "recording", "compat", "api"},
    "duckdb": {"campaign", "report"},
    "dask": {"campaign"},
    "distributed": {"campaign"},
    "typer": {"cli"},
    "jinja2": {"report"},
    "markupsafe": {"report"},
    "optuna": {"tuning"},
    "cmaes": {"design"},
    "control": {"stability"},
    "slycot": {"stability"},
    "av": {"film"},
    "PIL": {"film"},
    "gymnasium": {"environment"},
    "matplotlib": {
        "picture_axes", "picture_file", "fuzzy", "inspection", "film", "paper", "comparison", "stability", "tuning",
        "report", "result", "api",
    },
}  # fmt: skip
"""Libraries that only these rooms import."""
PRIVATE = ("rerun_bindings", "rerun.error_utils", "rerun.experimental", "distributed.core", "distributed.comm.core")
"""Modules of libraries that are private or without a promise, though their names do not say so."""
PUBLIC = {"_replace", "_asdict", "_fields", "_make", "_exit"}
"""Public names that begin with an underscore: of named tuples, and of ``os``."""


@cache
def tree(path):
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def imports():
    """Return every import as (file, room of the file, dotted name); relative ones begin with a dot."""
    found = []
    for path in sorted(ROOT.rglob("*.py")):
        file = path.relative_to(ROOT)
        for node in ast.walk(tree(path)):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                names = [f"{'.' * node.level}{node.module or ''}"]
                if node.module == "spherical_wrist":
                    names += [f"spherical_wrist.{alias.name}" for alias in node.names]
            found += [(str(file), file.parts[0].removesuffix(".py"), name) for name in names]
    return found


def test_imports_are_absolute():
    assert not [(file, name) for file, _, name in imports() if name.startswith(".")]


def test_every_room_has_a_level():
    rooms = {path.relative_to(ROOT).parts[0].removesuffix(".py") for path in ROOT.rglob("*.py")} - {"__init__"}
    assert rooms == set(LEVEL)


def test_imports_go_downwards():
    inner = [(file, room, name.split(".")[1]) for file, room, name in imports() if name.startswith("spherical_wrist.")]
    assert len(inner) > 500
    assert not [
        f"{file} imports {target}" for file, room, target in inner if room in LEVEL and LEVEL[target] > LEVEL[room]
    ]


def test_libraries_are_imported_in_their_rooms_only():
    used = [(file, room, name.split(".")[0]) for file, room, name in imports()]
    assert {library for *_, library in used} >= set(ROOMS_OF_LIBRARY)
    assert not [
        f"{file} imports {library}"
        for file, room, library in used
        if library in ROOMS_OF_LIBRARY and room not in ROOMS_OF_LIBRARY[library]
    ]


def test_control_is_independent_of_the_physics_engine():
    allowed = {"channels", "control", "errors", "parameters", "fuzzy", "so3"}
    used = [(file, name) for file, room, name in imports() if room == "control"]
    assert not [(file, name) for file, name in used if name.split(".")[0] == "mujoco"]
    assert not [
        (file, name) for file, name in used if name.startswith("spherical_wrist.") and name.split(".")[1] not in allowed
    ]


def private_uses(tree):
    """Private names of other objects, and imports of private modules; those of the standard library do not count."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr.startswith("_") and not node.attr.startswith("__"):
            own = isinstance(node.value, ast.Name) and node.value.id in ("self", "cls")
            if not own and node.attr not in PUBLIC:
                yield ast.unparse(node)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            names = [f"{getattr(node, 'module', None) or ''}.{alias.name}".lstrip(".") for alias in node.names]
            for name in names:
                if name.partition(".")[0] in sys.stdlib_module_names:
                    continue
                if name.startswith(PRIVATE) or any(part.startswith("_") for part in name.split(".")):
                    yield name


def test_private_parts_of_libraries_are_used_in_the_compatibility_room_only():
    assert set(private_uses(ast.parse("a._b; self._c; d._replace; from x import _y; import rerun_bindings"))) == {
        "a._b", "x._y", "rerun_bindings",
    }  # fmt: skip
    offenders = [
        f"{path.relative_to(ROOT)}: {name}"
        for path in sorted(ROOT.rglob("*.py"))
        if path.relative_to(ROOT).parts[0] != "compat"
        for name in private_uses(tree(path))
    ]
    assert not offenders


def test_a_missing_part_of_a_library_is_told_in_one_line(monkeypatch):
    with pytest.raises(MissingPartError) as caught:
        private("numpy", np, "nonsense.part")
    assert (
        one_line(caught.value) == f"numpy {np.__version__} lacks numpy.nonsense.part: install numpy{supported('numpy')}"
    )
    assert supported("rerun-sdk").startswith(">=")
    assert "<" in supported("mujoco")
    monkeypatch.delattr(mujoco.MjModel, "_address")
    with pytest.raises(MissingPartError, match=r"mujoco .* lacks MjModel\._address: install mujoco>="):
        address_of(mujoco.MjModel.from_xml_string("<mujoco/>"))
    assert supported("no-such-library") == ""


def test_help_loads_none_of_the_heavy_libraries():
    """Print `wrist --help` without importing what a simulation needs, so that it answers at once."""
    code = (
        "import sys; sys.argv = ['wrist', '--help']\n"
        "from spherical_wrist.cli import main\n"
        "try:\n    main()\n"
        "except SystemExit as end:\n    assert not end.code\n"
        "heavy = {'numpy', 'numba', 'mujoco', 'rerun', 'scipy', 'pydantic'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_a_recorded_run_loads_nothing_for_other_jobs(tmp_path):
    """Pandas, GLFW and Matplotlib would take half a second; they can be imported afterwards."""
    code = (
        "import sys; sys.argv = ['wrist', 'run', '-q', '--law', 'pd', '--duration', '0.01', '-o', 'run.rrd']\n"
        "from spherical_wrist.cli import main\n"
        "try:\n    main()\n"
        "except SystemExit as end:\n    assert not end.code\n"
        "needless = {'pandas', 'glfw', 'matplotlib', 'ssl'} & set(sys.modules)\n"
        "assert not needless, needless\n"
        "import pandas, os\n"
        "assert 'MUJOCO_GL' not in os.environ"
    )
    environment = {name: value for name, value in os.environ.items() if name != "MUJOCO_GL"}
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run.rrd").exists()


def test_the_digest_of_the_code_is_of_the_rooms_that_campaigns_need():
    """A change elsewhere, such as in a picture, is no reason to refuse to go on with a campaign."""
    needed, waiting = set(), ["campaign"]
    while waiting:
        room = waiting.pop()
        if room not in needed:
            needed.add(room)
            own = [name.split(".") for _, of, name in imports() if of == room]
            waiting += [parts[1] for parts in own if parts[0] == "spherical_wrist" and len(parts) > 1]
    packages = {path.parent.name for path in ROOT.glob("*/__init__.py")}
    rooms = packages | {path.stem for path in ROOT.glob("*.py")} - {"__init__"}
    assert rooms - needed == SHOWING
