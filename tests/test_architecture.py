"""The layout of the package: imports go downwards, and what is kept in one room stays there."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import spherical_wrist

ROOT = Path(spherical_wrist.__file__).parent
LEVELS = (
    {"errors"},
    {"files", "guides", "libmujoco"},
    {"parameters", "user_file", "so3", "wrist"},
    {"dynamics", "kinematics", "fuzzy", "reference", "disturbance", "sensing", "actuation"}
    | {"angle_chart", "angle_dynamics", "denavit_hartenberg", "inverse_kinematics"},
    {"control", "plant"},
    {"simulation"},
    {"metrics", "recording"},
    {"experiment", "inspection", "lyapunov"},
    {"campaign", "film"},
    {"paper", "comparison", "assertions", "tuning", "report"},
    {"environment"},
    {"cli"},
)
LEVEL = {room: level for level, rooms in enumerate(LEVELS) for room in rooms}
COMMANDS = ("guide", "inspect", "replay", "study", "campaign", "tuning", "report", "render", "view")
KEPT = {
    "numba": {"simulation/compiler.py"},
    "llvmlite": {"simulation/compiler.py", "simulation/processor.py"},
    "ctypes": {"libmujoco.py", "recording/leash.py"},
    "pyarrow": {"reference/recorded_file.py", "campaign/store.py", "inspection/export.py"},
    "duckdb": {"campaign/store.py", "report/table.py"},
    "dask": {"campaign/cluster.py"},
    "distributed": {"campaign/cluster.py"},
    "rerun": {str(path.relative_to(ROOT)) for path in (ROOT / "recording").glob("*.py")},
    "typer": {"cli/__init__.py", "cli/app.py", "cli/completion.py"} | {f"cli/{each}_commands.py" for each in COMMANDS},
    "optuna": {"tuning/study.py"},
    "av": {"film/mp4.py"},
    "PIL": {"film/caption.py", "film/film.py", "film/gif.py"},
    "gymnasium": {f"environment/{each}.py" for each in ("__init__", "spaces", "track", "track_vector")},
    "matplotlib": {"fuzzy/picture.py", "paper/figures.py", "comparison/picture.py", "comparison/frontier_picture.py"}
    | {"tuning/picture.py", "report/pictures.py", "film/caption.py"}
    | {f"inspection/{each}.py" for each in ("drawing", "panels", "portrait", "picture", "difference_picture")},
}
FILES = sorted(path for path in ROOT.rglob("*.py") if path != ROOT / "__init__.py")


def imported(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            yield node.module
            if node.module == "spherical_wrist":
                yield from (f"spherical_wrist.{alias.name}" for alias in node.names)


def room_of(path):
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_go_downwards(path):
    for name in imported(path):
        if name.startswith("spherical_wrist."):
            assert LEVEL[name.split(".")[1]] <= LEVEL[room_of(path)], f"{path.name} imports {name} upwards"


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_libraries_are_imported_in_their_rooms_only(path):
    for name in imported(path):
        library = name.split(".")[0]
        assert str(path.relative_to(ROOT)) in KEPT.get(library, {str(path.relative_to(ROOT))})


def test_control_knows_no_physics_engine():
    for path in (ROOT / "control").glob("*.py"):
        rooms = {name.split(".")[1] for name in imported(path) if name.startswith("spherical_wrist.")}
        assert rooms <= {"control", "errors", "parameters", "fuzzy"}
        assert "mujoco" not in set(imported(path))


def test_help_loads_none_of_the_heavy_libraries():
    """`wrist --help` must answer at once."""
    code = (
        "import sys; sys.argv = ['wrist', '--help']\n"
        "from spherical_wrist.cli import main\n"
        "try:\n    main()\n"
        "except SystemExit as end:\n    assert not end.code\n"
        "heavy = {'numpy', 'numba', 'mujoco', 'rerun', 'scipy', 'pydantic'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_every_file_is_small():
    long = {path.name: n for path in FILES if (n := len(path.read_text().splitlines())) > 250}
    assert not long
