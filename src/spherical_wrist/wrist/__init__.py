"""The wrist: an MJCF model with a ball joint that carries a tool, and three torque motors on that joint."""

from spherical_wrist.wrist.mjcf import REFUSALS, default_model
from spherical_wrist.wrist.model_files import model_files, portable
from spherical_wrist.wrist.named_files import check_confined
from spherical_wrist.wrist.parts import Names, name_of
from spherical_wrist.wrist.wrist import Wrist, WristFile

__all__ = [
    "REFUSALS", "Names", "Wrist", "WristFile", "check_confined", "default_model", "model_files", "name_of", "portable",
]  # fmt: skip
