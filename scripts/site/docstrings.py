"""Docstrings of this package made pages: parameters as tables, types as a person would write them."""

import re
from contextlib import suppress
from importlib import import_module
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from spherical_wrist.parameters import unit_of

BOUNDS = {"gt": "> {}", "ge": "≥ {}", "lt": "< {}", "le": "≤ {}", "multiple_of": "a multiple of {}"}
LITERAL = re.compile(r"(``.*?``)")
ARRAY = re.compile(r"~?numpy\.ndarray\[.*?,\s*~?numpy\.dtype\[~?(?:numpy|typing)\.(\w+)\]\]")


def setup(app: Any) -> dict[str, Any]:
    """Called by Sphinx."""
    app.connect("autodoc-process-docstring", _plain, priority=100)  # before Google's sections are looked for
    app.connect("autodoc-process-docstring", _add_parameters, priority=900)  # after the sections are made fields
    app.connect("autodoc-before-process-signature", _without_annotated)
    app.connect("autodoc-process-signature", _readable)
    app.connect("autodoc-skip-member", _skip)
    app.connect("missing-reference", _where_defined)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _plain(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Keeps reStructuredText from reading |e| as a substitution, and Napoleon from reading "size: of …" as a type."""
    # the sign of the same width, so that tables stay tables
    lines[:] = [
        "".join(part if part.startswith("``") else part.replace("|", "∣") for part in LITERAL.split(line))
        for line in lines
    ]
    if what in {"attribute", "data", "property"}:
        lines[:0] = ["..", ""]


def _without_annotated(app: Any, obj: Any, bound_method: bool) -> None:
    """``Annotated`` is for the command line and for validation; a signature shows the type alone."""
    with suppress(NameError, TypeError, AttributeError):
        obj.__annotations__ = get_type_hints(obj)


def _add_parameters(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Appends a table of the parameters of a law, a reference, an experiment and the like."""
    if what != "class" or not issubclass(obj, BaseModel) or not obj.model_fields:
        return
    lines += ["", ".. list-table::", "   :header-rows: 1", "   :class: parameters", ""]
    rows = [("parameter", "default", "unit", "meaning")]
    for key, field in obj.model_fields.items():
        valid = valid_values(field)
        meaning = f"{field.description or ''}{f' ({valid})' if valid else ''}"
        rows.append((f"``{key}``", _default(field), unit_of(obj, key), meaning))
    for row in rows:
        first, *rest = row
        lines.append(f"   * - {first}")
        lines += [f"     - {cell}".rstrip() for cell in rest]
    lines.append("")


def _default(field: FieldInfo) -> str:
    """A default as one would write it in TOML; a dash for none."""
    value = field.default
    if value is None or value is PydanticUndefined:
        return "—" if value is None else "must be given"
    return f"``{_written(value)}``"


def _written(value: Any) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(_written, value))}]"
    if isinstance(value, bool | str):
        return str(value).lower() if isinstance(value, bool) else value
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def valid_values(field: FieldInfo) -> str:
    """Return the values that a field takes, as far as its annotation says so: choices, or bounds of its numbers."""
    choices = [choice for choice in get_args(field.annotation) if isinstance(choice, str)]
    if choices:
        return ", ".join(choices)
    found: dict[str, None] = {}
    for each in (*field.metadata, *_metadata(field.annotation)):
        for key, form in BOUNDS.items():
            if (bound := getattr(each, key, None)) is not None:
                found[form.format(f"{bound:g}")] = None
    return ", ".join(found)


def _metadata(annotation: Any) -> list[Any]:
    """Return the metadata of ``Annotated`` anywhere inside an annotation."""
    own: list[Any] = []
    if get_origin(annotation) is Annotated:
        for each in annotation.__metadata__:
            own += each.metadata if isinstance(each, FieldInfo) else [each]
    if get_origin(annotation) is Literal:
        return own
    return own + [found for inner in get_args(annotation) for found in _metadata(inner)]


def _readable(
    app: Any, what: str, name: str, obj: Any, options: Any, signature: str | None, returned: str | None
) -> tuple[str | None, str | None] | None:
    """Signatures without what only the type checker wants to know."""
    if what == "class" and issubclass(obj, BaseModel):
        return ("(**parameters)" if obj.model_fields else "()"), None
    return (_short(signature), _short(returned))


def _short(text: str | None) -> str | None:
    return ARRAY.sub(r"NDArray[\1]", text) if text else text


def _skip(app: Any, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool | None:
    """Fields that a class tells of in its own docstring or table are not told twice."""
    plumbing = name in {"model_config", "model_post_init"} or isinstance(obj, FieldInfo)
    alias = str(getattr(obj, "__doc__", "")).startswith("Alias for field number")
    return True if plumbing or alias else None


def _where_defined(app: Any, env: Any, node: Any, contnode: Any) -> Any:
    """A class by the name that it is imported by leads to where it is defined."""
    module, _, name = node.get("reftarget", "").rpartition(".")
    if node.get("refdomain") != "py" or not module.startswith("spherical_wrist"):
        return None
    with suppress(ImportError, AttributeError):
        found = getattr(import_module(module), name)
        target = f"{found.__module__}.{found.__qualname__}"
        return env.get_domain("py").resolve_xref(env, node["refdoc"], app.builder, "obj", target, node, contnode)
    return None
