"""Work done in processes of its own: more than one at a time, and none that lives for long.

gstlearn keeps some kilobytes of every system that it has solved (measured with 1.11.1), so that
millions of targets would fill the memory of one process; a process is left after so many. They
are started from this module and not from the calling script, which needs no guard therefore.
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
    """Return what a module's function makes of each job, in their order.

    Parameters
    ----------
    function : callable
        Found by its module and name in the other process.
    jobs : sequence of tuple
        The function's arguments; pickled.
    workers : int
        Processes at a time.

    Raises
    ------
    BackendError
        A process ended without an answer.
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
            lines = words.decode(errors="replace").strip().splitlines() or ["no word of why"]
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
    """Read a function and its arguments from stdin, and write what it returns to stdout."""
    function, arguments = pickle.load(sys.stdin.buffer)
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)  # whatever a library says does not mix with the answer
        pickle.dump(function(*arguments), out)


if __name__ == "__main__":
    main()
