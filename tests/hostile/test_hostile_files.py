"""Hostile files: read right or refused in one line, never misread, run or left half done."""

from __future__ import annotations

import gzip
import io
import os
import pickle
import struct
import zipfile
from collections.abc import Callable
from decimal import Decimal
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from geounfold.body.working_frame import Frame
from geounfold.cli import main
from geounfold.errors import InputError
from geounfold.geometry.mesh import TetMesh
from geounfold.io import read_points
from geounfold.mapping.control_mesh import ControlMesh
from geounfold.mapping.map_file import ARRAYS, FORMAT_VERSION, read_arrays
from geounfold.mapping.mesh_map import UnfoldingMap

H = "x,y,z\n"
GOOD = H + "1,2,3\n4,5,6\n"
POINTS = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]


def _device(path: Path) -> None:
    path.symlink_to("/dev/zero")


DEVICES = (os.mkfifo, _device) if hasattr(os, "mkfifo") else ()
"""Make what is among the files but is none; Windows has no such things."""


class Bad(NamedTuple):
    """A file, by name and content, and words of the line that refuses it."""

    what: str
    name: str
    content: str | bytes | Callable[[Path], object]
    words: tuple[str, ...]


def _late(text: str, count: int = 60_000) -> str:
    """Return a table in which something stands beyond what a reader looks at first."""
    return H + "1,2,3\n" * count + text


def _parquet(**columns: Any) -> bytes:
    stream = io.BytesIO()
    pq.write_table(pa.table(columns), stream)
    return stream.getvalue()


def _ply(vertices: int, body: str, form: str = "ascii") -> str:
    axes = "".join(f"property double {axis}\n" for axis in "xyz")
    return (
        f"ply\nformat {form} 1.0\nelement vertex {vertices}\n{axes}element face 1\n"
        f"property list uchar int vertex_indices\nend_header\n{body}"
    )


CORNERS = "0 0 0\n1 0 0\n0 1 0\n"
WHOLE = _parquet(x=[1.0] * 500, y=np.arange(500.0), z=np.arange(500.0))

TABLES = [
    # Text that is no table, or another kind of one.
    Bad("utf-16 little-endian without a mark", "p.csv", GOOD.encode("utf-16-le"), ("binary",)),
    Bad("utf-32", "p.csv", GOOD.encode("utf-32"), ("UTF-32",)),
    Bad("lone surrogate", "p.csv", "x,y,z,n\n1,2,3,éé".encode() + b"\xed\n", ("UTF-8",)),
    Bad("two byte-order marks", "p.csv", "\ufeff\ufeff" + GOOD, ("no coordinate columns",)),
    Bad("byte zero in a value", "p.csv", H + "1\x002,2,3\n", ("binary",)),
    Bad("byte zero far below", "p.csv", _late("1\x0023,2,3\n"), ("binary",)),
    Bad("random bytes", "p.csv", bytes(range(1, 256)) * 40, ("p.csv",)),
    Bad("not utf-8 far below", "p.csv", _late("1,2,3\n").encode() + b"\xff,1,1\n", ("'ÿ'",)),
    Bad("columns cut by colons", "p.csv", "x:y:z\n1:2:3\n", ("separated by commas",)),
    Bad("a blank between blanks", "p.csv", "x y z\n1 2 3\n1 2\n", ("row 2", "fewer values")),
    Bad("header and rows cut differently", "p.csv", "x;y;z\n1,2,3\n", ("not numeric",)),
    Bad("comment between", "p.csv", H + "1,2,3\n# more\n4,5,6\n", ("row 2", "'# more'")),
    Bad("one long line", "p.csv", "a" * 3_000_000, ("well-formed",)),
    Bad("one long line of commas", "p.csv", "1," * 200_000, ("200001 columns",)),
    Bad(
        "quote left open in the header", "p.csv", '"x,y,z\n' + "1,2,3\n" * 50_000, ("well-formed",)
    ),
    Bad("quote left open far below", "p.csv", _late('"1,2,3\n'), ("well-formed",)),
    Bad("values beyond the header", "p.csv", H + "1,2,3,\n", ("3 columns", "4 values")),
    Bad("one row too long far below", "p.csv", _late("1,2,3,4\n"), ("line 60002",)),
    # Numbers in other notations.
    Bad("decimal commas between commas", "p.csv", H + "1,5,2,5,3,5\n", ("3 columns", "6 values")),
    Bad("both separators", "p.csv", "x;y;z\n1.234,5;2;3\n", ("point, not a comma",)),
    Bad("apostrophes", "p.csv", H + "1'234,2,3\n", ("thousands",)),
    Bad("no-break spaces", "p.csv", H + "1\u00a0234,2,3\n", ("thousands",)),
    Bad("thin spaces", "p.csv", H + "1\u2009234,2,3\n", ("thousands",)),
    Bad("a minus that is none", "p.csv", H + "\u22125,2,3\n", ("not numeric",)),
    Bad("Fortran's exponent", "p.csv", H + "1d5,2,3\n", ("'1d5'",)),
    Bad("complex", "p.csv", H + "1+2j,2,3\n", ("'1+2j'",)),
    Bad("per cent", "p.csv", H + "5%,2,3\n", ("'5%'",)),
    Bad("a formula", "p.csv", H + '"=1+1",2,3\n', ("'=1+1'",)),
    Bad("leading apostrophe", "p.csv", H + "'5,2,3\n", ("not numeric",)),
    Bad("spreadsheet's error", "p.csv", H + "#REF!,2,3\n", ("'#REF!'",)),
    Bad("end-of-file sign of old", "p.csv", GOOD + "\x1a", ("row 3",)),
    Bad("infinity in words", "p.csv", H + "Infinity,2,3\n", ("infinite",)),
    Bad("minus inf", "p.csv", H + "-INF,2,3\n", ("infinite",)),
    Bad("400 digits", "p.csv", H + "9" * 400 + ",2,3\n", ("infinite",)),
    Bad("10^308", "p.csv", H + "1e308,2,3\n", ("1e+15",)),
    Bad("a row of commas", "p.csv", H + "1,2,3\n,,\n", ("data row 2",)),
    Bad("terminal's escapes", "p.csv", H + "\x1b[31m1,2,3\n", ("not numeric",)),
    Bad("denormals only", "p.csv", H + "5e-324,2,3\n1e-320,2,3\n", ("distinct point",)),
    # Compressed.
    Bad("gzip of nothing", "p.csv.gz", gzip.compress(b""), ("empty",)),
    Bad("gzip of gzip", "p.csv.gz", gzip.compress(gzip.compress(GOOD.encode())), ("gzip",)),
    Bad("gzip and more", "p.csv.gz", gzip.compress(GOOD.encode()) + b"junk", ("damaged",)),
    Bad("gzip's head only", "p.csv.gz", b"\x1f\x8b\x08", ("damaged",)),
    Bad("gzip, a bit flipped", "p.csv.gz", gzip.compress(b"x" * 99)[:-6] + bytes(6), ("damaged",)),
    Bad("gzip of utf-32", "p.csv.gz", gzip.compress(GOOD.encode("utf-32")), ("UTF-32",)),
    # Parquet.
    Bad("parquet, head only", "p.parquet", WHOLE[:4], ("not a Parquet table",)),
    Bad("parquet, tail lost", "p.parquet", WHOLE[:-4], ("not a Parquet table",)),
    Bad("parquet, half", "p.parquet", WHOLE[: len(WHOLE) // 2], ("not a Parquet table",)),
    Bad("parquet, wrong magic", "p.parquet", b"PARE" + WHOLE[4:-4] + b"PARE", ("Parquet",)),
    Bad("parquet, head and tail", "p.parquet", b"PAR1" + b"\xff" * 8 + b"PAR1", ("Parquet",)),
    Bad("parquet, no rows", "p.parquet", _parquet(x=[], y=[], z=[]), ("no rows",)),
    Bad("parquet, lists", "p.parquet", _parquet(x=[[1.0]], y=[2.0], z=[3.0]), ("not numeric",)),
    Bad("parquet, records", "p.parquet", _parquet(x=[{"a": 1}], y=[2], z=[3]), ("not numeric",)),
    Bad("parquet, bytes", "p.parquet", _parquet(x=[b"\xff"], y=[2], z=[3]), ("not numeric",)),
    Bad("parquet, words", "p.parquet", _parquet(x=["a"], y=[2], z=[3]), ("not numeric",)),
    Bad("parquet, nothing", "p.parquet", _parquet(x=[None], y=[2], z=[3]), ("data row 1",)),
    Bad("parquet, name twice", "p.parquet", _parquet(x=[1], X=[1], y=[2], z=[3]), ("ambiguous",)),
    # No files.
    Bad("folder", "p.csv", lambda path: path.mkdir(), ("is a directory",)),
    *(Bad(make.__name__, "p.csv", make, ("pipe or a device",)) for make in DEVICES),
    Bad("link to itself", "p.csv", lambda path: path.symlink_to(path), ("p.csv",)),
    Bad("link to nothing", "p.csv", lambda path: path.symlink_to("nowhere"), ("no such file",)),
]

SURFACES = [
    Bad("ply, header cut", "t.ply", "ply\nformat ascii 1.0\nelement vert", ("cut",)),
    Bad("ply, vertices cut", "t.ply", _ply(3, "0 0 0\n1 0 0\n"), ("not a surface",)),
    Bad("ply, 2e9 vertices", "t.ply", _ply(2_000_000_000, CORNERS), ("cut", "2000000001")),
    Bad("ply, no such vertex", "t.ply", _ply(3, CORNERS + "3 0 1 7\n"), ("not a surface",)),
    Bad("ply, vertex -7", "t.ply", _ply(3, CORNERS + "3 0 1 -7\n"), ("not a surface",)),
    Bad("ply, nan", "t.ply", _ply(3, "nan 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), ("3 vertices", "finite")),
    Bad("ply, binary cut", "t.ply", _ply(3, "abc", "binary_little_endian"), ("not a surface",)),
    Bad("obj, words", "t.obj", "v a b c\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", ("vertex 1", "'a b c'")),
    Bad("obj, infinite", "t.obj", "v inf 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", ("finite",)),
    Bad("obj, no such vertex", "t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", ("vertex 9",)),
    Bad("obj, vertex 0", "t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", ("vertex 0",)),
    Bad("obj, cut", "t.obj", "v 0 0 0\nv 1 0\n", ("vertex 2",)),
    Bad("stl, binary cut", "t.stl", bytes(80) + struct.pack("<I", 1000) + bytes(60), ("cut",)),
    Bad("stl, text cut", "t.stl", "solid a\nfacet normal 0 0 1\nouter loop\n", ("not a surface",)),
    Bad("stl, noise", "t.stl", b"\xff" * 300, ("cut",)),
    Bad("off, 1e9 vertices", "t.off", "OFF\n1000000000 1 0\n0 0 0\n", ("cut",)),
    Bad("off, cut", "t.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n", ("not a surface",)),
    Bad("off, no such vertex", "t.off", f"OFF\n3 1 0\n{CORNERS}3 0 1 9\n", ("not a surface",)),
    Bad("off, noise", "t.off", b"\0\1\2" * 100, ("header",)),
]


def _state(folder: Path) -> dict[str, bytes | None]:
    return {
        str(p.relative_to(folder)): p.read_bytes() if p.is_file() and p.stat().st_size else None
        for p in folder.rglob("*")
        if not p.is_symlink()
    }


@pytest.fixture
def refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., None]:
    """Run a command that must be refused in one line and change nothing."""
    monkeypatch.chdir(tmp_path)

    def run(bad: Bad, *argv: str) -> None:
        path = tmp_path / bad.name
        if callable(bad.content):
            bad.content(path)
        else:
            content = bad.content
            path.write_bytes(content.encode() if isinstance(content, str) else content)
        before = _state(tmp_path)
        assert main(list(argv)) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert err.startswith("geounfold: error: ")
        assert err.count("\n") == 1, err
        assert err[:-1].isprintable()
        for word in bad.words:
            assert word in err
        assert _state(tmp_path) == before

    return run


@pytest.mark.parametrize("bad", TABLES, ids=lambda bad: bad.what)
def test_table(bad: Bad, refused: Callable[..., None]) -> None:
    refused(bad, "unfold", bad.name, "-o", "out.csv")


@pytest.mark.parametrize("bad", SURFACES, ids=lambda bad: bad.what)
def test_surface(bad: Bad, refused: Callable[..., None]) -> None:
    refused(bad, "compare", bad.name, "-o", "out.csv")


@pytest.mark.slow
def test_text_in_row_one_million(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text(_late("1,2,three\n", 999_999))
    with pytest.raises(InputError, match="data row 1000000 has 'three'"):
        read_points(tmp_path / "p.csv")


@pytest.mark.slow
def test_compressed_without_end(tmp_path: Path) -> None:
    with gzip.open(tmp_path / "p.csv.gz", "wb", 1) as stream:
        stream.write(H.encode())
        for _ in range(280):  # MiB, of which 256 are let in
            stream.write(b"1,2,3\n" * ((1 << 20) // 6 + 1))
    with pytest.raises(InputError, match="unpack"):
        read_points(tmp_path / "p.csv.gz")


NASTY_BUT_PLAIN = {
    "byte-order mark": ("p.csv", "\ufeff" + GOOD),
    "semicolons": ("p.csv", GOOD.replace(",", ";")),
    "tabs": ("p.csv", GOOD.replace(",", "\t")),
    "quotes": ("p.csv", 'x,y,z\n"1","2","3"\n"4","5","6"\n'),
    "line break in a note": ("p.csv", 'x,y,z,n\n1,2,3,"a\nb"\n4,5,6,""""\n'),
    "line break in the header": ("p.csv", '"x","y","z","a\nb"\n1,2,3,\n4,5,6,\n'),
    "separators in a name": ("p.csv", 'x,y,z,"a;b;c;d;e"\n1,2,3,\n4,5,6,\n'),
    "blank rows": ("p.csv", "\n\nx,y,z\n\n1,2,3\n\n\n4,5,6\n\n"),
    "trailing commas": ("p.csv", "x,y,z,\n1,2,3,\n4,5,6,\n"),
    "two archives in one": (
        "p.csv.gz",
        gzip.compress(GOOD[:12].encode()) + gzip.compress(GOOD[12:].encode()),
    ),
    "20,000 digits": ("p.csv", H + "1." + "0" * 20_000 + ",2,3\n4,5,6\n"),
    "words in Parquet": ("p.parquet", _parquet(x=["1", "4"], y=[2, 5], z=[3, 6])),
    "decimals in Parquet": (
        "p.parquet",
        _parquet(x=[Decimal("1.00"), Decimal("4.00")], y=[2, 5], z=[3, 6]),
    ),
    "categories in Parquet": (
        "p.parquet",
        _parquet(x=pa.array(["1", "4"]).dictionary_encode(), y=[2, 5], z=[3, 6]),
    ),
}


@pytest.mark.parametrize("what", NASTY_BUT_PLAIN)
def test_unusual_files_are_read_right(what: str, tmp_path: Path) -> None:
    name, content = NASTY_BUT_PLAIN[what]
    (tmp_path / name).write_bytes(content.encode() if isinstance(content, str) else content)
    assert read_points(tmp_path / name).points.tolist() == POINTS


# ---------------------------------------------------------------------------------------- maps


class _Payload:
    """Makes a file when it is unpickled."""

    def __reduce__(self) -> tuple[Any, ...]:
        return os.mkdir, ("executed",)


def _map_bytes() -> bytes:
    corners = np.concatenate([np.zeros((1, 3)), np.eye(3)])
    tet = TetMesh(corners, [[0, 1, 2, 3]])
    frame = Frame(np.zeros(3), np.eye(3), 10.0, None)
    stream = io.BytesIO()
    UnfoldingMap(frame, ControlMesh(tet, tet, corners[:, 2])).save(stream)
    return stream.getvalue()


MAP = _map_bytes()


def _npy(array: Any) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=True)
    return stream.getvalue()


def _with(changes: dict[str, bytes | None], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """Return the map's archive with members replaced, added or left out."""
    with zipfile.ZipFile(io.BytesIO(MAP)) as archive:
        members: dict[str, bytes | None] = {n: archive.read(n) for n in archive.namelist()}
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", method) as archive:
        for name, content in {**members, **changes}.items():
            if content is not None:
                archive.writestr(name, content)
    return stream.getvalue()


def _signed(**changes: Any) -> bytes:
    """Return a map with arrays changed and a checksum that fits."""
    from geounfold.mapping import map_file

    with np.load(io.BytesIO(MAP)) as file:
        arrays = {**dict(file), **changes}
    del arrays["checksum"]
    return _with(
        {f"{n}.npy": _npy(a) for n, a in arrays.items()}
        | {"checksum.npy": _npy(np.array(map_file._checksum(arrays)))}
    )


BOMB = np.zeros(1 << 26, np.int8)
MAPS: dict[str, tuple[Callable[[], bytes], str]] = {
    "pickle": (lambda: pickle.dumps(_Payload()), "not a geounfold map"),
    "npy of objects": (lambda: _npy(np.array([_Payload()])), "not a geounfold map"),
    "objects under a foreign name": (
        lambda: _with({"more.npy": _npy(np.array([_Payload()]))}),
        "more than a map: more.npy",
    ),
    "objects for vertices": (
        lambda: _with({"folded.npy": _npy(np.array([_Payload()]))}),
        "'folded' of the map must be",
    ),
    "objects for the format": (
        lambda: _with({"format.npy": _npy(np.array(_Payload(), dtype=object))}),
        "not a geounfold map",
    ),
    "pickle for a member": (
        lambda: _with({"scale.npy": pickle.dumps(_Payload())}),
        "'scale' of the map must be",
    ),
    "path out of the archive": (
        lambda: _with({"../../executed": b"1"}),
        "more than a map: ../../executed",
    ),
    "absolute path": (lambda: _with({"/tmp/executed.npy": b"1"}), "more than a map"),
    "control signs in a name": (lambda: _with({"a\n\x1b[2Jb": b"1"}), "more than a map"),
    "zip bomb": (lambda: _with({"folded.npy": _npy(BOMB)}), "unpack"),
    "packed otherwise": (lambda: _with({}, zipfile.ZIP_LZMA), "packed"),
    "array lost": (lambda: _with({"unfolded.npy": None}), "lacks unfolded"),
    "checksum lost": (lambda: _with({"checksum.npy": None}), "lacks checksum"),
    "array cut": (lambda: _with({"origin.npy": _npy(np.zeros(3))[:-8]}), "cut"),
    "number changed": (lambda: _with({"scale.npy": _npy(np.array(11.0))}), "checksum differs"),
    "newer": (lambda: _signed(version=np.array(FORMAT_VERSION + 1)), "newer"),
    "older": (lambda: _signed(version=np.array(0)), "older"),
    "version in words": (lambda: _signed(version=np.array("1")), "not a geounfold map"),
    "another format": (lambda: _signed(format=np.array("geounfold-pam")), "not a geounfold map"),
    "single precision": (lambda: _signed(origin=np.zeros(3, "f4")), "must be <f8"),
    "other byte order": (lambda: _signed(origin=np.zeros(3, ">f8")), "must be <f8"),
    "other shape": (lambda: _signed(rotation=np.eye(4)), "shape"),
    "vertices that differ in number": (lambda: _signed(unfolded=np.zeros((5, 3))), "shape"),
    "no tetrahedra": (lambda: _signed(tetrahedra=np.zeros((0, 4), "i4")), "shape"),
    "no such vertex": (lambda: _signed(tetrahedra=np.array([[0, 1, 2, 4]], "i4")), "0..3"),
    "vertex -1": (lambda: _signed(tetrahedra=np.array([[0, 1, 2, -1]], "i4")), "0..3"),
    "nan": (lambda: _signed(folded=np.full((4, 3), np.nan)), "finite"),
    "mirror": (lambda: _signed(rotation=-np.eye(3)), "rotation"),
    "no such coordinates": (lambda: _signed(coordinates=np.array(3, "i4")), "0, 1 or 2"),
    "scale of nothing": (lambda: _signed(scale=np.array(0.0)), "positive"),
    "sides below zero": (lambda: _signed(steps=np.array([1.0, -1, 1])), "positive"),
}


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize("what", MAPS)
def test_map(what: str, tmp_path: Path, refused: Callable[..., None]) -> None:
    make, words = MAPS[what]
    (tmp_path / "p.csv").write_text(GOOD)
    refused(Bad(what, "m.npz", make(), ("m.npz", words)), "map", "m.npz", "p.csv", "-o", "out.csv")
    assert not (tmp_path / "executed").exists()


@pytest.mark.parametrize("make", [Path.mkdir, *DEVICES])
def test_map_that_is_no_file(make: Callable[[Path], object], tmp_path: Path) -> None:
    make(tmp_path / "m.npz")
    with pytest.raises(InputError, match=r"directory|pipe or device"):
        read_arrays(tmp_path / "m.npz")


def test_the_payload_would_be_executed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    pickle.loads(pickle.dumps(_Payload()))
    assert (tmp_path / "executed").exists()


def test_member_twice(tmp_path: Path) -> None:
    stream = io.BytesIO(MAP)
    with (
        pytest.warns(UserWarning, match="Duplicate name"),
        zipfile.ZipFile(stream, "a") as archive,
    ):
        archive.writestr("scale.npy", _npy(np.array(11.0)))
    (tmp_path / "m.npz").write_bytes(stream.getvalue())
    with pytest.raises(InputError, match=r"two of 'scale\.npy'"):
        read_arrays(tmp_path / "m.npz")


@pytest.mark.parametrize("step", [97, pytest.param(1, marks=pytest.mark.slow)])
def test_map_cut_at_any_byte(step: int, tmp_path: Path) -> None:
    for count in range(0, len(MAP), step):
        (tmp_path / "m.npz").write_bytes(MAP[:count])
        with pytest.raises(InputError, match="not a geounfold map"):
            read_arrays(tmp_path / "m.npz")


@pytest.mark.parametrize("step", [97, pytest.param(1, marks=pytest.mark.slow)])
def test_map_with_a_bit_flipped_is_refused_or_the_same(step: int, tmp_path: Path) -> None:
    (tmp_path / "m.npz").write_bytes(MAP)
    whole = read_arrays(tmp_path / "m.npz")
    refusals = 0
    for place in range(0, len(MAP), step):
        content = bytearray(MAP)
        content[place] ^= 1 << place % 8
        (tmp_path / "m.npz").write_bytes(content)
        try:
            arrays = read_arrays(tmp_path / "m.npz")
        except InputError:
            refusals += 1
        else:  # a bit that means nothing: a date, an attribute
            assert all(arrays[n].tobytes() == whole[n].tobytes() for n in ARRAYS)
    assert refusals > len(MAP) // step // 2


def test_every_hostile_input_is_another() -> None:
    # At least 60 are asked for.
    assert len({bad.what for bad in TABLES + SURFACES}) + len(MAPS) >= 60
    assert pd.Series([bad.what for bad in TABLES + SURFACES]).is_unique
