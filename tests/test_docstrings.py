"""Docstrings say of every parameter what it is, and of no parameter that is not there."""

import ast
import re
from pathlib import Path

import pytest

import spherical_wrist

ROOT = Path(spherical_wrist.__file__).parent
FILES = sorted(ROOT.rglob("*.py"))
SECTION = re.compile(r"^(Args|Attributes|Returns|Raises|Yields):\n((?:(?:    .*)?\n)*)", re.MULTILINE)
ENTRY = re.compile(r"^    (\*{0,2}\w+)(?: \([^)]*\))?:", re.MULTILINE)


def documented(tree, scope=""):
    """Every public class and function at module or class level, with its dotted name."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("_"):
            yield f"{scope}{node.name}", node
            if isinstance(node, ast.ClassDef):
                yield from documented(node, f"{scope}{node.name}.")


def sections(node):
    """The sections of a docstring: by title, the names that it explains."""
    text = (ast.get_docstring(node) or "") + "\n"
    return {title: ENTRY.findall(body) for title, body in SECTION.findall(text)}


def parameters(node):
    """What a function is called with, or a class: the parameters of ``__init__``."""
    if isinstance(node, ast.ClassDef):
        node = next((each for each in node.body if getattr(each, "name", "") == "__init__"), None)
        if node is None:
            return []
    given = node.args
    names = [argument.arg for argument in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
    names += [each.arg for each in (given.vararg, given.kwarg) if each is not None]
    return [name for name in names if name not in {"self", "cls"} and not name.startswith("_")]


def fields(node):
    """Names that a class gives its instances: annotations, properties, assignments to self or to the class."""
    names = {target.id for each in node.body if isinstance(each, ast.AnnAssign) for target in [each.target]}
    names |= {target.id for each in node.body if isinstance(each, ast.Assign) for target in each.targets}
    names |= {each.name for each in node.body if isinstance(each, ast.FunctionDef)}
    inner = (each for each in ast.walk(node) if isinstance(each, ast.Attribute) and isinstance(each.ctx, ast.Store))
    return names | {each.attr for each in inner}


OBJECTS = [
    pytest.param(node, id=f"{path.relative_to(ROOT)}:{name}")
    for path in FILES
    for name, node in documented(ast.parse(path.read_text(encoding="utf-8")))
]


def test_there_is_something_to_check():
    assert len(OBJECTS) > 500
    explained = [name for (node,) in (each.values for each in OBJECTS) for name in sections(node).get("Args", ())]
    assert len(explained) > 300


@pytest.mark.parametrize("node", OBJECTS)
def test_args_are_the_parameters(node):
    """Where parameters are explained, all are, and nothing else is."""
    explained = sections(node).get("Args")
    if explained is not None:
        assert [name.lstrip("*") for name in explained] == parameters(node)


@pytest.mark.parametrize("node", [each for each in OBJECTS if isinstance(each.values[0], ast.ClassDef)])
def test_attributes_are_there(node):
    explained = sections(node).get("Attributes", ())
    assert set(explained) <= fields(node)


@pytest.mark.parametrize("node", [each for each in OBJECTS if isinstance(each.values[0], ast.FunctionDef)])
def test_what_is_raised_is_said(node):
    """An error that a public function raises itself is in its docstring; that a method must be overridden is not."""
    raised = {
        each.exc.func.id
        for each in own_statements(node)
        if isinstance(each, ast.Raise) and isinstance(each.exc, ast.Call) and isinstance(each.exc.func, ast.Name)
    }
    ours = {name for name in raised if name.endswith("Error") and name != "NotImplementedError"}
    told = set(sections(node).get("Raises", ()))
    assert ours <= told or "WristError" in told


def own_statements(node):
    """The statements of a function without those of functions inside it."""
    for each in ast.iter_child_nodes(node):
        if not isinstance(each, ast.FunctionDef | ast.Lambda | ast.ClassDef):
            yield each
            yield from own_statements(each)
