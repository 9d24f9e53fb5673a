"""`geounfold doctor`: versions, extras, and whether the installed libraries work."""

from __future__ import annotations

import os
import sys
from argparse import Namespace
from collections.abc import Callable
from importlib import metadata
from typing import Any

from packaging.requirements import Requirement

from geounfold._version import __version__
from geounfold.backends.system.libraries import system_name
from geounfold.cli.terminal.console import Console
from geounfold.errors import GeounfoldError, MissingDependencyError
from geounfold.extras import check as check_library

Progress = Callable[[str], None]


def run(args: Namespace, console: Console) -> None:
    """Print what is installed and whether it works.

    Raises
    ------
    MissingDependencyError
        A library that geounfold needs is missing or does not work.
    """
    found = check_up(console.stage)
    console.done("checked")
    console.answer(found, lambda: _in_words(found))
    _check_health(found)


def check_up(progress: Progress) -> dict[str, Any]:
    """Return what is installed and whether it works.

    Parameters
    ----------
    progress : callable
        Called with the name of each check as it begins.

    Returns
    -------
    dict
        ``geounfold``, ``python``, ``platform`` and ``processors``. ``libraries``, and ``extras``
        by extra, have the ``version`` of each library (None if it is missing), the version
        ``needed``, and whether it is ``ok``. ``checks`` have, by name, ``ok`` and, unless it is
        true, a ``message``; it is None if the library is of an extra that is not installed.
    """
    libraries, extras = _libraries()
    return {
        "geounfold": __version__,
        "python": sys.version.partition(" ")[0],
        "platform": system_name(),
        "processors": os.cpu_count(),
        "libraries": libraries,
        "extras": extras,
        "checks": {name: _tried(name, check, progress) for name, check in CHECKS.items()},
    }


def _check_health(found: dict[str, Any]) -> None:
    """Raise MissingDependencyError if a library that geounfold needs is missing or broken."""
    ill = [name for name, library in found["libraries"].items() if not library["ok"]]
    ill += [name for name, check in found["checks"].items() if check["ok"] is False]
    if ill:
        raise MissingDependencyError(f"not in order: {', '.join(ill)}")


def _in_words(found: dict[str, Any]) -> str:
    """Return what was found as lines of text."""
    head = f"geounfold {found['geounfold']}, Python {found['python']}, {found['platform']}, "
    lines = [f"{head}{found['processors']} processors", "", "libraries"]
    lines += _library_lines(found["libraries"], "missing")
    for extra, libraries in found["extras"].items():
        lines += ["", f"extra {extra}: pip install 'geounfold[{extra}]'"]
        lines += _library_lines(libraries, "not installed")
    lines += ["", "checks"]
    width = max(map(len, found["checks"]))
    for name, check in found["checks"].items():
        lines.append(f"  {name:<{width}}  {'works' if check['ok'] else check['message']}")
    return "\n".join(lines) + "\n"


def _library_lines(libraries: dict[str, dict[str, Any]], absent: str) -> list[str]:
    width = max(map(len, libraries), default=0)
    lines = []
    for name, library in libraries.items():
        wrong = library["version"] is not None and not library["ok"]
        remark = f"  (geounfold needs {library['needed']})" if wrong else ""
        lines.append(f"  {name:<{width}}  {library['version'] or absent}{remark}")
    return lines


def _libraries() -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """Return the libraries that geounfold needs, and those of each extra for users."""
    needed: dict[str, Any] = {}
    extras: dict[str, dict[str, Any]] = {}
    try:
        declared = metadata.requires("geounfold") or []
    except metadata.PackageNotFoundError:
        declared = []  # run from its source, not installed
    for requirement in map(Requirement, declared):
        marker = requirement.marker
        if marker is None or marker.evaluate({"extra": ""}):
            needed[requirement.name] = _library(requirement)
            continue
        for extra in _EXTRAS:
            if marker.evaluate({"extra": extra}):
                extras.setdefault(extra, {})[requirement.name] = _library(requirement)
    return needed, extras


_EXTRAS = (  # for users, unlike dev
    *("view", "report", "parquet", "progress", "formats", "geostat"),
    *("completion", "dask", "tetgen"),
)


def _library(requirement: Requirement) -> dict[str, Any]:
    try:
        version: str | None = metadata.version(requirement.name)
    except metadata.PackageNotFoundError:
        version = None
    ok = version is not None and requirement.specifier.contains(version, prereleases=True)
    return {"version": version, "needed": str(requirement.specifier), "ok": ok}


# ---------------------------------------------------------------------------------------- checks


def _tried(name: str, check: Callable[[], None], progress: Progress) -> dict[str, Any]:
    progress(f"checking {name}")
    try:
        for library in _OPTIONAL.get(name, ()):
            check_library(library, "pictures")
    except MissingDependencyError as error:
        return {"ok": None, "message": f"not installed: {error}"}
    try:
        check()
    except (GeounfoldError, ImportError, OSError) as error:
        return {"ok": False, "message": f"{error}"}
    return {"ok": True}


def _meshlab() -> None:
    import numpy as np

    from geounfold.backends import meshlab

    corners = np.concatenate([np.zeros((1, 3)), np.eye(3)])
    meshlab.remesh(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]), 1.0, 1)


def _igl() -> None:
    import numpy as np

    from geounfold.backends import igl

    igl.upright(np.concatenate([np.zeros((1, 3)), np.eye(3)]), np.array([[0, 1, 2, 3]]))


def _drawing() -> None:
    from geounfold.report.plots.rendering import check_rendering

    check_rendering()


CHECKS: dict[str, Callable[[], None]] = {
    "libigl": _igl,
    "MeshLab": _meshlab,
    "off-screen rendering": _drawing,
}
"""The checks by name; one raises if its library does not work."""

_OPTIONAL = {"off-screen rendering": ("matplotlib", "pyvista")}
"""Libraries of extras that a check needs, by the check's name."""
