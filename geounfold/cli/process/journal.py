"""What a run tells the process that watches it: through a pipe, so that it outlives a crash."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from geounfold.backends.system.signals import unstoppable

_PART, _COMMITTING, _REVOKED, _WRITTEN, _ENDED = b"P", b"C", b"R", b"W", b"E"


class Journal:
    """Notes of a run on its outputs.

    Parameters
    ----------
    handle : int, optional
        Writing end of a pipe; without, nobody reads.
    """

    def __init__(self, handle: int | None = None) -> None:
        self._handle = handle

    def part(self, path: Path) -> None:
        """Note that something is made at `path` that must not stay there."""
        self._note(_PART, os.fsencode(path))

    @contextmanager
    def committing(self) -> Iterator[None]:
        """Note that outputs are moved in place, which signals do not stop, and that they are."""
        self._note(_COMMITTING)
        try:
            with unstoppable():
                yield
        except BaseException:
            self._note(_REVOKED)
            raise
        self._note(_WRITTEN)

    def ended(self, status: int) -> None:
        """Note that the run ends with a status, and says itself why."""
        self._note(_ENDED, str(status).encode("ascii"))

    def _note(self, kind: bytes, text: bytes = b"") -> None:
        if self._handle is not None:
            with suppress(OSError):  # the reader is gone, and so will be this process
                os.write(self._handle, kind + text + b"\0")


@dataclass(frozen=True)
class Account:
    """A journal as read.

    Attributes
    ----------
    parts : tuple of Path
        What must not stay on the disk.
    committing, written : bool
        Whether outputs are being moved in place; whether all of them are.
    status : int or None
        The exit status the run ended with.
    """

    parts: tuple[Path, ...] = ()
    committing: bool = False
    written: bool = False
    status: int | None = None

    @classmethod
    def of(cls, text: bytes) -> Account:
        r"""Return the account in what was read of a journal so far.

        Examples
        --------
        >>> Account.of(b"P/tmp/a\0C\0W\0E0\0")
        Account(parts=(...Path('/tmp/a'),), committing=False, written=True, status=0)
        """
        notes = text.split(b"\0")[:-1]
        parts = [Path(os.fsdecode(n[1:])) for n in notes if n[:1] == _PART]
        moves = [n[:1] for n in notes if n[:1] in (_COMMITTING, _REVOKED, _WRITTEN)]
        ends = [int(n[1:]) for n in notes if n[:1] == _ENDED]
        return cls(
            tuple(dict.fromkeys(parts)),
            moves[-1:] == [_COMMITTING],
            moves[-1:] == [_WRITTEN],
            ends[-1] if ends else None,
        )
