"""How far a run has come, and how long it will take: from the share that it tells."""

from __future__ import annotations

import time
from collections.abc import Callable

_EARLY = 0.03  # share done from which the time left is shown; before, it is a guess
_AHEAD = 0.05  # share by which the bar may run ahead of what was told last


class Forecast:
    """Share done and seconds left of a run.

    Nothing is foreseen of runs that tell no share, nor before the first few hundredths are done.

    Parameters
    ----------
    clock : callable, optional
        Seconds, for tests.
    """

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock = clock
        self._start = clock()
        self._begin = self._told_at = self._start
        self._first = self._told = -1.0
        self._shown = 0.0  # the bar never runs back

    @property
    def elapsed(self) -> float:
        """Seconds since the run began."""
        return self._clock() - self._start

    def tell(self, done: float | None) -> None:
        """Note the share done, 0 to 1; None for work that is no part of it, such as writing.

        A share below the one before begins another run, as in comparisons.
        """
        now = self._clock()
        if done is None:
            self._first = self._told = -1.0
        elif self._told < 0 or done < self._told - 1e-9:
            self._begin, self._first, self._shown = now, done, done
        if done is not None:
            self._told, self._told_at = done, now

    @property
    def done(self) -> float | None:
        """Share of the run that is over, 0 to 1; None if nothing is foreseen."""
        pace = self._pace()
        if pace is None:
            return None
        since = (self._clock() - self._told_at) * pace
        self._shown = max(self._shown, min(self._told + min(since, _AHEAD), 1.0))
        return self._shown

    @property
    def left(self) -> float | None:
        """Seconds that are left; None if nothing is foreseen."""
        pace, done = self._pace(), self.done
        return None if pace is None or done is None else max(1.0 - done, 0.0) / pace

    def _pace(self) -> float | None:
        """Return the share done per second; None if it is not known yet."""
        gone, over = self._told - self._first, self._told_at - self._begin
        return gone / over if self._told >= 0 and gone > _EARLY and over > 0 else None
