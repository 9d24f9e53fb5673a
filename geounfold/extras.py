"""Libraries that geounfold does without, and the extras that install them."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from types import ModuleType

from geounfold.errors import MissingDependencyError

EXTRAS = {
    "dask": "dask",
    "distributed": "dask",
    "ezdxf": "formats",
    "geoh5py": "formats",
    "gstlearn": "geostat",
    "matplotlib": "report",
    "omf": "formats",
    "pyarrow": "parquet",
    "pyvista": "view",
    "rich": "progress",
    "shtab": "completion",
    "tetgen": "tetgen",
    "vtkmodules": "view",
}
"""The extra of each optional library, by the name that is imported."""


def require(name: str, what: str) -> ModuleType:
    """Return an optional library.

    Parameters
    ----------
    name : str
        Module of a library in EXTRAS.
    what : str
        What needs it, in the plural: ``pictures``.

    Raises
    ------
    MissingDependencyError
        The library is not installed or cannot be loaded; the message names its extra.
    """
    try:
        return import_module(name)
    except ImportError as error:
        library = name.partition(".")[0]
        absent = isinstance(error, ModuleNotFoundError) and (error.name or "").startswith(library)
        why = "" if absent else f", which cannot be loaded ({error})"
        raise MissingDependencyError(f"{what} need {library}{why}: {install(library)}") from error


def check(name: str, what: str) -> None:
    """Raise the error of `require` for a library that is not installed; nothing is loaded.

    Raises
    ------
    MissingDependencyError
        The library is not installed; the message names its extra.
    """
    if find_spec(name) is None:
        raise MissingDependencyError(f"{what} need {name}: {install(name)}")


def install(library: str) -> str:
    """Return the command that installs an optional library.

    Examples
    --------
    >>> install("pyarrow")
    "pip install 'geounfold[parquet]'"
    """
    return f"pip install 'geounfold[{EXTRAS[library]}]'"
