"""Short cuts through Sphinx: the same pages in less than half the time.

None of them is needed for a right page; each leaves out work whose result is thrown away.
"""

import gc
import logging
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.domains.python import PythonDomain
from sphinx.errors import PycodeError
from sphinx.pycode import ModuleAnalyzer


def setup(app: Any) -> dict[str, Any]:
    """Called by Sphinx."""
    gc.disable()  # the many trees of nodes stay until the end: looking through them again and again frees nothing
    logging.getLogger("sphinx").setLevel(logging.DEBUG if app.verbosity else logging.INFO)
    app.add_domain(IndexedPython, override=True)
    app.connect("autodoc-skip-member", _skip_imported)
    app.connect("env-updated", _index)
    app.connect("html-page-context", _quick_toctree, priority=100)  # before the theme asks for it
    return {"parallel_read_safe": True, "parallel_write_safe": True}


class IndexedPython(PythonDomain):
    """Looks for what is called ``b`` or ``a.b`` among the objects whose names end with ``b``, not among all."""

    _by_last: dict[str, dict[str, Any]] | None = None
    _near: dict[str, Any] | None = None

    @property
    def objects(self) -> dict[str, Any]:
        """All objects, or those that the search is for."""
        return super().objects if self._near is None else self._near

    def index(self) -> None:
        """Build the index, when all objects are known."""
        self._by_last = {}
        for name, entry in self.objects.items():
            self._by_last.setdefault(name.rpartition(".")[2], {})[name] = entry

    def find_obj(
        self, env: Any, modname: str, classname: str, name: str, type: str | None, searchmode: int = 0
    ) -> list[tuple[str, Any]]:
        """Like that of Sphinx."""
        if self._by_last is not None:
            self._near = self._by_last.get(name.removesuffix("()").rpartition(".")[2], {})
        try:
            return super().find_obj(env, modname, classname, name, type, searchmode)
        finally:
            self._near = None


def _index(app: Any, env: Any) -> list[str]:
    env.get_domain("py").index()
    return []


def _skip_imported(app: Any, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool | None:
    """Leave out what a module imports; Sphinx would find that out after reading all of its source."""
    here = app.env.current_document.autodoc_module
    home = getattr(obj, "__module__", None)
    if what != "module" or not isinstance(home, str) or home == here or options.imported_members:
        return None
    try:
        return None if ("", name) in ModuleAnalyzer.for_module(here).find_attr_docs() else True
    except PycodeError:
        return None


def _quick_toctree(app: Any, pagename: str, templatename: str, context: dict[str, Any], doctree: Any) -> None:
    """The list of pages in the margin, from titles alone: Sphinx would copy every heading and leave them out again."""
    if "toctree" not in context:
        return
    tree, env = context["toctree"], app.env
    if not hasattr(app, "titles_of_pages"):
        app.titles_of_pages = {name: _titles(toc) for name, toc in env.tocs.items()}

    def toctree(**options: Any) -> str:
        if not options.get("titles_only"):
            return tree(**options)
        whole, env.tocs = env.tocs, app.titles_of_pages
        try:
            return tree(**options)
        finally:
            env.tocs = whole

    context["toctree"] = toctree


def _titles(toc: nodes.bullet_list) -> nodes.bullet_list:
    """A copy without the headings below the first, as Sphinx makes it."""
    copy = toc.deepcopy()
    for first in copy.children:
        if len(first) > 1:
            trees = list(first.findall(addnodes.toctree))
            if trees:
                first[1][:] = trees
            else:
                first.pop(1)
    return copy
