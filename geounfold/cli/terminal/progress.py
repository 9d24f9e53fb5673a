"""Progress on a terminal: one line that says the stage, the time, and what is left of it."""

from __future__ import annotations

import threading
from contextlib import suppress
from importlib.util import find_spec
from typing import Protocol, TextIO, cast

from geounfold.backends.system.console import redraws
from geounfold.cli.terminal.time_left import Forecast

_TICK = 0.25  # seconds between two drawings of a line that lives


class Progress(Protocol):
    """Shows the stage that runs."""

    def stage(self, name: str) -> None:
        """Show that a stage begins, in place of the one before."""

    def clear(self) -> None:
        """Take away what is shown; the next stage brings it back."""


class Careful:
    """A stream on which nothing fails: one that is closed or full is no reason to."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self.encoding = getattr(stream, "encoding", "utf-8")

    def write(self, text: str) -> int:
        """Write text if that can be done."""
        with suppress(OSError, ValueError):
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        """Send what was written on its way if that can be done."""
        with suppress(OSError, ValueError):
            self._stream.flush()

    def isatty(self) -> bool:
        """Return whether this is a terminal."""
        return self._stream.isatty()

    def fileno(self) -> int:
        """Return the stream's file descriptor."""
        return self._stream.fileno()


def progress_on(stream: TextIO, forecast: Forecast, *, plain: bool = False) -> Progress:
    """Return what shows progress on a terminal.

    Parameters
    ----------
    stream : text stream
        The terminal.
    forecast : Forecast
        Of the run, whose start it knows.
    plain : bool, optional
        Names and seconds only, as on terminals that cannot move the cursor.
    """
    careful = cast(TextIO, Careful(stream))
    if plain or not redraws(stream) or not find_spec("rich"):
        return PlainProgress(careful, forecast)
    return RichProgress(careful, forecast)


class PlainProgress:
    """A stage's name and the seconds gone by when it began."""

    def __init__(self, stream: TextIO, forecast: Forecast) -> None:
        self._stream = stream
        self._forecast = forecast

    def stage(self, name: str) -> None:
        """Show that a stage begins, in place of the one before."""
        self._stream.write(f"\r\x1b[K{_told(self._forecast, name)} ...")
        self._stream.flush()

    def clear(self) -> None:
        """Take away what is shown."""
        self._stream.write("\r\x1b[K")
        self._stream.flush()


class RichProgress:
    """A line that lives: the time gone by, the stage's name, a bar, and the time left.

    rich draws the line; where and when it stands is decided here. One that is drawn over from its
    begin needs no more clearing than any other, also when the run is killed.
    """

    def __init__(self, stream: TextIO, forecast: Forecast) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, ProgressColumn, SpinnerColumn, Task
        from rich.progress import Progress as Bars
        from rich.text import Text

        class Stage(ProgressColumn):
            def render(self, task: Task) -> Text:
                return Text(_told(forecast, task.description), no_wrap=True, overflow="ellipsis")

        class Left(ProgressColumn):
            def render(self, task: Task) -> Text:
                left = forecast.left
                return Text("" if left is None else f"about {_clock(left)} left", no_wrap=True)

        self._stream, self._forecast = stream, forecast
        self._console = Console(file=stream, force_terminal=True)
        columns = (SpinnerColumn(), Stage(), BarColumn(bar_width=24), Left())
        self._bars = Bars(*columns, console=self._console)
        self._task = self._bars.add_task("", total=None)
        self._lock = threading.Lock()
        self._over: threading.Event | None = None
        self._ticker: threading.Thread | None = None

    def stage(self, name: str) -> None:
        """Show that a stage begins, in place of the one before."""
        with self._lock:
            self._bars.update(self._task, description=name)
            self._draw()
        if self._ticker is None:
            self._over = threading.Event()
            self._ticker = threading.Thread(target=self._tick, args=(self._over,), daemon=True)
            self._ticker.start()

    def clear(self) -> None:
        """Take away what is shown; the next stage brings it back."""
        if self._over is not None and self._ticker is not None:
            self._over.set()
            self._ticker.join()
            self._ticker = None
        self._stream.write("\r\x1b[K")
        self._stream.flush()

    def _tick(self, over: threading.Event) -> None:
        while not over.wait(_TICK):
            with self._lock:
                self._draw()

    def _draw(self) -> None:
        done = self._forecast.done
        self._bars.update(self._task, total=None if done is None else 1.0, completed=done or 0.0)
        with self._console.capture() as drawn:
            self._console.print(self._bars.get_renderable(), end="")
        self._stream.write("\r\x1b[K" + drawn.get().replace("\n", ""))
        self._stream.flush()


def _told(forecast: Forecast, stage: str) -> str:
    return f"[{forecast.elapsed:5.1f} s] {stage}"


def _clock(seconds: float) -> str:
    """Return seconds as m:ss, or h:mm:ss.

    Examples
    --------
    >>> _clock(7.4), _clock(83), _clock(3700)
    ('0:07', '1:23', '1:01:40')
    """
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
