"""Run in a viewer while they are simulated."""

from spherical_wrist.experiment.description import Experiment
from spherical_wrist.prepare.plant import plant_of
from spherical_wrist.recording.address import Address
from spherical_wrist.recording.experiment_text import experiment_text, title
from spherical_wrist.recording.live import LiveView
from spherical_wrist.recording.plots import ranges
from spherical_wrist.recording.relay import Closing
from spherical_wrist.recording.runs import properties_of
from spherical_wrist.simulation.run import Run


def live_view(experiment: Experiment, address: Address | None = None, record_every: int = 1) -> LiveView:
    """A viewer that shows a run of an experiment: give its ``show`` to ``simulate(..., watch=view.show)``.

    Args:
        experiment: what will be run.
        address: where the viewer listens; port 9876 of this machine if nothing else is said.
        record_every: as it is given to ``simulate``.

    Raises:
        ViewerError: no viewer listens there.
        WristError: the experiment's model is not a wrist, or its periods do not fit.
    """
    plant = plant_of(experiment)
    samples = experiment.timing(plant).samples
    description = experiment.model_dump(mode="json")
    texts = title(description), experiment_text(description)
    return LiveView(address or Address(), plant, *texts, -(-samples // record_every), experiment.bound)


def close_view(view: LiveView, run: Run) -> str:
    """Show in a viewer how a run ended.

    Returns:
        What the viewer did not show, in a line; empty where it shows everything.
    """
    rows = len(run)
    ends = ranges(run, run.measurement.bound) if rows else {}
    return view.close(Closing(properties_of(run), ends, rows, run.every))
