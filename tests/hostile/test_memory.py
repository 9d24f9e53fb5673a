"""Runs whose memory is limited."""

from __future__ import annotations

import resource
from pathlib import Path

import pytest

from tests.hostile.environment import state_of
from tests.hostile.processes import UNFOLD, Run

MEMORY = "geounfold: error: out of memory; nothing was written\n"


def _with_memory(megabytes: int, argv: tuple[str, ...], folder: Path) -> int:
    """Run under a limit; return the status after checking what else is left of the run."""

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20, megabytes << 20))

    before = state_of(folder)
    status, line = Run(*argv, "--overwrite", cwd=folder, preexec_fn=limited).end()
    if status == 0:
        assert {*state_of(folder)} == {*before}
    else:
        assert (status, line) == (1, MEMORY)
        assert state_of(folder) == before
    return status


@pytest.mark.parametrize("megabytes", [100, 350, 600])
def test_memory_limit(megabytes: int, folder: Path) -> None:
    # 100 MB do not hold numpy, 350 not the threads of its BLAS; loading the libraries takes 800 MB
    # of addresses, so none suffices.
    assert _with_memory(megabytes, UNFOLD, folder) == 1


@pytest.mark.slow
@pytest.mark.parametrize("megabytes", [*range(50, 1200, 75), 1600, 4000])
@pytest.mark.parametrize(
    "argv",
    [
        UNFOLD,
        ("map", "given.npz", "p.csv", "-o", "out.csv"),
        ("compare", "p.csv", "-o", "out.csv"),
        ("simulate", "sim_case_2", "-o", "out.csv"),
    ],
    ids=lambda argv: argv[0],
)
def test_memory_limits(argv: tuple[str, ...], megabytes: int, folder: Path) -> None:
    status = _with_memory(megabytes, argv, folder)
    assert status == 0 or megabytes < 4000
