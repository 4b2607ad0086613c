"""Results of ``wrist design`` as plain tables for JSON.

The keys of the JSON object are stable:

===============  ====================================================================================================
``criterion``    fingerprint of the constraints and of the objective
``constraints``  ``name``, ``unit``, ``limit``, ``at_least`` (else at most), ``meaning``
``figures``      of the objective: ``name``, ``meaning``
``laws``         in their order: ``law`` (label), ``name``, ``status``, ``parameters``, ``constraints`` (by name:
                 ``value``, null for a margin without end and for what could not be measured; ``limit``, which a law may
                 promise to be tighter; ``met``; ``claimed``, and ``reason`` where the law does not claim it),
                 ``figures``, ``objective`` (null if a run is lost), ``gains_from`` (``criterion``: the defaults are the
                 gains that the package keeps as found; ``elsewhere``: the law says where; ``paper``; ``baseline``;
                 ``given``)
``found``        of a search, by law: ``seed``, ``trials``, ``gains``, and ``ranges`` (``low``, ``high``, ``unit``)
``versions``     of the packages and the platform
``files``        names of the files written
``wall_time_s``  time that all took
===============  ====================================================================================================
"""

from collections.abc import Mapping
from typing import Any

from spherical_wrist.control import Law
from spherical_wrist.design.criterion import CONSTRAINTS, FIGURES, Assessment, constraints_of, fingerprint
from spherical_wrist.design.record import finite, shipped
from spherical_wrist.simulation.run import versions


def to_dict(judged: Mapping[str, tuple[Law, Assessment]], wall_time: float) -> dict[str, Any]:
    """Return laws under the criterion as the JSON object described above."""
    return {
        "criterion": fingerprint(),
        "constraints": [
            {"name": each.name, "unit": each.unit, "limit": each.limit, "at_least": each.at_least,
             "meaning": each.meaning}
            for each in CONSTRAINTS
        ],
        "figures": [{"name": each.name, "meaning": each.meaning} for each in FIGURES],
        "laws": [_law(label, law, verdict) for label, (law, verdict) in judged.items()],
        "found": {},
        "versions": versions(),
        "files": [],
        "wall_time_s": wall_time,
    }  # fmt: skip


def _law(label: str, law: Law, verdict: Assessment) -> dict[str, Any]:
    broken, limits = verdict.broken(law), {each.name: each.limit for each in constraints_of(law)}
    return {
        "law": label,
        "name": law.name,
        "status": law.status,
        "parameters": {name: value for name, value in law.model_dump(mode="json").items() if name != "name"},
        "constraints": {
            name: {
                "value": finite(value),
                "limit": limits[name],
                "met": name not in broken,
                "claimed": name not in law.exempt,
                **({"reason": law.exempt[name]} if name in law.exempt else {}),
            }
            for name, value in verdict.constraints.items()
        },
        "figures": dict(verdict.figures),
        "objective": verdict.objective,
        "gains_from": gains_from(law),
    }


def gains_from(law: Law) -> str:
    """Return where the gains of a law come from: see ``gains_from`` above."""
    if law.gains_from and law == type(law)():
        return "elsewhere"
    kept = shipped()["laws"].get(law.name)
    if kept is not None and not law.files:
        return "criterion" if law == law.replaced(**kept["gains"]) else "given"
    return law.status if law.status in ("paper", "baseline") and law == type(law)() else "given"
