"""Signals are heard wherever they come, also where Python ignores what is raised."""

import os
import signal
import time
import weakref

import pytest

from spherical_wrist.cli.signals import Stopped, noted, stopping

SOON = 100_000
"""Turns of a loop within which a signal is handled."""


class Finalized:
    """Gets a signal in its finalizer."""

    def __init__(self, number):
        self.number = number

    def __del__(self):
        here(self.number)


class Plain:
    pass


def here(number, *_):
    os.kill(os.getpid(), number)
    for _ in range(SOON):
        pass


def by_finalizer(number):
    Finalized(number)


def by_weak_reference(number):
    thing = Plain()
    weakref.finalize(thing, here, number)
    del thing


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("where", [here, by_finalizer, by_weak_reference])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_is_heard(number, where):
    def work():
        where(number)
        for _ in range(200):
            time.sleep(0.01)

    before = signal.getsignal(number)
    with pytest.raises(Stopped) as stopped, stopping():
        work()
    assert stopped.value.number == number
    assert signal.getsignal(number) is before


@pytest.mark.parametrize("where", [here, by_finalizer])
def test_a_signal_is_noted_once_and_the_next_acts_as_usual(where):
    with noted() as received:
        where(signal.SIGINT)
        for _ in range(200):
            if received:
                break
            time.sleep(0.01)
        assert received == [signal.SIGINT]
        with pytest.raises(KeyboardInterrupt):
            here(signal.SIGINT)
    assert received == [signal.SIGINT]
