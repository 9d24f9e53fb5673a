"""The order of the tests: as written, or shuffled by a given seed (``--shuffle SEED``)."""

from __future__ import annotations

import random

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--shuffle",
        type=int,
        metavar="SEED",
        help="shuffle the files, and the tests inside each, by this seed",
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    seed = config.getoption("--shuffle")
    if seed is None:
        return
    # Tests of one file stay together, so that what they share is still made once.
    files: dict[str, list[pytest.Item]] = {}
    for item in items:
        files.setdefault(str(item.path), []).append(item)
    order = random.Random(seed)
    names = sorted(files)
    order.shuffle(names)
    for name in names:
        order.shuffle(files[name])
    items[:] = [item for name in names for item in files[name]]


def pytest_report_header(config: pytest.Config) -> str:
    seed = config.getoption("--shuffle")
    return "" if seed is None else f"order: shuffled by seed {seed}"
