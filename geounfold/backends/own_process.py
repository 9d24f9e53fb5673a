"""Libraries that may abort, print or run for hours: called in a process of its own.

What such a call does to its process (a crash, a full memory, text on stdout) ends with that
process and comes back as one BackendError.  Each call has a fresh process, so that what a library
keeps between calls cannot change the answer.
"""

from __future__ import annotations

import ctypes
import io
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from geounfold.errors import BackendError, GeounfoldError

_ROOT = str(Path(__file__).resolve().parents[2])
_START = "from geounfold.backends.own_process import serve; serve()"
_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG


def call_apart(
    name: str, function: str, arguments: Mapping[str, np.ndarray | float], limit: float
) -> tuple[np.ndarray, ...]:
    """Return the arrays that a function returns, called in a process of its own.

    Parameters
    ----------
    name : str
        What the messages call the library.
    function : str
        ``module:function``, whose arguments and returned tuple are arrays or numbers.
    arguments : mapping of str to array or float
        By keyword.
    limit : float
        Seconds of wall time after which the call is given up.

    Raises
    ------
    BackendError
        The call failed, crashed, ran out of memory or took longer than the limit; the message says
        which.
    """
    request = _packed(
        {"function": np.array(function), **{f"in_{k}": v for k, v in arguments.items()}}
    )
    try:
        with tempfile.TemporaryDirectory() as folder:  # fTetWild leaves files where it runs
            done = subprocess.run(
                [sys.executable, "-P", "-c", _START],
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
        raise BackendError(f"{name} {_end(done.returncode, done.stderr)}")
    answer = _unpacked(done.stdout)
    if "error" in answer:
        raise BackendError(f"{name} failed: {answer['error']}")
    return tuple(answer[f"out_{k}"] for k in range(len(answer)))


def serve() -> None:
    """Answer one call: read it from stdin, and write the arrays, or the error, to stdout."""
    with suppress(AttributeError, OSError):
        ctypes.CDLL(None).prctl(_DEATH_SIGNAL, signal.SIGKILL)  # Linux: end with the caller
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
    """Return PYTHONPATH, absolute, with the folder that this very package came from in front."""
    given = filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))
    return os.pathsep.join([_ROOT, *(str(Path(path).resolve()) for path in given)])


def _end(code: int, stderr: bytes) -> str:
    """Return how a process ended that gave no answer."""
    if code < 0:
        return f"crashed ({signal.Signals(-code).name})"
    last = stderr.decode("utf-8", "replace").strip().splitlines()[-1:]
    return "ended without an answer" + (f": {last[0].strip()}" if last else "")


def _packed(arrays: Mapping[str, Any]) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **{k: np.asarray(v) for k, v in arrays.items()})
    return buffer.getvalue()


def _unpacked(data: bytes) -> dict[str, np.ndarray]:
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        return {name: arrays[name] for name in arrays.files}
