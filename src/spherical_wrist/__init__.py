"""A MuJoCo simulation and control bench for a surgical wrist on a ball joint.

The names below are loaded when they are first used, so that importing the package costs nothing. Where Gymnasium is
imported already, importing this package registers its environments.

One experiment goes through these rooms, in this order:

- ``experiment``: its description, validated and frozen. The parts that it names are declared in ``control`` (laws),
  ``reference``, ``disturbance``, ``sensing`` and ``actuation``.
- ``prepare``: from the description to models, sampled inputs and a compiled law.
- ``loop``: arrays in, log out, in machine code or plain Python.
- ``measure``: from the log to the series of the run and its metrics.
- ``simulation``: runs one experiment or many through these three, and has the result, a run.
- ``recording``: writes a run to a Rerun file and reads it back.

``channels`` and ``measure.metrics`` are the tables of all that a run has. The other rooms stand on runs:
``inspection``, ``film``, ``comparison``, ``stability``, ``campaign``, ``report``, ``tuning``, ``environment``,
``paper``; ``api``, with the functions below, and ``cli`` on all of them.
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from spherical_wrist.api.compare import compare
    from spherical_wrist.api.frontier import Frontier, frontier
    from spherical_wrist.api.margins import Margins, margins
    from spherical_wrist.api.simulate import simulate
    from spherical_wrist.api.sweep import CampaignResults, load_campaign, sweep
    from spherical_wrist.assertions import assert_tracks
    from spherical_wrist.comparison.results import Comparison
    from spherical_wrist.control import Law
    from spherical_wrist.errors import WristError
    from spherical_wrist.experiment.description import Experiment
    from spherical_wrist.recording.runs import load_recording, record
    from spherical_wrist.simulation.run import Run

    __version__: str

_HOMES = {
    "CampaignResults": "api.sweep",
    "Comparison": "comparison.results",
    "Experiment": "experiment.description",
    "Frontier": "api.frontier",
    "Law": "control",
    "Margins": "api.margins",
    "Run": "simulation.run",
    "WristError": "errors",
    "assert_tracks": "assertions",
    "compare": "api.compare",
    "frontier": "api.frontier",
    "load_campaign": "api.sweep",
    "load_recording": "recording.runs",
    "margins": "api.margins",
    "record": "recording.runs",
    "simulate": "api.simulate",
    "sweep": "api.sweep",
}
"""Modules of the names below. The imports above are the same for type checkers, which run nothing; a test compares."""

__all__ = [
    "CampaignResults",
    "Comparison",
    "Experiment",
    "Frontier",
    "Law",
    "Margins",
    "Run",
    "WristError",
    "__version__",
    "assert_tracks",
    "compare",
    "frontier",
    "load_campaign",
    "load_recording",
    "margins",
    "record",
    "simulate",
    "sweep",
]


if not TYPE_CHECKING:  # for type checkers, every name would be there

    def __getattr__(name: str) -> Any:
        if name == "__version__":
            return import_module(f"{__name__}.versions").package_version("spherical-wrist")
        if name not in _HOMES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return __all__


if "gymnasium" in sys.modules:
    import_module(f"{__name__}.environment")
