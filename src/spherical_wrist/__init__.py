"""A MuJoCo simulation and control bench for a surgical wrist on a ball joint.

The names below are loaded when they are first used, so that importing the package costs nothing. Where Gymnasium is
imported already, importing this package registers its environments.
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from spherical_wrist.assertions import assert_tracks
    from spherical_wrist.errors import WristError
    from spherical_wrist.experiment.description import Experiment
    from spherical_wrist.experiment.recordings import load_recording, record
    from spherical_wrist.experiment.run import Run
    from spherical_wrist.experiment.simulate import simulate

__all__ = ["Experiment", "Run", "WristError", "assert_tracks", "load_recording", "record", "simulate"]

_HOMES = {
    "Experiment": "experiment.description",
    "Run": "experiment.run",
    "WristError": "errors",
    "assert_tracks": "assertions",
    "load_recording": "experiment.recordings",
    "record": "experiment.recordings",
    "simulate": "experiment.simulate",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return __all__


if "gymnasium" in sys.modules:
    import_module(f"{__name__}.environment")
