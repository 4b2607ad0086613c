"""Dask clusters that run batches: threads of this process, processes of this machine, remote workers.

The only file that imports Dask, which is the queue, the pool and the protocol. Whoever can talk to a Dask process can
run code in it. The worker processes of this machine therefore talk by TLS with an identity that is made for one
cluster, on the loopback interface only: other users of the machine are refused. Without worker processes, nothing
listens at all.
"""

import gc
import logging
import multiprocessing
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import ExitStack, contextmanager
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import dask
from distributed import (
    Client,
    KilledWorker,
    Nanny,
    Reschedule,
    Scheduler,
    SpecCluster,
    Status,
    Worker,
    as_completed,
    get_worker,
)
from distributed.comm import CommClosedError
from distributed.security import Security

from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.errors import Interruption, ParameterError, one_line
from spherical_wrist.loop.outcome import StoppedError
from spherical_wrist.simulation.runner import cores

Task = TypeVar("Task")
Result = TypeVar("Result")

THREADS_OF_A_WORKER = 4
"""Most threads of a worker: with more, the Python code between two loops, one thread at a time, would slow them."""

LOOPBACK = "127.0.0.1"

ALLOWED_FAILURES = 10
"""Workers of this machine that may die at one task before it is given up."""

ENDING = {Status.closing, Status.closed, Status.failed}
"""States of a worker in which it takes no more results."""

CLOSING = 5.0
"""Timeout [s] for a cluster to close."""


class Tls(NamedTuple):
    """PEM files of a TLS connection.

    Attributes:
        ca: certificate of the authority that signed those of scheduler and workers.
        cert: certificate of this end.
        key: its key.
    """

    ca: Path
    cert: Path
    key: Path


class Cluster(NamedTuple):
    """Cluster to run on.

    Attributes:
        scheduler: address of a Dask scheduler (tcp://host:port, tls://host:port) or path of its scheduler file; None
            for this machine.
        workers: worker processes on this machine; 0 for the threads of this process; None for a suitable number.
        threads: threads of each, None for a suitable number.
        tls: files for tls:// addresses; without them, Dask's own configuration says which.
    """

    scheduler: str | None = None
    workers: int | None = None
    threads: int | None = None
    tls: Tls | None = None

    def shape(self) -> tuple[int, int]:
        """Return the number of worker processes on this machine, and of threads of each."""
        available, workers = cores(), self.workers
        if workers is None:
            wanted = self.threads or min(available, THREADS_OF_A_WORKER)
            workers = 0 if wanted >= available or self.threads else -(-available // wanted)
        return workers, self.threads or max(1, min(-(-available // max(workers, 1)), available))


@contextmanager
def connected(cluster: Cluster) -> Iterator[Client]:
    """Connect to the cluster; a cluster started for it is closed afterwards.

    Raises:
        ParameterError: the address or the TLS files cannot be used.
        CampaignError: nobody answers at the address.
    """
    with _quiet(), ExitStack() as stack:
        if cluster.scheduler is None:
            client = Client(stack.enter_context(_local(*cluster.shape())), set_as_default=False)
        else:
            client = _remote(cluster.scheduler, cluster.tls)
        stack.callback(client.close, timeout=CLOSING)
        yield client


def run_all(
    client: Client, function: Callable[..., Result], tasks: Iterable[Task], arguments: Callable[[Task], tuple[Any, ...]]
) -> Iterator[tuple[Task, Result]]:
    """Run a function on every task, and yield each task with its result as soon as it is done, in any order.

    A few tasks for each thread are in flight at any time, so that neither tasks nor results pile up. The tasks of a
    worker that dies are given to another.

    Args:
        client: of the cluster.
        function: what to run; importable on the workers.
        tasks: anything.
        arguments: returns the arguments of the function for a task. The function may raise StoppedError if
            :func:`closing`.

    Raises:
        CampaignError: the scheduler has gone, or a task ended every worker that tried it.
        WristError: raised by the function.
    """
    rest = iter(tasks)
    running: dict[Any, Task] = {}

    def submitted(count: int) -> list[Any]:
        fresh = {
            client.submit(_returned, function, arguments(task), pure=False): task
            for task in islice(rest, max(count, 0))
        }
        running.update(fresh)
        return list(fresh)

    try:
        done = as_completed(submitted(_ahead(client)), loop=client.loop)
        for future in done:
            task, result = running.pop(future), future.result()
            done.update(submitted(_ahead(client) - len(running)))
            yield task, result
    except KilledWorker as error:
        raise CampaignError(f"a task ended all of {error.allowed_failures + 1} workers that tried it") from None
    except (CancelledError, CommClosedError):
        raise CampaignError("the connection to the scheduler is lost") from None


def _returned(function: Callable[..., Result], arguments: tuple[Any, ...]) -> Result:
    """Call the function; a task that stops itself goes back to the scheduler."""
    try:
        return function(*arguments)
    except StoppedError:
        raise Reschedule from None


def closing() -> bool:
    """Return True if this thread works for a worker that is being closed, so that its result is lost."""
    try:
        return get_worker().status in ENDING
    except ValueError:  # for none
        return False


def _ahead(client: Client) -> int:
    """Compute the number of tasks in flight: one for each thread, and one for it to go on with."""
    threads: dict[str, int] = client.nthreads()
    return max(2 * sum(threads.values()), 2)


class _Closed:
    """Part of a process of a cluster that serves no page about itself, which every user of the machine could read."""

    def start_http_server(self, *_: Any, **__: Any) -> None:
        """Serve no page."""


class _Scheduler(_Closed, Scheduler):
    pass


class _Worker(_Closed, Worker):
    pass


@contextmanager
def _local(workers: int, threads: int) -> Iterator[SpecCluster]:
    """Start threads of this process if ``workers`` is 0, else worker processes."""
    security = Security.temporary() if workers else Security()
    every: dict[str, Any] = {
        "protocol": "tls://" if workers else "inproc://",
        "host": LOOPBACK if workers else None,
        "security": security,
        "needs_workdir": False,
    }
    one: dict[str, Any] = {**every, "nthreads": threads, "memory_limit": 0, "silence_logs": logging.CRITICAL}
    worker = {"cls": Nanny, "options": one | {"worker_class": _Worker}} if workers else {"cls": _Worker, "options": one}
    with _scratch() as scratch:
        settings = {
            "temporary-directory": scratch,
            "distributed.scheduler.http.routes": [],
            "distributed.worker.http.routes": [],
            "distributed.worker.profile.enabled": False,  # would stop the threads a hundred times a second to look
            "distributed.scheduler.allowed-failures": ALLOWED_FAILURES,
            "distributed.admin.tick.interval": "1s",  # each event loop would look at the clock fifty times a second
            "distributed.admin.log-length": 10,  # of messages and transitions that nobody asks for
            "distributed.admin.low-level-log-length": 10,
            "distributed.diagnostics.computations.max-history": 1,
        }
        before = set(multiprocessing.active_children())
        cluster = None
        try:
            with dask.config.set(settings):
                cluster = SpecCluster(
                    scheduler={"cls": _Scheduler, "options": {**every, "dashboard": False}},
                    workers=dict.fromkeys(range(workers or 1), worker),
                    security=security,
                    silence_logs=logging.CRITICAL,
                )
            yield cluster
        except (KeyboardInterrupt, Interruption):
            _kill_children(before)  # a command that is stopped does not wait
            raise
        finally:
            if cluster is not None:
                try:
                    cluster.close(timeout=CLOSING)
                except (TimeoutError, AssertionError):  # of a worker process that is just being started anew
                    _kill_children(before)


def _kill_children(before: set[Any]) -> None:
    """End the processes that were started since, without waiting."""
    for child in set(multiprocessing.active_children()) - before:
        child.kill()


@contextmanager
def _scratch() -> Iterator[str]:
    """Make a folder for Dask, which puts it into the path of Python's modules.

    By default, that is a folder that any user of the machine may have made. It may not stay in the path either, where
    another user could make it again.
    """
    with tempfile.TemporaryDirectory(prefix="wrist-sweep-") as folder:
        try:
            yield folder
        finally:
            sys.path[:] = [each for each in sys.path if not each.startswith(folder)]


def _remote(address: str, tls: Tls | None) -> Client:
    if tls is not None and not address.startswith("tls://"):
        raise ParameterError(f"--scheduler {address}: with TLS files, an address that begins with tls:// is needed")
    if ":" not in address and not Path(address).is_file():
        raise ParameterError(f"--scheduler {address!r}: no such scheduler file; give it, or tcp://host:port")
    where = {"scheduler_file": address} if Path(address).is_file() else {"address": address}
    security = _security(tls) if address.startswith("tls://") else None
    try:
        return Client(**where, security=security, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise CampaignError(f"no scheduler can be reached at {address}: {one_line(error)}") from None


def _security(tls: Tls | None) -> Security:
    if tls is None:
        return Security(require_encryption=True)  # files from Dask's own configuration
    for file in tls:
        if not file.is_file():
            raise ParameterError(f"TLS file {str(file)!r}: no such file")
    files = {"tls_ca_file": str(tls.ca), "tls_client_cert": str(tls.cert), "tls_client_key": str(tls.key)}
    return Security(require_encryption=True, **files)


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence Dask, which logs a page when a worker or a scheduler dies: the error here says it in one line."""
    # asyncio logs the timeouts of connections that nobody waits for any more when they are collected as garbage
    names = ["asyncio", *(name for name in logging.root.manager.loggerDict if name.split(".")[0] == "distributed")]
    before = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        gc.collect()
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)
