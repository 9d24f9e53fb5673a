"""Calls in a process of their own, for libraries that may abort, print or run for hours.

A crash or an exhausted memory ends only that process and is raised as a BackendError; text on
stdout is dropped. Each call has a fresh process, so that no state that a library keeps between
calls can change the answer.
"""

from __future__ import annotations

import io
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from geounfold.backends.system.parent import end_with
from geounfold.backends.system.worker import end_of
from geounfold.errors import BackendError, GeounfoldError

_ROOT = str(Path(__file__).resolve().parents[2])
_START = "from geounfold.backends.own_process import serve; serve()"


def call_apart(
    name: str, function: str, arguments: Mapping[str, np.ndarray | float], limit: float
) -> tuple[np.ndarray, ...]:
    """Call a function in a process of its own, and return its arrays.

    Parameters
    ----------
    name : str
        The library's name in messages.
    function : str
        ``module:function``, whose arguments and returned tuple are arrays or numbers.
    arguments : mapping of str to array or float
        The function's keyword arguments.
    limit : float
        Seconds of wall time after which the call is given up.

    Raises
    ------
    BackendError
        The call failed, crashed, ran out of memory or took longer than the limit; the message
        names which.
    """
    request = _packed(
        {"function": np.array(function), **{f"in_{k}": v for k, v in arguments.items()}}
    )
    try:
        # fTetWild leaves files in its folder; Windows keeps one while a process is in it.
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            done = subprocess.run(
                [sys.executable, "-P", "-c", _START, str(os.getpid())],
                input=request,
                capture_output=True,
                timeout=limit,
                env={**os.environ, "PYTHONPATH": _search_path()},
                cwd=folder,
                check=False,
            )
    except subprocess.TimeoutExpired as error:
        raise BackendError(f"{name} took longer than {limit:g} s and was stopped") from error
    except OSError as error:
        raise BackendError(f"{name} could not be started: {error.strerror or error}") from error
    if done.returncode != 0 or not done.stdout:
        words = done.stderr.decode("utf-8", "replace")
        raise BackendError(f"{name} {end_of(done.returncode, words)}")
    answer = _unpacked(done.stdout)
    if "error" in answer:
        raise BackendError(f"{name} failed: {answer['error']}")
    return tuple(answer[f"out_{k}"] for k in range(len(answer)))


def serve() -> None:
    """Read one call from stdin, run it, and write its arrays or its error to stdout."""
    end_with(int(sys.argv[1]))
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what the library prints
    _answer(sys.stdin.buffer, answer)
    answer.close()


def _answer(source: BinaryIO, target: BinaryIO) -> None:
    request = _unpacked(source.read())
    module, _, function = str(request.pop("function")).partition(":")
    arguments = {key.removeprefix("in_"): value for key, value in request.items()}
    try:
        results = getattr(import_module(module), function)(**arguments)
        reply = {f"out_{k}": value for k, value in enumerate(results)}
    except MemoryError:
        reply = {"error": "out of memory"}
    except (GeounfoldError, RuntimeError, ValueError, TypeError, ImportError) as error:
        reply = {"error": " ".join(str(error).split()) or repr(error)}
    target.write(_packed(reply))


def _search_path() -> str:
    """Return PYTHONPATH as absolute paths, this package's own folder first."""
    given = filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))
    return os.pathsep.join([_ROOT, *(str(Path(path).resolve()) for path in given)])


def _packed(arrays: Mapping[str, Any]) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **{k: np.asarray(v) for k, v in arrays.items()})
    return buffer.getvalue()


def _unpacked(data: bytes) -> dict[str, np.ndarray]:
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        return {name: arrays[name] for name in arrays.files}
