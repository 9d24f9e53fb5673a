"""The file of several maps: what is written comes back, what is damaged is refused in one line."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import pytest

from geounfold.errors import InputError
from geounfold.mapping.domain_file import holds_domains, read_domains, write_domains
from geounfold.mapping.domain_map import load_domains

MAPS = {"LODE 1": b"one", "é, 2": b"two"}


def test_there_and_back_and_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a.npz", "b.npz"):
        write_domains(tmp_path / name, "DOMAIN", MAPS)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    assert holds_domains(tmp_path / "a.npz")
    assert read_domains(tmp_path / "a.npz") == ("DOMAIN", MAPS)


def archive(path: Path, head: object, kind: int = zipfile.ZIP_STORED, **members: bytes) -> Path:
    with zipfile.ZipFile(path, "w", kind) as made:
        made.writestr("domains.json", head if isinstance(head, bytes) else json.dumps(head))
        for name, content in members.items():
            made.writestr(f"{name.strip('_')}.npz", content)
    return path


HEAD = {"format": "geounfold-domains", "version": 1, "column": "D", "domains": ["A"]}


@pytest.mark.parametrize(
    ("head", "words"),
    [
        (b"no json", "damaged"),
        ([], "damaged"),
        ({**HEAD, "format": "other"}, "not a map file of domains"),
        ({**HEAD, "version": 2}, "newer than this geounfold reads"),
        ({**HEAD, "domains": []}, "names of domains are not valid"),
        ({**HEAD, "domains": ["A", "A"]}, "names of domains are not valid"),
        ({**HEAD, "domains": ["A", "B"]}, "damaged"),  # the second map is missing
    ],
)
def test_files_that_do_not_fit(head: object, words: str, tmp_path: Path) -> None:
    path = archive(tmp_path / "m.npz", head, _0=b"map")
    with pytest.raises(InputError, match=words):
        read_domains(path)


def test_packed_members_and_maps_that_are_none(tmp_path: Path) -> None:
    path = archive(tmp_path / "p.npz", HEAD, zipfile.ZIP_DEFLATED, _0=b"0" * 1000)
    with pytest.raises(InputError, match="its members are packed"):
        read_domains(path)
    path = archive(tmp_path / "m.npz", HEAD, _0=b"map")
    with pytest.raises(InputError, match="not a geounfold map"):
        load_domains(path)
    assert not holds_domains(tmp_path / "absent.npz")
    with pytest.raises(InputError, match="holds no maps of domains"):
        load_domains(tmp_path / "absent.npz")
