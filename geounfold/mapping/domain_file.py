"""The file of several maps, one for each domain: a zip archive of an index and of map files.

Its first member, ``domains.json``, holds the format's name and version, the column that names the
domains, and their names; the members ``0.npz``, ``1.npz``, ... are map files, in the names' order.
Members are stored as they are, so that nothing unpacks to more than the file holds.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

from geounfold.backends.system.files import reachable
from geounfold.errors import InputError
from geounfold.mapping.map_file import write_whole

FORMAT, VERSION = "geounfold-domains", 1

_INDEX = "domains.json"
_MOST = 10_000  # domains of a file; a model has tens
_DATE = (1980, 1, 1, 0, 0, 0)  # so that the same maps give the same bytes


def holds_domains(path: str | Path) -> bool:
    """Return whether a file holds the maps of several domains."""
    try:
        with zipfile.ZipFile(reachable(Path(path))) as archive:
            names = archive.namelist()
    except (OSError, ValueError, zipfile.BadZipFile):
        return False
    return bool(names) and names[0] == _INDEX


def write_domains(path: str | Path | BinaryIO, column: str, maps: Mapping[str, bytes]) -> None:
    """Write map files by domain; the file appears whole or not at all.

    Parameters
    ----------
    path : path or binary stream
        Destination.
    column : str
        Column that names the domains.
    maps : dict of bytes
        Contents of map files, by the domain's name.
    """
    stream = io.BytesIO()
    head = {"format": FORMAT, "version": VERSION, "column": column, "domains": list(maps)}
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as archive:
        archive.writestr(zipfile.ZipInfo(_INDEX, _DATE), json.dumps(head, ensure_ascii=False))
        for number, content in enumerate(maps.values()):
            archive.writestr(zipfile.ZipInfo(f"{number}.npz", _DATE), content)
    if isinstance(path, str | Path):
        write_whole(Path(path), stream.getvalue())
    else:
        path.write(stream.getvalue())


def read_domains(path: str | Path) -> tuple[str, dict[str, bytes]]:
    """Return the column that names the domains, and the map files by domain.

    Raises
    ------
    InputError
        The file is missing, damaged, or of another version.
    """
    try:
        with zipfile.ZipFile(reachable(Path(path))) as archive:
            members = {info.filename: info for info in archive.infolist()}
            if any(
                info.compress_type != zipfile.ZIP_STORED or info.flag_bits & 1
                for info in members.values()
            ):
                raise InputError(f"{path}: not a map file of domains: its members are packed")
            head = json.loads(archive.read(_INDEX).decode("utf-8"))
            if head["format"] != FORMAT:
                raise InputError(f"{path}: not a map file of domains")
            if head["version"] > VERSION:
                raise InputError(
                    f"{path}: map file of domains of version {head['version']}, newer than this "
                    f"geounfold reads ({VERSION}); upgrade geounfold"
                )
            names = [str(name) for name in head["domains"]]
            if len(names) > _MOST or len(set(names)) < len(names) or not names:
                raise InputError(f"{path}: the map file's names of domains are not valid")
            return str(head["column"]), {
                name: archive.read(f"{number}.npz") for number, name in enumerate(names)
            }
    except InputError:
        raise
    except (
        *(OSError, ValueError, KeyError, TypeError, EOFError, NotImplementedError),
        *(RuntimeError, zipfile.BadZipFile),
    ) as error:
        raise InputError(f"{path}: the map file of domains is damaged; save it again") from error
