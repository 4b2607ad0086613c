"""Fixtures that every test may use."""

import pytest

from spherical_wrist.simulation.engine import Engine, compiled_engine
from spherical_wrist.wrist import Wrist


@pytest.fixture(scope="session")
def nominal() -> Wrist:
    """The wrist that comes with the package."""
    return Wrist.load()


@pytest.fixture(scope="session")
def engine() -> Engine:
    """The compiled loop."""
    return compiled_engine()
