"""Gains as an experiment file, with what they did in its comments."""

import json
import shlex
from collections.abc import Iterator, Mapping
from typing import Any

from spherical_wrist.control import Law
from spherical_wrist.experiment.description import Experiment


def gains_file(base: Experiment, law: Law, point: Mapping[str, Any], table: Mapping[str, Any], again: list[str]) -> str:
    """An experiment file that ``wrist run`` takes: the law with these gains, in the experiment that the cases change.

    Args:
        base: that experiment.
        law: the law with these gains.
        point: what they did, as :mod:`spherical_wrist.tuning.front` tells it.
        table: the whole search, as told there.
        again: command that runs the cases with this file.
    """
    return "\n".join([*_comments(point, table, again), "", *_experiment(base, law), ""])


def _comments(point: Mapping[str, Any], table: Mapping[str, Any], again: list[str]) -> Iterator[str]:
    of_default = [
        "" if point[name] is None else f" ({point[name]:.4g} of the default gains')"
        for name in ("error_ratio", "chattering_ratio")
    ]
    yield f"# Gains of {table['law']['name']}: trial {point['trial']} of {table['trials']}, on the Pareto front."
    yield f"# Geometric means over {len(table['cases'])} cases:"
    yield f"#   RMS error   {point['rms_error_rad']:.6g} rad{of_default[0]}"
    yield f"#   chattering  {point['chattering_Nm_per_s']:.6g} N·m/s{of_default[1]}"
    yield "#"
    width = max(len(name) for name in point["cases"])
    yield f"# {'case':{width}}  RMS error [rad]  largest tip error [mm]  chattering [N·m/s]"
    for name, figures in point["cases"].items():
        error, tip, chattering = (figures[key] for key in ("rms_error_rad", "max_tip_error_mm", "chattering_Nm_per_s"))
        yield f"# {name:{width}}  {error:>15.6g}  {tip:>22.6g}  {chattering:>18.6g}"
    yield "#"
    yield f"# These figures again: {shlex.join(again)}"


def _experiment(base: Experiment, law: Law) -> Iterator[str]:
    """What differs from the default experiment, and the whole law."""
    values, usual = base.model_dump(mode="json"), Experiment().model_dump(mode="json")
    different = {name: value for name, value in values.items() if name != "law" and value != usual[name]}
    tables = {name: value for name, value in different.items() if isinstance(value, Mapping)}
    for name, value in different.items():
        if name not in tables and value is not None:
            yield f"{name} = {toml(value)}"
    for name, inner in {**tables, "law": law.model_dump(mode="json")}.items():
        yield ""
        yield f"[{name}]"
        for key, value in inner.items():
            if value is not None:
                yield f"{key} = {toml(value)}"


def toml(value: Any) -> str:
    """Plain data as a TOML value; an entry of a table that is None is left out."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        inner = (f"{json.dumps(key)} = {toml(each)}" for key, each in value.items() if each is not None)
        return "{ " + ", ".join(inner) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(toml, value)) + "]"
    return repr(value)
