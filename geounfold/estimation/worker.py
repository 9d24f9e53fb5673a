"""Jobs run in separate short-lived processes, several at a time.

gstlearn does not free some kilobytes of every system that it solves (measured with 1.11.1), so
millions of targets would fill the memory of one process. Each process therefore ends after one
job. Processes run this module, not the calling script, so that script needs no
``if __name__ == "__main__"``.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from geounfold.errors import BackendError


def apart(function: Callable[..., Any], jobs: Sequence[tuple[Any, ...]], workers: int) -> list[Any]:
    """Return a function's result for each job, in the jobs' order.

    Parameters
    ----------
    function : callable
        A function of a module; the other process imports it by its name.
    jobs : sequence of tuple
        Arguments of the function for each job; they are pickled.
    workers : int
        Number of processes at a time.

    Raises
    ------
    BackendError
        A process ended with an error.
    """
    running: list[subprocess.Popen[bytes]] = []

    def one(arguments: tuple[Any, ...]) -> Any:
        path = os.pathsep.join(p or os.curdir for p in sys.path)
        process = subprocess.Popen(
            [sys.executable, "-m", __name__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": path},
        )
        running.append(process)
        answer, words = process.communicate(pickle.dumps((function, arguments)))
        if process.returncode:
            lines = words.decode(errors="replace").strip().splitlines() or ["no message"]
            raise BackendError(
                f"a process that estimates ended with status {process.returncode}: {lines[-1]}"
            )
        return pickle.loads(answer)

    with ThreadPoolExecutor(workers) as pool:
        try:
            return list(pool.map(one, jobs))
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in running:
                if process.poll() is None:
                    process.kill()


def main() -> None:
    """Read a function and its arguments from stdin and write its result to stdout."""
    function, arguments = pickle.load(sys.stdin.buffer)
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)  # a library's output to stdout goes to stderr, apart from the answer
        pickle.dump(function(*arguments), out)


if __name__ == "__main__":
    main()
