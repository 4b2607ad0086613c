"""Validation of a campaign before its first episode: laws, periods, the ends of every distribution."""

from collections.abc import Iterator, Mapping
from functools import lru_cache
from itertools import islice, product
from typing import Any

from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.distribution import Distribution
from spherical_wrist.campaign.episode import changed
from spherical_wrist.errors import ParameterError, WristError
from spherical_wrist.experiment.description import Experiment
from spherical_wrist.loop.engine import compiled_engine
from spherical_wrist.wrist import Wrist, WristFile

MOST_OPTIONS, MOST_CORNERS, FIRST_SAMPLES = 64, 256, 16


def validate(campaign: Campaign) -> None:
    """Compile the laws, and check experiments at the ends of the distributions and those of the first samples.

    The ends of a distribution are the expected extremes of so many samples. An episode that is still invalid when it is
    run is stored as such.

    Raises:
        LawError: a law cannot be compiled.
        ModelError: a MJCF file is not a wrist.
        ParameterError: an experiment is not valid; the message has the values.
    """
    engine = compiled_engine()
    for label, base in campaign.bases.items():
        engine.step(base.law)
        if "disturbance.level" in campaign.distributions and base.disturbance.amplitude is not None:
            raise ParameterError("vary disturbance.level: it has no effect beside experiment.disturbance.amplitude")
        for values in _extremes(campaign.distributions, campaign.sample_count):
            try:
                _check(changed(base, values))
            except WristError as error:
                reached = ", ".join(f"{name} = {value}" for name, value in values.items())
                advice = "; truncated_normal keeps within bounds" if "normal" in str(campaign.vary) else ""
                raise ParameterError(f"the design reaches {reached} under {label!r}: {error}{advice}") from None
    _check_first_samples(campaign)


def _check(experiment: Experiment) -> None:
    experiment.timing(_wrist(experiment.wrist_file))


@lru_cache(maxsize=8)
def _wrist(file: WristFile) -> Wrist:
    return file.load()


def _check_first_samples(campaign: Campaign) -> None:
    """Check the first samples: a distribution may be invalid everywhere between its ends, as of a duration."""
    reasons = []
    for episode in campaign.episodes(0, min(campaign.size, FIRST_SAMPLES * len(campaign.bases))):
        try:
            _check(episode.experiment())
            return
        except WristError as error:
            reasons.append(str(error))
    raise ParameterError(f"none of the first {len(reasons)} episodes is valid; the first: {reasons[0]}")


def _extremes(vary: Mapping[str, Distribution], samples: int) -> Iterator[dict[str, Any]]:
    """Yield values to try: none varied, each parameter at its ends or at all of its options, then corners."""
    yield {}
    ends: dict[str, list[Any]] = {}
    for name, distribution in vary.items():
        outermost = 0.5 / max(samples, 2)
        ends[name] = [distribution.value(outermost), distribution.value(1.0 - outermost)]
        for value in distribution.options[:MOST_OPTIONS] if distribution.options else ends[name]:
            yield {name: value}
    for corner in islice(product(*ends.values()), MOST_CORNERS):
        yield dict(zip(ends, corner, strict=True))
    yield {name: values[-1] for name, values in ends.items()}
