"""Put together the pages that Sphinx reads: front page, guides, gallery, wrist model, and a page for every room.

The pages are written to a folder of their own, so that nothing that is generated lies among the sources.
"""

import shutil
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

from spherical_wrist.guides import NAMES, read_guide

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))

from figures import GALLERY, Picture  # noqa: E402  (beside this folder)

PACKAGE = ROOT / "src" / "spherical_wrist"
MODEL = "../../../models/README.md"
"""The description of the wrist model as the guides link to it; GitHub shows them where they lie."""

FROM_MODEL = "../src/spherical_wrist/guides/"
"""Likewise, the guides as that description links to them."""


GROUPS = {
    "use": (
        "Use it",
        "To describe experiments, run them, and take the results further.",
        ("api", "experiment", "simulation", "measure", "channels", "recording", "inspection", "film", "comparison",
         "stability", "assertions", "campaign", "report", "tuning", "environment", "paper", "guides", "errors"),
    ),
    "extend": (
        "Extend it",
        "To bring a law, a motion, a disturbance, hardware or a wrist of your own.",
        ("control", "parameters", "reference", "disturbance", "sensing", "actuation", "wrist", "fuzzy", "so3",
         "kinematics", "dynamics"),
    ),
    "inside": ("Inside", "For those who change the package itself.", ()),
}  # fmt: skip
"""Groups of the API: title, purpose, rooms. The last group has all other rooms."""


def build(folder: Path) -> None:
    """Write all pages to a folder, which is emptied first."""
    shutil.rmtree(folder, ignore_errors=True)
    for name in ("guides", "api", "pictures"):
        (folder / name).mkdir(parents=True)
    front = (Path(__file__).parent / "index.md").read_text(encoding="utf-8")
    links = "\n".join(f"guides/{name}" for name in NAMES)
    (folder / "index.md").write_text(front.replace("GUIDES", links), encoding="utf-8")
    for picture in GALLERY:
        shutil.copy(ROOT / ".assets" / picture.name, folder / "pictures")
    (folder / "gallery.md").write_text(gallery_page(), encoding="utf-8")
    model = (ROOT / "models" / "README.md").read_text(encoding="utf-8").replace(FROM_MODEL, "guides/")
    (folder / "model.md").write_text(model, encoding="utf-8")
    for guide in map(read_guide, NAMES):
        text = guide.text.replace(MODEL, "../model.md")
        (folder / "guides" / f"{guide.name}.md").write_text(with_pictures(guide.name, text), encoding="utf-8")
    for group in GROUPS:
        (folder / "api" / f"{group}.rst").write_text(group_page(group), encoding="utf-8")
    for room, names in rooms().items():
        (folder / "api" / f"{room}.rst").write_text(room_page(room, names), encoding="utf-8")


def with_pictures(name: str, text: str) -> str:
    """Return a guide with its pictures below the heading; in the terminal it has none."""
    heading, _, rest = text.partition("\n")
    shown = "".join(f"\n{_picture(each, '../')}\n" for each in GALLERY if each.guide == name)
    return f"{heading}\n{shown}{rest}"


def gallery_page() -> str:
    """Return the page with all pictures, each with the commands that make it."""
    parts = ["# Gallery\n\nEvery picture is made by the commands below it, without a display.\n"]
    for picture in GALLERY:
        commands = "\n".join(picture.commands)
        parts.append(f"## {picture.caption.rstrip('.')}\n\n{_picture(picture)}\n\n```sh\n{commands}\n```\n")
        parts.append(f"More: [{read_guide(picture.guide).title}](guides/{picture.guide}.md).\n")
    return "\n".join(parts)


def _picture(picture: Picture, up: str = "") -> str:
    return f"![{picture.caption}]({up}pictures/{picture.name})"


def group_of(room: str) -> str:
    """Return the group of a room; the package itself is of the first."""
    name = room.rpartition(".")[2]
    return next((group for group, (_, _, members) in GROUPS.items() if name in members), [*GROUPS][-1])


def group_page(group: str) -> str:
    """Return the page of a group: its rooms, each with the first sentence of its docstring."""
    title, purpose, order = GROUPS[group]
    members = [room for room in rooms() if room != PACKAGE.name and group_of(room) == group]
    members.sort(key=lambda room: order.index(room.rpartition(".")[2]) if order else 0)
    lines = [*_heading(title, "="), purpose, "", ".. list-table::", "   :class: rooms", ""]
    for room in members:
        summary = (import_module(room).__doc__ or "").strip().partition("\n\n")[0].replace("\n", " ")
        lines += [f"   * - :doc:`{room.rpartition('.')[2]} <{room}>`", f"     - {summary}"]
    lines += ["", ".. toctree::", "   :hidden:", "", *(f"   {room}" for room in members)]
    return "\n".join([*lines, ""])


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
    return "\n".join(lines)


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
