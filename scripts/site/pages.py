"""Puts together what Sphinx reads: the front page, the guides, the wrist model, and one page for every room of the API.

The pages are written to a folder of their own, so that nothing that is generated lies among the sources.
"""

import shutil
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

from spherical_wrist.guides import NAMES, read_guide

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "src" / "spherical_wrist"
MODEL = "../../../models/README.md"
"""The description of the wrist model as the guides link to it; GitHub shows them where they lie."""

FROM_MODEL = "../src/spherical_wrist/guides/"
"""Likewise, the guides as that description links to them."""


def build(folder: Path) -> None:
    """Writes all pages to a folder, which is emptied first."""
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "guides").mkdir(parents=True)
    (folder / "api").mkdir()
    shutil.copy(Path(__file__).parent / "index.md", folder)
    model = (ROOT / "models" / "README.md").read_text(encoding="utf-8").replace(FROM_MODEL, "guides/")
    (folder / "model.md").write_text(model, encoding="utf-8")
    for guide in map(read_guide, NAMES):
        text = guide.text.replace(MODEL, "../model.md")
        (folder / "guides" / f"{guide.name}.md").write_text(text, encoding="utf-8")
    for room, names in rooms().items():
        (folder / "api" / f"{room}.rst").write_text(room_page(room, names), encoding="utf-8")


def rooms() -> dict[str, list[str]]:
    """Dotted names of every public module, by the room that it belongs to: the package itself, and what lies in it."""
    paths = (path.relative_to(PACKAGE.parent).with_suffix("") for path in PACKAGE.rglob("*.py"))
    names = sorted(".".join(path.parts).removesuffix(".__init__") for path in paths)
    found: dict[str, list[str]] = {}
    for name in names:
        if "._" not in name:
            found.setdefault(".".join(name.split(".")[:2]), []).append(name)
    return found


def room_page(room: str, names: list[str]) -> str:
    """The page of one room: what it says of itself, what it exports, and what is defined in its modules."""
    lines = _heading(room.rpartition(".")[2], "=")
    for name in names:
        if name != room:
            lines += _heading(name.removeprefix(f"{room}."), "-")
        lines += [f".. automodule:: {name}", "   :members:", "   :ignore-module-all:", ""]
        exported = _exported(import_module(name))
        if exported:
            lines += [f"To be imported from ``{name}``: {', '.join(exported)}.", ""]
    if room == PACKAGE.name:
        lines += _list_of_rooms()
    return "\n".join(lines)


def _list_of_rooms() -> list[str]:
    """The rooms with the first sentence of their docstrings."""
    lines = [".. list-table::", "   :class: rooms", ""]
    for room in rooms():
        if room != PACKAGE.name:
            summary = (import_module(room).__doc__ or "").strip().partition("\n\n")[0].replace("\n", " ")
            lines += [f"   * - :doc:`{room.rpartition('.')[2]} <{room}>`", f"     - {summary}"]
    return [*lines, ""]


def _heading(text: str, line: str) -> list[str]:
    return [text, line * len(text), ""]


def _exported(module: ModuleType) -> list[str]:
    """Links to what a package offers beside what is defined in it."""
    links = []
    for name in getattr(module, "__all__", ()):
        home = getattr(getattr(module, name), "__module__", module.__name__)
        if home != module.__name__:
            links.append(f":py:obj:`{name} <{home}.{getattr(module, name).__qualname__}>`")
    return links


if __name__ == "__main__":
    build(Path(sys.argv[1]))
