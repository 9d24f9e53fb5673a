"""The bytes of text tables as UTF-8, whichever of the usual encodings they are in.

Spreadsheets on Windows save text as Windows-1252 or as UTF-16 with a byte-order mark; older
programs save Latin-1. Coordinates are ASCII in all but UTF-16, so only names and texts depend on
the choice.
"""

from __future__ import annotations

import codecs
import io
from collections.abc import Iterable
from pathlib import Path
from typing import IO, cast

from geounfold.errors import InputError

UTF8 = "utf-8"

_UTF16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_UTF32 = (codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE)
_UNUSED = frozenset(b"\x81\x8d\x8f\x90\x9d")  # bytes without a letter in Windows-1252
_CONTROLS = frozenset(range(32)) - frozenset(b"\t\n\v\f\r\x1a\x1b")  # in no text
_NAMES = {"cp1252": "Windows-1252", "latin-1": "Latin-1", "utf-16": "UTF-16"}
_CHUNK = 1 << 16

_FOREIGN = {
    b"PAR1": "a Parquet file: name it .parquet",
    b"\x1f\x8b": "compressed by gzip: name it .csv.gz",
    b"PK\x03\x04": "a zip archive, perhaps a spreadsheet: export it as CSV",
    b"\xd0\xcf\x11\xe0": "an old spreadsheet: export it as CSV",
}


def text_encoding(path: Path, chunks: Iterable[bytes]) -> str:
    """Return the encoding of a text: utf-8, utf-16, cp1252 or latin-1.

    Text that is not UTF-8 and has no byte-order mark is taken for Windows-1252, or for Latin-1 if
    it holds one of the five bytes that Windows-1252 does not use.

    Parameters
    ----------
    path : path
        The file, for messages.
    chunks : iterable of bytes
        Its content.

    Raises
    ------
    InputError
        The content is of another format or binary, or is UTF-8 with damaged bytes.
    """
    decoder = codecs.getincrementaldecoder(UTF8)()
    first, valid, other, broken = True, True, 0, 0
    seen: set[int] = set()
    for chunk in chunks:
        if first and _is_utf16(path, chunk):
            return "utf-16"
        first = False
        if b"\0" in chunk:  # the parser would cut a value short at it
            raise InputError(f"{path}: is not a table: it holds binary data")
        if chunk.isascii() and valid and not decoder.getstate()[0]:
            continue
        if valid:
            try:
                decoder.decode(chunk)
            except UnicodeDecodeError:
                valid = False
        seen.update(chunk)
        text = chunk.decode(UTF8, errors="replace")
        broken += text.count("\ufffd")
        other += sum(letter > "\x7f" for letter in text if letter != "\ufffd")
    if valid and not decoder.getstate()[0]:
        return UTF8
    if seen & _CONTROLS:
        raise InputError(f"{path}: is not a table: it holds binary data")
    if other > broken:
        raise InputError(f"{path}: is text in UTF-8 with damaged letters; save it as UTF-8 again")
    return "latin-1" if seen & _UNUSED else "cp1252"


def _is_utf16(path: Path, chunk: bytes) -> bool:
    """Return whether a file begins as UTF-16; raise InputError if as another format."""
    if chunk.startswith(_UTF32):
        raise InputError(f"{path}: is text in UTF-32, which cannot be read; save it as UTF-8")
    for magic, what in _FOREIGN.items():
        if chunk.startswith(magic):
            raise InputError(f"{path}: is not a CSV table but {what}")
    return chunk.startswith(_UTF16)


def encoding_note(encoding: str) -> tuple[str, ...]:
    """Return the sentence about an encoding that was assumed; none for UTF-8."""
    return (f"its text was read as {_NAMES[encoding]}",) if encoding in _NAMES else ()


def as_utf8(content: bytes, encoding: str) -> bytes:
    """Return a text's bytes in UTF-8."""
    return content if encoding == UTF8 else content.decode(encoding).encode(UTF8)


def utf8_stream(stream: IO[bytes], encoding: str) -> IO[bytes]:
    """Return a stream of a text's bytes in UTF-8."""
    if encoding == UTF8:
        return stream
    return cast(IO[bytes], io.BufferedReader(_Utf8(stream, encoding), _CHUNK))


class _Utf8(io.RawIOBase):
    """Reads a text of another encoding as UTF-8."""

    def __init__(self, stream: IO[bytes], encoding: str) -> None:
        super().__init__()
        self._stream = stream
        self._decoder = codecs.getincrementaldecoder(encoding)()
        self._rest = b""

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: object) -> int:
        room = memoryview(buffer)  # type: ignore[arg-type]
        while not self._rest:
            chunk = self._stream.read(_CHUNK)
            self._rest = self._decoder.decode(chunk, final=not chunk).encode(UTF8)
            if not chunk:
                break
        count = min(len(room), len(self._rest))
        room[:count] = self._rest[:count]
        self._rest = self._rest[count:]
        return count

    def close(self) -> None:
        self._stream.close()
        super().close()
