"""The entry of the command line: from words to an exit status."""

from __future__ import annotations

import errno
import logging
import os
import re
import sys
import traceback
from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path

from geounfold.backends.system.console import speak_to_any_console
from geounfold.backends.system.memory import memory_is_limited
from geounfold.backends.system.signals import STOPS, ignore_stops, stop_of, stoppable
from geounfold.cli.arguments.parser import parse
from geounfold.cli.process.journal import Journal
from geounfold.cli.process.supervise import supervised
from geounfold.cli.terminal.console import Console
from geounfold.errors import GeounfoldError

_NO_MEMORY = re.compile(
    r"cannot allocate memory|failed to map segment|bad[_ ]alloc|out of memory|unable to allocate"
    r"|can't start new thread|insufficient memory",
    re.IGNORECASE,
)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    argv : sequence of str, optional
        The words after ``geounfold``. Without them, those of the process are taken, and the
        command runs in a process of its own, see `supervised`.

    Returns
    -------
    int
        0 done, 2 the input or an option is wrong, 1 any other failure, 130 interrupted,
        143 terminated, 129 hung up.
    """
    speak_to_any_console()
    if argv is not None:
        with stoppable():
            return _guarded(list(argv), Journal(), lambda: None)
    words = sys.argv[1:]
    return supervised(
        f"{__name__}:run_apart", words, Console(quiet="--quiet" in words), verbose=_verbose(words)
    )


def run_apart(words: list[str], journal: int | None, ready: Callable[[], None]) -> int:
    """Run a command in the process that `supervised` has made for it; see `Run`."""
    speak_to_any_console()
    return _guarded(words, Journal(journal), ready)


def _guarded(words: Sequence[str], journal: Journal, ready: Callable[[], None]) -> int:
    """Run a command, print the line of an error, and return the exit status."""
    console = Console(
        quiet="--quiet" in words, json="--json" in words, plain=_verbose(words), journal=journal
    )
    status, line = _outcome(words, console, ready)
    journal.ended(status)
    if line:
        console.error(line)
    return status


def _verbose(words: Sequence[str]) -> bool:
    return any(word.startswith(("-v", "--verbose")) for word in words)


def _outcome(words: Sequence[str], console: Console, ready: Callable[[], None]) -> tuple[int, str]:
    """Run a command, and return the exit status and the line of an error."""
    try:
        try:
            ready()
            _run(words, console)
        finally:
            ignore_stops()  # only the last line is left to print
    except SystemExit as leaving:  # after --help and --version
        return (leaving.code if isinstance(leaving.code, int) else 0), ""
    except KeyboardInterrupt as error:
        stop = stop_of(error)
        return 128 + stop, f"{STOPS[stop]}; nothing was written"
    except BrokenPipeError:  # `geounfold simulate --list | head -1`
        _leave_stdout()
        return 1, ""
    except Exception as error:
        if _lacks_memory(error):
            return 1, "out of memory; nothing was written"
        if isinstance(error, GeounfoldError):
            _leave_full_stdout()
            return error.exit_status, str(error)
        if isinstance(error, OSError) and (file := _given_file(error, words)):
            return 2, f"{file}: cannot be read: {error.strerror}; nothing was written"
        traceback.print_exc()
        return 1, ""
    return 0, ""


def _given_file(error: OSError, words: Sequence[str]) -> str:
    """Return the file that an error of the system names, if it is one of the command's words.

    An input that is removed, or whose disk fails, between two looks at it ends in such an error.
    """
    if not isinstance(error.filename, str):
        return ""
    given = (word.rpartition("=")[2] if word.startswith("-") else word for word in words)
    return error.filename if Path(error.filename) in map(Path, given) else ""


def _lacks_memory(error: BaseException) -> bool:
    """Return whether an error, or one that caused it, is a lack of memory."""
    seen: set[int] = set()
    link: BaseException | None = error
    while link is not None and id(link) not in seen:
        seen.add(id(link))
        if isinstance(link, MemoryError) or getattr(link, "errno", None) == errno.ENOMEM:
            return True
        if isinstance(link, SystemError) and memory_is_limited():  # a library has lost the cause
            return True
        foreign = not isinstance(link, GeounfoldError)  # one of ours may quote a file
        if foreign and _NO_MEMORY.search(str(link)):
            return True
        link = link.__cause__ or link.__context__
    return False


def _run(words: Sequence[str], console: Console) -> None:
    """Parse the words and run their command."""
    args = parse(words)
    with _logging(args.verbose):
        _command(args.command)(args, console)


def _command(name: str) -> Callable[[Namespace, Console], None]:
    """Return a command's function; no other command is loaded."""
    run: Callable[[Namespace, Console], None]
    run = import_module(f"geounfold.cli.commands.{name.replace('-', '_')}").run
    return run


@contextmanager
def _logging(verbosity: int) -> Iterator[None]:
    """With -v, send log records and Python's warnings to stderr; without, drop them."""
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


def _leave_full_stdout() -> None:
    """Flush stdout; leave it if its disk is full."""
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError:
        _leave_stdout()


def _leave_stdout() -> None:
    """Point stdout at the null device, so that the interpreter's last flush does not fail."""
    with suppress(OSError, ValueError):
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, sys.stdout.fileno())
