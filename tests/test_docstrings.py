"""Docstrings agree with the code: parameters, attributes and errors."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

import spherical_wrist

ROOT = Path(spherical_wrist.__file__).parent
FILES = sorted(ROOT.rglob("*.py"))
SECTION = re.compile(r"^(Args|Attributes|Returns|Raises|Yields):\n((?:(?:    .*)?\n)*)", re.MULTILINE)
ENTRY = re.compile(r"^    (\*{0,2}\w+)(?: \([^)]*\))?:", re.MULTILINE)


def documented(tree, scope=""):
    """Yield every public class and function at module or class level, with its dotted name."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("_"):
            yield f"{scope}{node.name}", node
            if isinstance(node, ast.ClassDef):
                yield from documented(node, f"{scope}{node.name}.")


def sections(node):
    """Return the names that each section of a docstring explains, by title."""
    text = (ast.get_docstring(node) or "") + "\n"
    return {title: ENTRY.findall(body) for title, body in SECTION.findall(text)}


def parameters(node):
    """Return the names of a function's parameters; of a class, those of ``__init__``."""
    if isinstance(node, ast.ClassDef):
        node = next((each for each in node.body if getattr(each, "name", "") == "__init__"), None)
        if node is None:
            return []
    given = node.args
    names = [argument.arg for argument in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
    names += [each.arg for each in (given.vararg, given.kwarg) if each is not None]
    return [name for name in names if name not in {"self", "cls"} and not name.startswith("_")]


def fields(node):
    """Return the attributes of a class: annotations, methods, assignments to self or to the class."""
    names = {target.id for each in node.body if isinstance(each, ast.AnnAssign) for target in [each.target]}
    names |= {target.id for each in node.body if isinstance(each, ast.Assign) for target in each.targets}
    names |= {each.name for each in node.body if isinstance(each, ast.FunctionDef)}
    inner = (each for each in ast.walk(node) if isinstance(each, ast.Attribute) and isinstance(each.ctx, ast.Store))
    return names | {each.attr for each in inner}


@cache
def tree(path):
    return ast.parse(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def objects():
    """Return every documented object of the package by file and dotted name."""
    return {f"{path.relative_to(ROOT)}:{name}": node for path in FILES for name, node in documented(tree(path))}


def raised(node):
    """Names of the package's errors that a function raises itself, other than that a method must be overridden."""
    calls = (each.exc for each in own_statements(node) if isinstance(each, ast.Raise))
    names = {each.func.id for each in calls if isinstance(each, ast.Call) and isinstance(each.func, ast.Name)}
    return {name for name in names if name.endswith("Error") and name != "NotImplementedError"}


def test_there_is_something_to_check(objects):
    assert len(objects) > 500
    assert sum(len(sections(node).get("Args", ())) for node in objects.values()) > 300


def test_args_are_the_parameters(objects):
    """Section Args, where there is one, has every parameter and nothing else."""
    assert not [
        (name, explained, parameters(node))
        for name, node in objects.items()
        if (explained := sections(node).get("Args")) is not None
        and [each.lstrip("*") for each in explained] != parameters(node)
    ]


def test_attributes_exist(objects):
    assert not [
        (name, missing)
        for name, node in objects.items()
        if isinstance(node, ast.ClassDef) and (missing := set(sections(node).get("Attributes", ())) - fields(node))
    ]


def test_raised_errors_are_documented(objects):
    """Section Raises has every error that a public function raises itself, or their common base class."""
    assert not [
        (name, missing)
        for name, node in objects.items()
        if isinstance(node, ast.FunctionDef)
        and "WristError" not in (documented_errors := sections(node).get("Raises", ()))
        and (missing := raised(node) - set(documented_errors))
    ]


def own_statements(node):
    """Yield the statements of a function without those of functions inside it."""
    for each in ast.iter_child_nodes(node):
        if not isinstance(each, ast.FunctionDef | ast.Lambda | ast.ClassDef):
            yield each
            yield from own_statements(each)


OPENERS = ("What", "Where", "Whether", "How", "That")
"""Words with which a first line becomes a riddle: it begins with an imperative, or names the thing."""


def every_docstring(module):
    """Yield the line and the text of the docstrings of modules, classes, functions and constants."""
    todo = [module]
    while todo:
        node = todo.pop()
        for branch in ("orelse", "handlers", "finalbody", "cases"):
            todo += getattr(node, branch, ())
        for each in getattr(node, "body", ()):
            todo.append(each)
            value = each.value if isinstance(each, ast.Expr) else None
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                yield each.lineno, value.value.strip()


def test_first_lines_are_plain():
    """Docstrings open in the imperative or with a noun phrase, in the package, the tests and the scripts."""
    repository = Path(__file__).parents[1]
    files = [path for room in ("src", "tests", "scripts") for path in sorted((repository / room).rglob("*.py"))]
    assert not [
        f"{path.relative_to(repository)}:{line}: {text.splitlines()[0]}"
        for path in files
        for line, text in every_docstring(tree(path))
        if text.split(maxsplit=1)[0] in OPENERS
    ]
