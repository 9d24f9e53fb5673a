"""Bodies unfolded side by side, each in a process of its own with limits of time and memory."""

from __future__ import annotations

import argparse
import csv
import multiprocessing as mp
import os
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field, fields
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

try:
    import resource as limits
except ImportError:  # Windows: --memory has no effect there
    limits = None


@dataclass
class Job:
    """A body under way in a process."""

    process: mp.process.BaseProcess
    pipe: Connection
    row: Any
    start: float = field(default_factory=time.monotonic)


def load_libraries() -> None:
    """Load the slow libraries before the processes part: a process then costs milliseconds."""
    import igl  # noqa: F401, TID251
    import pymeshlab  # noqa: F401, TID251

    import geounfold as gu

    assert gu.unfold


def started(work: Callable[[Any], None], row: Any, memory: int) -> Job:
    """Return a body's process, running.

    Parameters
    ----------
    work : callable
        ``work(row)`` unfolds the body and fills in its row; it lets no error pass.
    row : Row
        The body's.
    memory : int
        Limit in MiB; 0 for none.
    """
    context = mp.get_context("fork" if hasattr(os, "fork") else "spawn")
    mine, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_worker, args=(theirs, work, row, memory))
    process.start()
    theirs.close()
    return Job(process, mine, row)


def _worker(pipe: Connection, work: Callable[[Any], None], row: Any, memory: int) -> None:
    """Unfold one body under a memory limit, in silence, and send its row."""
    if memory and limits is not None:
        limits.setrlimit(limits.RLIMIT_AS, (memory << 20, memory << 20))
    devnull = os.open(os.devnull, os.O_WRONLY)
    os.dup2(devnull, 1)
    os.dup2(devnull, 2)
    work(row)
    pipe.send(row)
    pipe.close()


def finished(
    jobs: list[Job], seconds: float, stop: Callable[[Any, str, str], None]
) -> Iterator[Any]:
    """Wait for bodies to end; yield their rows and take them off the list.

    Parameters
    ----------
    jobs : list of Job
        Those under way.
    seconds : float
        Limit of each.
    stop : callable
        ``stop(row, how, message)`` fills in the row of a body that did not end by itself; how:
        ``timeout`` or ``killed``.
    """
    wait([job.pipe for job in jobs], timeout=0.5)
    for job in list(jobs):
        late = time.monotonic() - job.start > seconds
        if not (late or job.pipe.poll()):
            continue
        jobs.remove(job)
        row = job.row
        try:
            if job.pipe.poll():
                row = job.pipe.recv()
            else:
                row.seconds = seconds
                stop(row, "timeout", f"stopped after {seconds:.0f} s")
        except EOFError:
            job.process.join()
            stop(row, "killed", f"the process ended with status {job.process.exitcode}")
        job.process.kill()
        job.process.join()
        job.pipe.close()
        yield row


def tabulated(
    work: Callable[[Any], None],
    left: list[Any],
    args: argparse.Namespace,
    stop: Callable[[Any, str, str], None],
    tell: Callable[[Any], None],
) -> list[Any]:
    """Unfold all bodies; write a line of the table for each as it ends, and return their rows.

    Parameters
    ----------
    work, stop : callable
        As for `started` and `finished`.
    left : list of Row
        One per body, of one dataclass. It is used up.
    args : Namespace
        ``table``, ``jobs``, ``memory`` and ``seconds`` of the command line.
    tell : callable
        ``tell(row)`` prints a row that ended.

    Raises
    ------
    SystemExit
        There is no body.
    """
    if not left:
        raise SystemExit("no body of the suite has these names")
    rows: list[Any] = []
    jobs: list[Job] = []
    args.table.parent.mkdir(parents=True, exist_ok=True)
    with args.table.open("w", newline="") as file:
        writer = csv.DictWriter(file, [f.name for f in fields(left[0])])
        writer.writeheader()
        try:
            while left or jobs:
                while left and len(jobs) < args.jobs:
                    jobs.append(started(work, left.pop(0), args.memory))
                for row in finished(jobs, args.seconds, stop):
                    rows.append(row)
                    writer.writerow(asdict(row))
                    file.flush()
                    tell(row)
        finally:
            for job in jobs:
                job.process.kill()
    return rows


def place_of(error: Exception) -> str:
    """Return the file and line that raised an error."""
    where = traceback.extract_tb(error.__traceback__)[-1]
    return f"{Path(where.filename).name}:{where.lineno}"
