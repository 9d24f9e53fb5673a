"""Progress on terminals and elsewhere."""

from __future__ import annotations

import pytest

from geounfold.cli.terminal.console import Console


class _Terminal:
    def __init__(self, *, live: bool) -> None:
        self.text, self._live = "", live

    def isatty(self) -> bool:
        return self._live

    def write(self, text: str) -> None:
        self.text += text

    def flush(self) -> None: ...


@pytest.mark.parametrize(("live", "quiet"), [(True, False), (False, False), (True, True)])
def test_progress_is_for_terminals(live: bool, quiet: bool) -> None:
    terminal = _Terminal(live=live)
    console = Console(quiet=quiet, stream=terminal)  # type: ignore[arg-type]
    console.stage("hull")
    console.done("all done")
    assert ("hull" in terminal.text) == (live and not quiet)
    assert ("all done" in terminal.text) == (live and not quiet)


def test_progress_gives_way_to_an_error() -> None:
    terminal = _Terminal(live=True)
    console = Console(stream=terminal)  # type: ignore[arg-type]
    console.stage("hull\x1b[31m")
    console.error("no\nhull")
    assert terminal.text.endswith("\r\x1b[Kgeounfold: error: no hull\n")
    assert "\x1b[31m" not in terminal.text


def test_a_warning_is_printed_once() -> None:
    terminal = _Terminal(live=False)
    console = Console(stream=terminal)  # type: ignore[arg-type]
    for text in ("far", "near", "far"):
        console.warn(text)
    assert terminal.text == "geounfold: warning: far\ngeounfold: warning: near\n"
