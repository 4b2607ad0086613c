"""Assertions for tests: that a law keeps to an error bound on a whole family of perturbed wrists.

In a test of your own::

    from spherical_wrist.assertions import RandomWrists, WristGrid, assert_tracks

    def test_my_law_is_precise_enough_for_coronaries():
        assert_tracks("my_law.py:MyLaw", max_tip_error_mm=0.1)

    def test_it_carries_a_needle():
        family = WristGrid(payload=(0.0, 0.005, 0.01), disturbance=(0.0,))
        results = assert_tracks("computed_torque_observer", rms_error_rad=1e-3, family=family)
        assert max(result.metrics.peak_torque_Nm for result in results) < 0.1

    def test_it_does_so_with_real_sensors():
        family = RandomWrists(samples=10, seed=7)
        assert_tracks("slotine_li", max_error_rad=0.01, family=family, experiment={"sensing": "realistic"})

Where it fails, the message has the worst wrist of the family and the command that replays it. To see every wrist as a
test of its own::

    @pytest.mark.parametrize("experiment", WristGrid().experiments(Experiment(law="pd")), ids=command_of)
    def test_pd_stays_upright(experiment):
        assert simulate(experiment).outcome.status == "completed"
"""

from collections.abc import Mapping
from functools import partial
from math import inf
from typing import Any, NamedTuple

from spherical_wrist.comparison.bounds import Bounds, checked, excess, require
from spherical_wrist.comparison.family import RandomWrists, WristFamily, WristGrid
from spherical_wrist.control import Law
from spherical_wrist.errors import WristError
from spherical_wrist.experiment.command import command_of, law_address
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.loop.outcome import Outcome, Status
from spherical_wrist.measure.metrics import Metrics
from spherical_wrist.simulation.runner import Runner, Worker
from spherical_wrist.simulation.verdict import Verdict

__all__ = ["RandomWrists", "Tracked", "WristFamily", "WristGrid", "assert_tracks", "command_of"]


class Tracked(NamedTuple):
    """One wrist of a family, simulated.

    Attributes:
        experiment: what was run.
        outcome: how the run ended.
        metrics: how well it tracked.
        verdict: verdict on the run, by the bound on the tip error that is asserted or else that of the experiment.
    """

    experiment: Experiment
    outcome: Outcome
    metrics: Metrics
    verdict: Verdict

    def excess(self, bounds: Bounds) -> float:
        """The largest of the figures as a multiple of its bound; infinite where the run did not complete."""
        if self.outcome.status is not Status.COMPLETED:
            return inf
        return max(excess(self.metrics, bounds).values())


def assert_tracks(
    law: Law | type[Law] | str | Mapping[str, Any],
    *,
    family: WristFamily | None = None,
    experiment: Experiment | Mapping[str, Any] | None = None,
    jobs: int | None = None,
    **bounds: float | None,
) -> list[Tracked]:
    """Assert that a law completes every run of a family, within all of the bounds that are given.

    Args:
        law: a name, ``path/to/file.py:Name``, a table of a name and parameters, an instance, or a class, which may be
            one of the test file itself.
        family: the wrists; ``WristGrid()`` where none is given.
        experiment: everything else, as an experiment or as values of its parameters; its law is not used.
        jobs: runs at a time; None for as many as there are cores. The results do not depend on it.
        bounds: upper bounds on metrics by name, in their units; None for none. See
            :data:`spherical_wrist.measure.metrics.METRICS`. A run without a value, such as the reaching time where the
            surface is never reached, misses the bound.

    Returns:
        Every run, in the order of the family.

    Raises:
        AssertionError: a run exceeds a bound or does not complete. The message says which law missed which bound on how
            many wrists, and has the worst one with its figures and the command that replays it.
        UnknownNameError: there is no metric of such a name.
        WristError: what is given is not valid, a run does not have the metric, or the law raises.
    """
    __tracebackhide__ = True  # pytest shows the line that called
    limits = checked({name: bound for name, bound in bounds.items() if bound is not None})
    values = dict(experiment) if experiment is not None else {}
    wrists = family if family is not None else WristGrid()
    judged = {"bound": limits["max_tip_error_mm"]} if "max_tip_error_mm" in limits else {}
    work = wrists.experiments(Experiment(**{**values, **judged, "law": law}))
    results = Runner(jobs).map(partial(_run, limits), work)
    missed = [result for result in results if result.excess(limits) > 1.0]
    if missed:
        # of runs that diverged, the one that did so first
        worst = max(missed, key=lambda result: (result.excess(limits), -result.outcome.time))
        raise AssertionError(_complaint(worst, len(missed), len(results), limits, wrists))
    return results


def _run(limits: Bounds, experiment: Experiment, worker: Worker) -> Tracked:
    run = worker.measure(experiment)
    require(limits, run.metrics)
    return Tracked(experiment, run.outcome, run.metrics, run.verdict)


def _complaint(worst: Tracked, missed: int, total: int, bounds: Bounds, family: WristFamily) -> str:
    wanted = " and ".join(f"{name} ≤ {bound:g}" for name, bound in bounds.items())
    found = str(worst.verdict)
    if worst.outcome.status is Status.COMPLETED:
        figures = (_against(name, worst.metrics[name], bound) for name, bound in bounds.items())
        found = f"{', '.join(figures)}; {found}"
    values = ", ".join(f"{name}={value!r}" for name, value in family)
    return "\n".join(
        (
            f"{worst.experiment.law.name} misses {wanted} on {missed} of {total} wrists",
            f"  worst:  {found}",
            f"  replay: {_replay(worst.experiment)}",
            f"  seed:   {worst.experiment.seed}",
            f"  family: {type(family).__name__}({values})",
        )
    )


def _against(name: str, figure: float | None, bound: float) -> str:
    if figure is None:
        return f"{name} has no value"
    return f"{name} = {figure:.4g} ({figure / bound:.3g} × the bound)"


def _replay(experiment: Experiment) -> str:
    """Return the command that replays an experiment, or the reason why there is none."""
    law = type(experiment.law)
    try:
        Law.member(law_address(law))  # the file of a test may need what only pytest gives it
        return command_of(experiment)
    except WristError as error:
        return f"{command_of(experiment, law=f'FILE.py:{law.__name__}')}\n          {error}"
