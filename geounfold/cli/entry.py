"""Entry of the command line: from arguments to an exit status."""

from __future__ import annotations

import logging
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from types import FrameType

from geounfold.cli.console import Console
from geounfold.cli.parser import parse
from geounfold.errors import GeounfoldError

_INTERRUPTED = 128 + signal.SIGINT
_TERMINATED = 128 + signal.SIGTERM


class _TerminatedError(BaseException):
    """SIGTERM, so that what was begun is cleared away."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    argv : sequence of str, optional
        The arguments; those of the process without.

    Returns
    -------
    int
        0 done, 2 input or options at fault, 1 anything else, 130 interrupted, 143 terminated.
    """
    words = sys.argv[1:] if argv is None else list(argv)
    console = Console(quiet="--quiet" in words)
    try:
        with _terminable():
            _run(words, console)
            sys.stdout.flush()
    except SystemExit as leaving:  # after --help and --version
        return leaving.code if isinstance(leaving.code, int) else 0
    except GeounfoldError as error:
        console.error(str(error))
        return error.exit_status
    except KeyboardInterrupt:
        console.error("interrupted; nothing was written")
        return _INTERRUPTED
    except _TerminatedError:
        console.error("terminated; nothing was written")
        return _TERMINATED
    except BrokenPipeError:  # `geounfold simulate --list | head -1`
        _leave_stdout()
        return 1
    except MemoryError:
        console.error("out of memory; nothing was written")
        return 1
    except Exception:
        traceback.print_exc()
        return 1
    return 0


def _run(words: Sequence[str], console: Console) -> None:
    """Parse the arguments and hand them to their command."""
    args = parse(words)
    if args.command is None:
        from geounfold.errors import OptionError

        raise OptionError(
            "a command is needed: unfold, map, compare, quality, simulate or view "
            "(see 'geounfold --help')"
        )
    with _logging(args.verbose):
        handlers = _handlers()
        handlers[args.handler](args, console)


def _handlers() -> dict[str, Callable[..., None]]:
    from geounfold.cli import commands

    return {
        "unfold": commands.unfold,
        "map": commands.carry,
        "compare": commands.compare,
        "quality": commands.quality,
        "simulate": commands.simulate,
        "view": commands.view,
    }


@contextmanager
def _logging(verbosity: int) -> Iterator[None]:
    """Send log records and Python's warnings to stderr, with -v; nowhere without."""
    level = {0: logging.CRITICAL + 1, 1: logging.INFO}.get(verbosity, logging.DEBUG)
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("%(name)s: %(message)s"))
    loggers = [logging.getLogger("geounfold"), logging.getLogger("py.warnings")]
    before = [(logger, logger.level, logger.propagate) for logger in loggers]
    logging.captureWarnings(True)
    for logger in loggers:
        logger.addHandler(handler)
        logger.setLevel(level)
        logger.propagate = False
    try:
        yield
    finally:
        logging.captureWarnings(False)
        for logger, old_level, propagate in before:
            logger.removeHandler(handler)
            logger.setLevel(old_level)
            logger.propagate = propagate


@contextmanager
def _terminable() -> Iterator[None]:
    """Let SIGTERM unwind the stack, so that parts of outputs are removed."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(_signal: int, _frame: FrameType | None) -> None:
        raise _TerminatedError

    before = signal.signal(signal.SIGTERM, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _leave_stdout() -> None:
    """Point stdout at nothing, so that the interpreter's last flush does not complain."""
    with suppress(OSError, ValueError):
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, sys.stdout.fileno())
