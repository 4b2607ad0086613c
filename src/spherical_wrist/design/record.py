"""Gains that searches found, kept in the package beside the seed and the budget by which they can be found again.

``found.json`` is an object with ``criterion`` (fingerprint of the constraints and the objective) and ``laws``, by name:
``seed``, ``trials``, ``gains``, ``objective``, ``figures`` and ``constraints`` (values by name; null for a margin
without end, or one that could not be measured). The defaults of the laws are these gains, which a test asserts.
"""

import json
from importlib.resources import files
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

from spherical_wrist.control import Law
from spherical_wrist.design.criterion import Assessment, fingerprint
from spherical_wrist.errors import ParameterError

NAME = "found.json"
TRIALS = 100
"""Sets of gains that a search tries."""


class Design(NamedTuple):
    """Gains of a law, and how they were found.

    Attributes:
        seed: seed of the search.
        trials: number of sets of gains that were to be tried.
        gains: gains by name.
        verdict: their figures and constraints.
    """

    seed: int
    trials: int
    gains: dict[str, float]
    verdict: Assessment

    def to_plain(self) -> dict[str, Any]:
        """Return the design as plain data for JSON."""
        return {
            "seed": self.seed,
            "trials": self.trials,
            "gains": self.gains,
            "objective": self.verdict.objective,
            "figures": self.verdict.figures,
            "constraints": {name: finite(value) for name, value in self.verdict.constraints.items()},
        }


def finite(value: float | None) -> float | None:
    """Return a number for JSON: None for one without end."""
    return value if value is not None and isfinite(value) else None


def shipped() -> dict[str, Any]:
    """Return the object described above, from the file in the package."""
    found: dict[str, Any] = json.loads(files("spherical_wrist.design").joinpath(NAME).read_text(encoding="utf-8"))
    return found


def kept_trials(law: Law) -> int:
    """Return the budget of the search that found the gains of a law; the usual one of a law that the package lacks."""
    kept = {} if law.files else shipped()["laws"]
    return int(kept[law.name]["trials"]) if law.name in kept else TRIALS


def merged(path: Path, designs: dict[str, Design]) -> dict[str, Any]:
    """Return the object described above, with designs added to those that a file has by the same criterion.

    Raises:
        ParameterError: the file is there and is none of these.
    """
    laws: dict[str, Any] = {}
    if path.exists():
        try:
            before = json.loads(path.read_text(encoding="utf-8"))
            laws = dict(before["laws"]) if before["criterion"] == fingerprint() else {}
        except (OSError, ValueError, KeyError, TypeError):
            raise ParameterError(f"{str(path)!r} is no file of wrist design: give another one with -o") from None
    laws.update({name: design.to_plain() for name, design in designs.items()})
    return {"criterion": fingerprint(), "laws": dict(sorted(laws.items()))}
