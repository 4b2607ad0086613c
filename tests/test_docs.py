"""The web pages of guides and API: built without a warning, complete, and in need of no network."""

import inspect
import re
import runpy
import subprocess
import sys
from html.parser import HTMLParser
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from urllib.parse import unquote, urldefrag

import pytest

import spherical_wrist
from sampling import long
from spherical_wrist.actuation import Actuation
from spherical_wrist.control import Law
from spherical_wrist.disturbance import Disturbance
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.guides import NAMES, read_guide
from spherical_wrist.parameters import unit_of
from spherical_wrist.reference import Reference
from spherical_wrist.sensing import Sensing

pytestmark = [pytest.mark.slow, long]  # the documentation's build takes half a minute; .ci/run asks for it
ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "scripts" / "site"
STRAIGHT = str.maketrans("‘’", "''")
"""Typographic quotation marks as those that were written."""


class Page(HTMLParser):
    """The anchors of a page, its links, what it loads, its text, and the cells of its tables row by row."""

    def __init__(self, path):
        super().__init__()
        self.ids, self.links, self.loaded, self.text, self.rows = set(), [], [], "", []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.ids.add(given.get("id"))
        if tag == "tr":
            self.rows.append([])
        elif tag in {"td", "th"}:
            self.rows[-1].append("")
        elif tag == "a" and given.get("href"):
            self.links.append(given["href"])
        elif tag in {"link", "script", "img", "iframe", "source"}:
            self.loaded += [given[name] for name in ("href", "src") if given.get(name)]

    def handle_data(self, data):
        self.text += data
        if self.rows and self.rows[-1]:
            self.rows[-1][-1] += data


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The pages by their path in the site, built as scripts/docs does."""
    folder = tmp_path_factory.mktemp("docs")
    pages, out = folder / "pages", folder / "site"
    with pytest.MonkeyPatch.context() as patch:  # in this process, which needs all of the package anyway
        patch.setattr(sys, "argv", ["pages.py", str(pages)])
        runpy.run_path(str(SOURCES / "pages.py"), run_name="__main__")
    sphinx = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "-c", SOURCES, pages, out]
    built = subprocess.run(sphinx, capture_output=True, text=True, check=False)
    assert (built.returncode, built.stderr) == (0, ""), built.stderr
    return {str(path.relative_to(out)): Page(path) for path in out.rglob("*.html")}, out


def test_no_internal_link_is_dead(site):
    pages, out = site
    for name, page in pages.items():
        for link in page.links:
            if "://" in link or link.startswith("mailto:"):
                continue
            file, anchor = urldefrag(link)
            target = (out / name).parent / unquote(file) if file else out / name
            assert target.exists(), f"{name}: {link}"
            if anchor and target.suffix == ".html":
                there = pages[str(target.resolve().relative_to(out.resolve()))]
                assert unquote(anchor) in there.ids, f"{name}: {link}"


def test_looking_at_it_needs_no_network(site):
    pages, out = site
    for name, page in pages.items():
        assert not [source for source in page.loaded if re.match(r"(https?:)?//", source)], name
    for sheet in out.rglob("*.css"):
        assert not re.search(r"(url\(|@import)\s*[\"']?(https?:)?//", sheet.read_text(encoding="utf-8")), sheet.name


def public_objects():
    """Dotted names of the public classes and functions of the package, each where it is defined."""
    names = [each.name for each in walk_packages(spherical_wrist.__path__, "spherical_wrist.") if "._" not in each.name]
    for name in ["spherical_wrist", *names]:
        for key, value in vars(import_module(name)).items():
            defined = inspect.isclass(value) or inspect.isroutine(value)
            if defined and not key.startswith("_") and value.__module__ == name and value.__qualname__ == key:
                yield f"{name}.{key}"


def test_every_public_object_is_there(site):
    pages, _ = site
    found = set().union(*(page.ids for page in pages.values()))
    wanted = set(public_objects())
    assert len(wanted) > 500
    assert not wanted - found


def test_nothing_private_is_there(site):
    pages, _ = site
    names = {name for page in pages.values() for name in page.ids if str(name).startswith("spherical_wrist.")}
    assert not [name for name in names if "._" in name]


@pytest.mark.parametrize("family", [Law, Reference, Disturbance, Sensing, Actuation], ids=lambda family: family.kind)
def test_parameters_are_listed_with_default_unit_and_meaning(site, family):
    for member in (*family.members.values(), Experiment):
        room = ".".join(member.__module__.split(".")[:2])
        rows = [tuple(" ".join(cell.split()) for cell in row) for row in site[0][f"api/{room}.html"].rows]
        for name, field in member.model_fields.items():
            found = [row for row in rows if len(row) == 4 and (row[0], row[2]) == (name, unit_of(member, name))]
            found = [row for row in found if row[3].translate(STRAIGHT).startswith(field.description)]
            assert found, f"{member.__name__}.{name}"
            if isinstance(field.default, bool | int | float | str):
                assert written(field.default) in {row[1] for row in found}, f"{member.__name__}.{name}"


def written(value):
    return str(value).lower() if isinstance(value, bool) else str(value) if isinstance(value, str) else f"{value:.6g}"


def test_every_guide_is_there(site):
    for name in NAMES:
        assert read_guide(name).title in site[0][f"guides/{name}.html"].text


def test_the_front_page_leads_to_guides_and_api(site):
    front = site[0]["index.html"]
    assert {f"guides/{name}.html" for name in NAMES} <= set(front.links)
    assert "api/spherical_wrist.html" in front.links
