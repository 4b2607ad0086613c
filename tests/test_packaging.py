"""Contents of the wheel."""

import re
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_the_wheel_carries_the_model_and_the_command(tmp_path):
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        model = archive.read("spherical_wrist/models/wrist.xml")
        (points,) = (name for name in names if name.endswith("entry_points.txt"))
        assert b"wrist = spherical_wrist.cli:main" in archive.read(points)
        (metadata,) = (archive.read(name).decode() for name in names if name.endswith("/METADATA"))
    links = re.findall(r"\]\(([^)]*)\)", metadata)
    assert links, "the page of an index is the README"
    assert not [link for link in links if not link.startswith("https://")], "beside it lies no other file"
    assert model == (ROOT / "models" / "wrist.xml").read_bytes()
    assert not [name for name in names if name.startswith(("tests", "scripts")) or "__pycache__" in name]
    files = [path for path in (ROOT / "src" / "spherical_wrist").rglob("*.*") if path.is_file()]
    package = {str(path.relative_to(ROOT / "src")) for path in files if "__pycache__" not in path.parts}
    assert {"spherical_wrist/report/templates/page.html", "spherical_wrist/py.typed"} <= package
    assert package <= set(names)
