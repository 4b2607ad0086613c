"""Fixtures that every test may use."""

import os
import sys

import pytest
from hypothesis import settings

from spherical_wrist.cli import main
from spherical_wrist.simulation.engine import Engine, compiled_engine
from spherical_wrist.wrist import Wrist

# the first call of a test may compile for seconds; on CI a failure must come back when it is run again
settings.register_profile("wrist", deadline=None, derandomize="CI" in os.environ)
settings.load_profile("wrist")


@pytest.fixture(scope="session")
def nominal() -> Wrist:
    """The wrist that comes with the package."""
    return Wrist.load()


@pytest.fixture(scope="session")
def engine() -> Engine:
    """The compiled loop."""
    return compiled_engine()


@pytest.fixture
def wrist(capsys, monkeypatch, tmp_path):
    """Runs the command in this process, in an empty folder; gives exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def command(*arguments):
        monkeypatch.setattr(sys, "argv", ["wrist", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        printed = capsys.readouterr()
        return end.value.code or 0, printed.out, printed.err

    return command
