"""Sizes that the text of a model asks for, and the most of each that is read.

A few letters of MJCF can ask MuJoCo for hours of work, or for all memory, while it parses or compiles. The texts of a
model are therefore looked through before. Everything is counted as often as it is replicated and attached.
"""

import math
import re
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from spherical_wrist.errors import ModelError
from spherical_wrist.files import read_whole
from spherical_wrist.wrist.named_files import slashed, text_named

Attributes = Mapping[str, str]

LARGEST = 2**24
"""Most cells, pixels or values: 4096 × 4096."""

COMMENT = re.compile(rb"<!--.*?-->", re.DOTALL)
"""Comment in a text of MJCF."""

_ELEMENT = re.compile(r"""<(\w+)((?:[^<>"']|"[^"]*"|'[^']*')*)>""")
_ATTRIBUTE = re.compile(r"""\b(\w+)\s*=\s*(["'])(.*?)\2""", re.DOTALL)
_UNITS = {"k": 2**10, "m": 2**20, "g": 2**30, "t": 2**40, "p": 2**50, "e": 2**60}


class Size(NamedTuple):
    """Size that elements of a model ask for.

    Attributes:
        quantity: its name, in the plural.
        most: the most of it in a model.
        asked: function that returns what one element asks for, of its tag and attributes.
        added: True if the elements of a model add up; False if the largest one counts.
    """

    quantity: str
    most: float
    asked: Callable[[str, Attributes], float]
    added: bool = True


def _numbers(attributes: Attributes, name: str) -> list[float]:
    """Return the numbers in an attribute; those that cannot be read are left to MuJoCo."""
    found = []
    for word in attributes.get(name, "").split():
        try:
            found.append(max(float(word), 0.0))
        except ValueError:
            continue
    return [each for each in found if not math.isnan(each)]


def _product(*names: str) -> Callable[[Attributes], float]:
    """Return the product of all numbers in some attributes."""
    return lambda attributes: math.prod(each for name in names for each in _numbers(attributes, name))


def _largest(*names: str) -> Callable[[Attributes], float]:
    """Return the largest number in some attributes; 0 without any."""
    return lambda attributes: max((each for name in names for each in _numbers(attributes, name)), default=0.0)


def _of(asked: Callable[[Attributes], float], *tags: str) -> Callable[[str, Attributes], float]:
    """Return what elements with some tags ask for; all elements without any tag."""
    return lambda tag, attributes: asked(attributes) if not tags or tag in tags else 0.0


def _pixels(attributes: Attributes) -> float:
    """Return the pixels of a built-in texture; a cube has six sides."""
    if "builtin" not in attributes:
        return 0.0
    width = _largest("width")(attributes)
    height = _largest("height")(attributes)
    return width * (height or width) * (6.0 if attributes.get("type", "cube") == "cube" else 1.0)


def _bytes(attributes: Attributes) -> float:
    """Return the memory that a model asks for, such as ``64M``."""
    text = attributes.get("memory", "").strip().lower()
    if text[-1:] in _UNITS:
        return _UNITS[text[-1]] * _largest("memory")({"memory": text[:-1]})
    return _largest("memory")(attributes)


_USER = tuple(f"nuser_{kind}" for kind in ("body", "jnt", "geom", "site", "cam", "tendon", "actuator", "sensor"))
_ITERATIONS = ("iterations", "ls_iterations", "noslip_iterations", "ccd_iterations", "sdf_iterations", "sdf_initpoints")

SIZES = (
    Size("elements", 100_000, _of(lambda attributes: 1.0)),
    Size("cells of height fields", LARGEST, _of(_product("nrow", "ncol"), "hfield")),
    Size("pixels of textures", LARGEST, _of(_pixels, "texture")),
    Size("points of flexible bodies", 100_000, _of(_product("count"), "flexcomp", "composite")),
    Size("parts of a built-in mesh", 2_000, _of(_largest("params"), "mesh"), added=False),
    Size("bytes of memory (size memory)", 2**30, _of(_bytes, "size"), added=False),
    Size("contacts or constraints (njmax, nconmax)", 1_000_000, _of(_largest("njmax", "nconmax"), "size"), added=False),
    Size("numbers of its stack (nstack)", 2**27, _of(_largest("nstack"), "size"), added=False),
    Size("values of user data (nuserdata)", LARGEST, _of(_largest("nuserdata"), "size"), added=False),
    Size("user values of each element (nuser_...)", 1_000, _of(_largest(*_USER), "size"), added=False),
    Size("key frames (nkey)", 10_000, _of(_largest("nkey"), "size"), added=False),
    Size("values of sensors", LARGEST, _of(_largest("dim", "num"), "user", "contact")),
    Size("samples of delays (nsample)", LARGEST, _of(_largest("nsample"))),
    Size("pixels of a camera", LARGEST, _of(_product("resolution"), "camera"), added=False),
    Size("pixels of a rendered image", 2**26, _of(_product("offwidth", "offheight"), "global"), added=False),
    Size("pixels of shadows", 2**28, _of(lambda given: _largest("shadowsize")(given) ** 2, "quality"), added=False),
    Size("iterations of a solver", 10_000, _of(_largest(*_ITERATIONS), "option"), added=False),
)  # fmt: skip
"""All bounds. Elements without one of the attributes ask for 1 of a product without factors, which is harmless."""


def check_sizes(path: Path) -> None:
    """Refuse a model whose texts ask for more than is read.

    Args:
        path: its MJCF file.

    Raises:
        ModelError: they do; or one of them includes or attaches itself, by which MuJoCo would end the process; or it is
            an archive.
        OSError: a file cannot be read.
    """
    totals = _Texts(path).totals(path, path)
    for size in SIZES:
        if totals[size.quantity] > size.most:
            raise ModelError(
                f"model {str(path)!r} asks for {totals[size.quantity]:,.0f} {size.quantity}: make it {size.most:,} "
                "or less"
            )


class _Texts:
    """Texts of a model, with what each asks for.

    Args:
        path: MJCF file of the model.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._known: dict[tuple[Path, Path], Counter[str]] = {}
        self._open: list[Path] = []

    def totals(self, file: Path, main: Path) -> Counter[str]:
        """Add up what a text asks for, with what it includes and attaches; nothing for a file that is not there.

        Args:
            file: the text.
            main: MJCF file of the model that it is part of, which may be the same.
        """
        if file in self._open:
            raise ModelError(f"model {str(self._path)!r}: {file.name!r} includes or attaches itself")
        if (file, main) not in self._known:
            self._open.append(file)
            self._known[file, main] = self._counted(_root(file), file, main) if file.exists() else Counter()
            self._open.pop()
        return self._known[file, main]

    def _counted(self, root: ElementTree.Element, file: Path, main: Path) -> Counter[str]:
        found, attachments, models = Counter[str](), 0.0, list[Counter[str]]()
        waiting: list[tuple[ElementTree.Element, float]] = [(root, 1.0)]
        while waiting:
            element, times = waiting.pop()
            tag = element.tag.lower()  # as MuJoCo compares some of them
            for size in SIZES:
                _add(found, size, size.asked(tag, element.attrib), times)
            if tag in ("include", "model") and element.get("file"):
                named = text_named(tag, slashed(element.get("file", "")), file, main)
                inner = self.totals(named, named if tag == "model" else main)
                if tag == "model":
                    models.append(inner)
                else:
                    _add_all(found, inner, times)
            elif tag == "attach":
                attachments += times
            if tag == "replicate":
                times *= max(_largest("count")(element.attrib), 1.0)
            waiting += [(each, times) for each in element]
        for each in models:  # any of them may be the one that is attached
            _add_all(found, each, max(attachments, 1.0))
        return found


def _root(file: Path) -> ElementTree.Element:
    """Parse a text; if it is no XML, return its elements without their order, as far as they can be found."""
    content = read_whole(file)  # which also refuses pipes, where MuJoCo would wait
    if content.startswith(b"PK\3\4"):
        raise ModelError(f"model {str(file)!r} is an archive: unpack it, and give the MJCF file in it")
    without_comments = COMMENT.sub(b"", content)
    if b"<!ENTITY" not in content:
        for text in (content, without_comments):
            try:
                return ElementTree.fromstring(text)
            except (ElementTree.ParseError, ValueError, LookupError):
                continue
    root = ElementTree.Element("mujoco")
    for tag, text in _ELEMENT.findall(without_comments.decode(errors="replace")):
        ElementTree.SubElement(root, tag, {key: value for key, _, value in _ATTRIBUTE.findall(text)})
    return root


def _add(found: Counter[str], size: Size, asked: float, times: float) -> None:
    before = found[size.quantity]
    found[size.quantity] = before + times * asked if size.added else max(before, asked)  # type: ignore[assignment]


def _add_all(found: Counter[str], others: Counter[str], times: float) -> None:
    for size in SIZES:
        _add(found, size, others[size.quantity], times)
