"""Experiment files of tuned gains, with their figures in comments."""

import shlex
from collections.abc import Iterator, Mapping
from typing import Any

from spherical_wrist.control import Law
from spherical_wrist.experiment.description import Experiment, toml
from spherical_wrist.measure.metrics import METRICS

MEANS = ("rms_error_rad", "chattering_Nm_per_s")
"""Metrics of which the means over the cases are written."""
OF_CASES = ("rms_error_rad", "max_tip_error_mm", "chattering_Nm_per_s")
"""Metrics that are written of each case."""


def gains_file(base: Experiment, law: Law, point: Mapping[str, Any], table: Mapping[str, Any], again: list[str]) -> str:
    """Return an experiment file for ``wrist run``: the law with tuned gains, in the experiment of the cases.

    Args:
        base: experiment that the cases change.
        law: the law with the tuned gains.
        point: their figures, an entry of ``front`` of :func:`spherical_wrist.tuning.pareto.summary_of`.
        table: summary of the whole search.
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
    for metric, ratio in zip((METRICS[name] for name in MEANS), of_default, strict=True):
        yield f"#   {metric.label:19}  {point[metric.name]:.6g} {metric.unit}{ratio}"
    yield "#"
    width = max(len(name) for name in point["cases"])
    headings = {name: METRICS[name].label_and_unit for name in OF_CASES}
    yield f"# {'case':{width}}  {'  '.join(headings.values())}"
    for case, figures in point["cases"].items():
        entries = (f"{figures[name]:>{len(heading)}.6g}" for name, heading in headings.items())
        yield f"# {case:{width}}  {'  '.join(entries)}"
    yield "#"
    yield f"# These figures again: {shlex.join(again)}"


def _experiment(base: Experiment, law: Law) -> Iterator[str]:
    """Yield the lines of all that differs from the default experiment, and of the whole law."""
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
