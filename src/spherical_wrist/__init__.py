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
``paper``; and ``cli`` on all of them.
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from spherical_wrist.assertions import assert_tracks
    from spherical_wrist.errors import WristError
    from spherical_wrist.experiment.description import Experiment
    from spherical_wrist.recording.runs import load_recording, record
    from spherical_wrist.simulation.run import Run
    from spherical_wrist.simulation.simulate import simulate

__all__ = ["Experiment", "Run", "WristError", "assert_tracks", "load_recording", "record", "simulate"]

_HOMES = {
    "Experiment": "experiment.description",
    "Run": "simulation.run",
    "WristError": "errors",
    "assert_tracks": "assertions",
    "load_recording": "recording.runs",
    "record": "recording.runs",
    "simulate": "simulation.simulate",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return __all__


if "gymnasium" in sys.modules:
    import_module(f"{__name__}.environment")
