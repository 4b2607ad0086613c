#!/usr/bin/env python3
"""Measure speed, size and memory that the README states, and report missed targets.

usage: scripts/benchmark.py [loop] [recording] [start] [memory] [campaign] [--json]

Without names, all sections run. Times are medians over interleaved repetitions in one process, so that their ratios are
valid on a machine whose speed drifts; times of commands are medians over processes. The exit code is 1 if a target is
missed.
"""

import argparse
import ctypes
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from campaign_benchmark import bench_campaign
from stopwatch import interleaved, ratio, timed

STEPS = 10_000
PLAIN_STEPS = 500
WRIST = str(Path(sys.executable).with_name("wrist"))


def bench_loop() -> Iterator[tuple[str, float, str, float | None]]:
    """Compare the closed loop with MuJoCo's bare step and with the same law in plain Python."""
    import mujoco
    import numpy as np
    from plain_loop import simulate_plainly

    from spherical_wrist import Experiment, simulate
    from spherical_wrist.compat import libmujoco
    from spherical_wrist.loop.rollout import Rollout, run_chunk
    from spherical_wrist.measure.metrics import MetricSettings
    from spherical_wrist.prepare.cache import RunCache
    from spherical_wrist.prepare.closed_loop import prepare
    from spherical_wrist.prepare.physics import physics_model
    from spherical_wrist.prepare.plant import perturbed
    from spherical_wrist.simulation.metric_accumulator import MetricAccumulator

    clock = ctypes.c_void_p.in_dll(ctypes.CDLL(str(libmujoco.library())), "mjcb_time")
    installed = clock.value  # set by the bindings, before anything is simulated

    @contextmanager
    def stock_clock() -> Iterator[None]:
        clock.value = installed
        try:
            yield
        finally:
            clock.value = None

    experiment, cache = Experiment(duration=STEPS / 1000), RunCache()
    nominal = experiment.nominal()
    plant = perturbed(nominal, experiment.perturbation)
    tuned = physics_model(plant, 0.001)
    datas = {model: mujoco.MjData(model) for model in (plant.model, tuned)}

    def bare(model: mujoco.MjModel) -> float:
        data = datas[model]
        mujoco.mj_resetData(model, data)
        data.qpos[:] = [np.cos(0.2), np.sin(0.2), 0, 0]
        return timed(lambda: mujoco.mj_step(model, data, STEPS)) / STEPS

    def stock() -> float:
        with stock_clock():
            return bare(plant.model)

    def loop_only() -> float:
        """Time per step of the compiled loop, without sampling of inputs, metrics and series."""
        spent, loop = 0.0, prepare(experiment, cache)
        never = MetricSettings(steady_from=np.inf, period=0.001, lever=(0.0, 0.0, 0.0), boundary_layer=None)
        metrics = MetricAccumulator(never, cache.engine)
        while loop.outcome is None:
            inputs = loop.next_inputs()
            rollout = Rollout(loop.parts, inputs, metrics.settings, metrics.totals, loop.widths)
            log = cache.log(len(inputs.time))
            began = time.perf_counter()
            (progress,) = run_chunk([rollout], cache.engine, log).progress
            spent += time.perf_counter() - began
            loop.record_progress(*progress)
        return spent / STEPS

    def whole() -> float:
        return simulate(experiment).wall_time / STEPS

    short = Experiment(duration=PLAIN_STEPS / 1000)
    run = simulate(short)
    plain = simulate_plainly(short, run.disturbance[0])
    difference = float(np.abs(plain[0] - run.attitude).max())

    def plainly() -> float:
        return timed(lambda: simulate_plainly(short, run.disturbance[0])) / PLAIN_STEPS

    tasks = {"stock": stock, "tuned": lambda: bare(tuned), "loop": loop_only, "whole": whole, "plain": plainly}
    times = interleaved(tasks, 15)
    for name, label in (
        ("stock", "bare mj_step, stock"),
        ("tuned", "bare mj_step, equally tuned"),
        ("loop", "closed loop, fuzzy law"),
        ("whole", "closed loop with sampling, series and metrics"),
        ("plain", "the same in plain Python and NumPy"),
    ):
        yield label, 1e6 * statistics.median(times[name]), "µs/step", None
    yield "closed loop / stock mj_step", ratio(times, "loop", "stock"), "", 0.65
    yield "closed loop / tuned mj_step", ratio(times, "loop", "tuned"), "", 1.4
    yield "closed loop / plain Python loop", ratio(times, "loop", "plain"), "", 1 / 40
    yield "whole simulation / plain Python loop", ratio(times, "whole", "plain"), "", None
    yield "largest difference of attitude to the plain loop", difference, "", 1e-9


def bench_recording() -> Iterator[tuple[str, float, str, float | None]]:
    """Measure writing and reading of a recording of 10 s at 1 kHz."""
    from spherical_wrist import Experiment, load_recording, record, simulate

    run = simulate(Experiment())
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.rrd"
        times = interleaved({"write": lambda: timed(lambda: record(run, path))}, 7)["write"]
        yield "recording 10 s at 1 kHz, writing", statistics.median(times), "s", 0.2
        yield "recording 10 s at 1 kHz, size", path.stat().st_size / 1e6, "MB", 5.0
        yield "reading it back", timed(lambda: load_recording(path)), "s", None


def command(*arguments: str, **environment: str) -> float:
    """Return the wall time of a command, from start to exit [s]."""
    full = {**os.environ, **environment}
    return timed(lambda: subprocess.run([WRIST, *arguments], stdout=subprocess.DEVNULL, check=True, env=full))


def bench_start() -> Iterator[tuple[str, float, str, float | None]]:
    """Measure whole commands, from shell prompt to shell prompt."""
    with tempfile.TemporaryDirectory() as folder:
        output = str(Path(folder) / "run.rrd")
        cold = [command("run", "-o", output, WRIST_CACHE_DIR=f"{folder}/{n}") for n in range(3)]
        tasks = {"help": lambda: command("--help"), "run": lambda: command("run", "-o", output)}
        warm = interleaved(tasks, 7)
    yield "wrist --help", statistics.median(warm["help"]), "s", 0.3
    yield "wrist run, 10 s with recording, warm", statistics.median(warm["run"]), "s", 2.5
    yield "wrist run, 10 s with recording, first ever (compiles)", statistics.median(cold), "s", None


LAUNCHER = """
import os, subprocess, sys
process = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL)
_, status, usage = os.wait4(process.pid, 0)
print(usage.ru_maxrss)
sys.exit(bool(status))
"""


def peak_memory(*arguments: str) -> float:
    """Return the peak resident memory of a command [MB].

    A process inherits the peak of its parent, so a small launcher starts the command.
    """
    launch = [sys.executable, "-I", "-S", "-c", LAUNCHER, WRIST, *arguments]
    done = subprocess.run(launch, capture_output=True, text=True, check=True)
    return int(done.stdout) * (1 if sys.platform == "darwin" else 1024) / 1e6


def bench_memory() -> Iterator[tuple[str, float, str, float | None]]:
    """Compare the peak memory of a long run without recording with that of a short one."""
    duration = {"short": "10", "long": "1000"}
    peaks = interleaved(
        {name: lambda d=d: peak_memory("run", "--no-recording", "--duration", d) for name, d in duration.items()}, 3
    )
    yield "peak memory, 10 s simulated", statistics.median(peaks["short"]), "MB", None
    yield "peak memory, 1000 s simulated", statistics.median(peaks["long"]), "MB", None
    yield "peak memory, 1000 s / 10 s", ratio(peaks, "long", "short"), "", 1.1


SECTIONS = {
    "loop": bench_loop,
    "recording": bench_recording,
    "start": bench_start,
    "memory": bench_memory,
    "campaign": bench_campaign,
}


def main() -> int:
    """Run the given sections, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sections", nargs="*", help=f"any of {', '.join(SECTIONS)}; default: all")
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    arguments = parser.parse_args()
    unknown = set(arguments.sections) - set(SECTIONS)
    if unknown:
        parser.error(f"no section {', '.join(sorted(unknown))}: choose from {', '.join(SECTIONS)}")
    results = []
    for name in arguments.sections or SECTIONS:
        for label, value, unit, limit in SECTIONS[name]():
            met = limit is None or value <= limit
            results.append({"what": label, "value": value, "unit": unit, "limit": limit, "met": met})
            if not arguments.json:
                target = "" if limit is None else f"{'≤' if met else 'MISSED: >'} {limit:.4g}"
                print(f"{label:<56} {value:>10.4g} {unit:<8} {target}", flush=True)
    if arguments.json:
        print(json.dumps(results, indent=2, ensure_ascii=False))
    return 0 if all(result["met"] for result in results) else 1


if __name__ == "__main__":
    sys.exit(main())
