"""Margins as plain tables for JSON.

The keys of the JSON object are stable:

====================  ==================================================================================================
``disturbance``       ``level`` (a fraction, null for an absolute size) and ``size_Nm``, its bound on every axis
``attitude``          quaternion (w, x, y, z) about which the loops are linearised
``control_period_s``  control period
``laws``              in their order: ``law`` (label), ``name``, ``status``, ``option`` (value of ``--law`` that makes
                      it again), ``parameters``, ``stable``, ``reason`` (null, or why there is no linear loop: then all
                      figures are null), ``max_sensitivity``, ``gain_margin_db``, ``gain_reduction_margin_db``,
                      ``phase_margin_deg``, ``delay_margin_s``, ``disk_margin`` (of the loop that is cut at the plant's
                      input; null for a margin that has no end), ``bandwidth_hz``, ``worst_tip_error_mm``, ``cuts`` (by
                      place: the same margins, and of the ``axes``), ``ranges`` (null for a range that goes up to the
                      limit of the search), ``response`` (``frequency_hz``, ``sensitivity``, ``complementary``,
                      ``tip_mm_per_Nm``: largest singular values), ``worst`` (``gain_mm_per_Nm``, ``direction`` in the
                      world, ``levels`` of −1, 0 or 1 by control period, the last one first), ``command`` (runs the
                      worst disturbance)
``versions``          of the packages and the platform
``files``             names of the files written
``wall_time_s``       time that all took
====================  ==================================================================================================
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from spherical_wrist.comparison.law_selection import law_option
from spherical_wrist.errors import ParameterError
from spherical_wrist.experiment.command import command_of
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.simulation.run import versions
from spherical_wrist.stability.law_margins import LawMargins, LinearLoop

HEADLINE = (
    "max_sensitivity",
    "gain_margin_db",
    "gain_reduction_margin_db",
    "phase_margin_deg",
    "delay_margin_s",
    "disk_margin",
)
"""Margins of the loop cut at the plant's input that stand beside the name of a law."""


def to_dict(found: Sequence[LawMargins], at: float, wall_time: float) -> dict[str, Any]:
    """Return margins as the JSON object described above."""
    first = found[0]
    load = first.experiment.disturbance
    pose = first.experiment.drawn_reference.motion(np.array([at]))["attitude"][0]
    return {
        "disturbance": {"level": load.level if load.amplitude is None else None, "size_Nm": first.size},
        "attitude": pose.tolist(),
        "control_period_s": first.experiment.control_period,
        "laws": [_law(each) for each in found],
        "versions": versions(),
        "files": [],
        "wall_time_s": wall_time,
    }


def _law(found: LawMargins) -> dict[str, Any]:
    law, linear = found.experiment.law, found.linear
    at_input = None if linear is None else linear.margins["plant_input"]
    return {
        "law": found.law,
        "name": law.name,
        "status": law.status,
        "option": law_option(found.law, law),
        "parameters": {name: value for name, value in law.model_dump(mode="json").items() if name != "name"},
        "stable": linear is not None,
        "reason": found.reason or None,
        **{name: getattr(at_input, name, None) for name in HEADLINE},
        "bandwidth_hz": None if linear is None else linear.bandwidth_hz,
        "worst_tip_error_mm": found.worst_tip_error_mm,
        **(dict.fromkeys(("cuts", "ranges", "response", "worst")) if linear is None else _linear(linear)),
        "command": _command(found.experiment),
    }


def _linear(linear: LinearLoop) -> dict[str, Any]:
    return {
        "cuts": {
            place: {**each._asdict(), "axes": [axis._asdict() for axis in each.axes]}
            for place, each in linear.margins.items()
        },
        "ranges": dict(linear.ranges),
        "response": {
            "frequency_hz": linear.frequency.tolist(),
            "sensitivity": linear.sensitivity.tolist(),
            "complementary": linear.complementary.tolist(),
            "tip_mm_per_Nm": (1e3 * linear.tip).tolist(),
        },
        "worst": {
            "gain_mm_per_Nm": 1e3 * linear.worst.gain,
            "direction": linear.worst.direction.tolist(),
            "levels": linear.worst.levels.astype(int).tolist(),
        },
    }


def _command(experiment: Experiment) -> str | None:
    load = experiment.disturbance
    worst = experiment.replaced(disturbance={"name": "worst", "level": load.level, "amplitude": load.amplitude})
    try:
        return command_of(worst)
    except ParameterError:  # a law that is defined in the calling program has no command
        return None
