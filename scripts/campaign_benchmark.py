"""Benchmark of campaigns: cost of scheduling, storage and metrics beside the compiled loop."""

import shutil
import statistics
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from stopwatch import interleaved, ratio, timed

CAMPAIGN_ROUNDS, CAMPAIGN_EPISODES = 5, 2_000
SHORT_EPISODES = (1_000, 100_000)


def bench_campaign() -> Iterator[tuple[str, float, str, float | None]]:
    """Measure campaigns: by threads, relative to the compiled loop alone, on worker processes, and by size."""
    import mujoco

    from spherical_wrist import Experiment
    from spherical_wrist.campaign.cluster import Cluster
    from spherical_wrist.campaign.description import Campaign
    from spherical_wrist.campaign.folder import Folder, campaign_lock
    from spherical_wrist.campaign.sweep import Listener, sweep
    from spherical_wrist.loop.rollout import Rollout, run_chunk
    from spherical_wrist.prepare.cache import RunCache
    from spherical_wrist.prepare.closed_loop import prepare
    from spherical_wrist.simulation.metric_accumulator import MetricAccumulator

    root = Path(tempfile.mkdtemp())
    made = iter(range(10**6))

    def swept(samples: int, duration: float, cluster: Cluster) -> float:
        """Return the wall time of a sweep with the fuzzy law: cluster, episodes, metrics, files [s]."""
        file, folder = root / f"{next(made)}.toml", root / f"{next(made)}"
        file.write_text(
            f'laws = ["fuzzy_sliding_computed_torque"]\nsamples = {samples}\n[experiment]\nduration = {duration}\n'
            '[vary]\nmass_scale = {uniform = [0.5, 1.5]}\n"disturbance.level" = {uniform = [0.0, 0.3]}\n'
        )
        with campaign_lock(folder):
            begun = Folder.create(folder, file, Campaign.from_toml(file))
            elapsed = timed(lambda: sweep(begun, cluster, Listener()))
        shutil.rmtree(folder)
        return elapsed

    def bare(threads: int, episodes: int) -> float:
        """Return the wall time of the compiled loop alone, for episodes of 2 s divided among threads [s]."""
        experiment, calls = Experiment(duration=2.0), []
        for _ in range(threads):
            cache = RunCache()
            wrist = cache.wrist(experiment.wrist_file)
            models = cache.models(experiment.wrist_file, experiment.perturbation, experiment.timing(wrist))
            loop = prepare(experiment, cache, models=models)
            metrics = MetricAccumulator(experiment.measurement(wrist), cache.engine)
            rollout = Rollout(loop.parts, loop.next_inputs(), metrics.settings, metrics.totals, loop.widths)
            calls.append((rollout, cache, models.plant, models.data))

        def run(call: tuple[Any, ...]) -> None:
            rollout, cache, model, data = call
            q, w = data.qpos.copy(), data.qvel.copy()
            log = cache.log(len(rollout.inputs.time))
            for _ in range(episodes // threads):
                mujoco.mj_resetData(model, data)
                data.qpos[:], data.qvel[:] = q, w
                rollout.parts.settings["first"] = 0
                run_chunk([rollout], cache.engine, log)

        team = [threading.Thread(target=run, args=(call,)) for call in calls]

        def together() -> None:
            for thread in team:
                thread.start()
            for thread in team:
                thread.join()

        return timed(together)

    one, two = Cluster(workers=0, threads=1), Cluster(workers=0, threads=2)
    count, bare_count = CAMPAIGN_EPISODES, CAMPAIGN_EPISODES // 2
    swept(20, 2.0, one)  # compiles
    tasks = {
        "one": lambda: swept(count, 2.0, one) / count,
        "two": lambda: swept(count, 2.0, two) / count,
        "bare one": lambda: bare(1, bare_count) / bare_count,
        "bare two": lambda: bare(2, bare_count) / bare_count,
    }
    times = interleaved(tasks, CAMPAIGN_ROUNDS)
    middle = {name: statistics.median(found) for name, found in times.items()}
    yield f"{CAMPAIGN_ROUNDS * count:,} episodes of 2 s, fuzzy law, 1 thread", 1.0 / middle["one"], "1/s", None
    yield "the same, 2 threads", 1.0 / middle["two"], "1/s", None
    yield "the compiled loop alone, 2 threads", 1.0 / middle["bare two"], "1/s", None
    yield "time of a campaign, 2 threads / 1 thread", ratio(times, "two", "one"), "", 1 / 1.8
    yield "time of the compiled loop alone, 2 threads / 1 thread", ratio(times, "bare two", "bare one"), "", None
    yield "campaign / compiled loop alone, 1 thread", ratio(times, "one", "bare one"), "", 1 / 0.9
    yield "campaign / compiled loop alone, 2 threads", ratio(times, "two", "bare two"), "", 1 / 0.9

    spread = {workers: Cluster(workers=workers, threads=1) for workers in (1, 2)}
    times = interleaved({str(n): lambda c=c: swept(count, 2.0, c) / count for n, c in spread.items()}, 2)
    for workers, found in times.items():
        yield f"episodes of 2 s, worker processes: {workers}", 1.0 / statistics.median(found), "1/s", None
    few, many = SHORT_EPISODES
    times = interleaved({str(n): lambda n=n: swept(n, 0.05, two) / n for n in SHORT_EPISODES}, 2)
    for number, found in times.items():
        yield f"{int(number):,} episodes of 0.05 s, each", 1e3 * statistics.median(found), "ms", None
    yield f"cost of an episode, {many:,} / {few:,} episodes", ratio(times, str(many), str(few)), "", 1.1
    shutil.rmtree(root)
