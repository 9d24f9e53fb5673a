"""Output files that appear whole or not at all, and replace files only if that is allowed.

All outputs of a run are checked before anything is computed. Each is written into a hidden folder
beside its target. They are moved in place together when all are complete.
"""

from __future__ import annotations

import errno
import os
import shutil
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Protocol

from geounfold.backends.system import files
from geounfold.errors import OutputError
from geounfold.io.formats.registry import check_library_of
from geounfold.io.messages import shown
from geounfold.io.paths import ending

_SOME = 4  # endings that a message names


class Watcher(Protocol):
    """Is called as outputs are written, so that an interrupted run leaves nothing behind."""

    def part(self, path: Path) -> None:
        """Take note of a temporary file or folder that is about to be made."""

    def committing(self) -> AbstractContextManager[None]:
        """Return the context in which outputs are moved in place."""


class _NoWatcher:
    """Does nothing."""

    def part(self, path: Path) -> None: ...

    def committing(self) -> AbstractContextManager[None]:
        return nullcontext()


@dataclass(frozen=True)
class Outputs:
    """The files that a run will write, checked.

    Attributes
    ----------
    paths : dict of Path
        Absolute targets, by the name of each one's option.
    overwrite : bool
        Whether existing files may be replaced.
    watcher : Watcher
        Is called as outputs are written and moved in place.
    """

    paths: Mapping[str, Path]
    overwrite: bool = False
    watcher: Watcher = field(default_factory=_NoWatcher)

    @classmethod
    def planned(
        cls,
        wanted: Mapping[str, tuple[str | Path | None, tuple[str, ...]]],
        inputs: Iterable[str | Path] = (),
        *,
        overwrite: bool = False,
        watcher: Watcher | None = None,
    ) -> Outputs:
        """Return the outputs of a run after checking all of them; nothing stays on disk.

        Parameters
        ----------
        wanted : dict of (path or None, valid endings)
            Outputs by the name of the option. The path is None for an output that is not wanted;
            an empty tuple allows any ending.
        inputs : paths, optional
            The run's inputs, none of which may be an output too.
        overwrite : bool, optional
            Whether existing files may be replaced.
        watcher : Watcher, optional
            Is called as outputs are written.

        Raises
        ------
        OutputError
            A folder is missing or cannot be written; a file exists already and may not be
            replaced; or a target is a directory, an input or another output, or has an unknown
            ending.
        MissingDependencyError
            A target's format needs a library that is not installed.
        """
        targets = {
            name: _target(name, Path(path), {n: endings for n, (_, endings) in wanted.items()})
            for name, (path, _) in wanted.items()
            if path is not None
        }
        sources = [Path(p) for p in inputs]
        for name, target in targets.items():
            twins = (n for n in targets if n != name and files.same_file(targets[n], target))
            twin = next(twins, None)
            if twin is not None:
                raise OutputError(f"{target}: {name} and {twin} name the same file")
            if any(files.same_file(target, source) for source in sources):
                raise OutputError(f"{target}: {name} is also an input; choose another file")
            _check_replaceable(target, overwrite)
        watcher = watcher or _NoWatcher()
        for folder in sorted({target.parent for target in targets.values()}):
            _check_writable(folder, watcher)
        return cls(targets, overwrite, watcher)

    @contextmanager
    def writing(self) -> Iterator[dict[str, Path]]:
        """Yield a path to write each output to; when the block ends, all of them appear, or none.

        If an error or an interrupt ends the block early, every target stays as it was.

        Raises
        ------
        OutputError
            The disk is full, a folder is gone, or a target has appeared meanwhile and may not be
            replaced.
        """
        folders: dict[Path, Path] = {}
        try:
            with _as_output_error(self.paths.values()):
                for folder in sorted({target.parent for target in self.paths.values()}):
                    folders[folder] = _part_of(folder)
                    self.watcher.part(folders[folder])
                    folders[folder].mkdir(0o700)
                parts = {n: folders[t.parent] / t.name for n, t in self.paths.items()}
                yield dict(parts)
                for part in parts.values():
                    files.flush(part)
                with self.watcher.committing():
                    self._publish(parts)
                for folder in folders:
                    files.flush(folder)
        finally:
            for part_folder in folders.values():
                shutil.rmtree(part_folder, ignore_errors=True)

    def _publish(self, parts: Mapping[str, Path]) -> None:
        """Move all complete files in place; if one cannot be moved, put all targets back."""
        undo: list[Callable[[], object]] = []
        try:
            for name, part in parts.items():
                target = self.paths[name]
                if self.overwrite and os.path.lexists(target):
                    _check_replaceable(target, self.overwrite)
                    old = part.with_name(f"{part.name}.old")
                    files.keep(target, old)
                    shutil.copymode(target, part)
                    files.replace(part, target)
                    undo.append(partial(files.replace, old, target))
                else:
                    _move_new(part, target)
                    undo.append(target.unlink)
        except BaseException:
            for step in reversed(undo):
                with suppress(OSError):
                    step()
            raise


@contextmanager
def replacing(path: str | Path, *, overwrite: bool = False) -> Iterator[Path]:
    """Yield a path to write to; the file appears at `path` when the block ends without an error.

    Raises
    ------
    OutputError
        As `Outputs.planned` and `Outputs.writing`.
    """
    outputs = Outputs.planned({"the output": (path, ())}, overwrite=overwrite)
    with outputs.writing() as parts:
        yield parts["the output"]


@contextmanager
def whole_folder(
    path: str | Path, *, overwrite: bool = False, watcher: Watcher | None = None
) -> Iterator[Path]:
    """Yield a folder to write into; it appears at `path` when the block ends without an error.

    Raises
    ------
    OutputError
        `path` exists and may not be replaced or is not a folder, or its parent folder is missing
        or cannot be written.
    """
    target, watcher = Path(path).absolute(), watcher or _NoWatcher()
    _check_folder(target, overwrite)
    _check_writable(target.parent, watcher)
    part = _part_of(target.parent)
    watcher.part(part)
    try:
        with _as_output_error([target]):
            part.mkdir(0o700)
            fresh = part / target.name
            fresh.mkdir()
            yield fresh
            for file in fresh.iterdir():
                files.flush(file)
            with watcher.committing():
                _check_folder(target, overwrite)
                old = part / f"{target.name}.old"
                if target.exists():
                    files.move(target, old)
                try:
                    files.move(fresh, target)
                except BaseException:
                    if old.exists():
                        files.move(old, target)
                    raise
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _check_folder(target: Path, overwrite: bool) -> None:
    """Raise OutputError if a folder cannot be written at a path."""
    if not os.path.lexists(target):
        return
    if target.is_symlink() or not target.is_dir():
        raise OutputError(f"{target}: exists and is not a folder; parts are written into one")
    if not overwrite:
        raise OutputError(f"{target}: the folder exists already; --overwrite replaces it")


def _target(name: str, path: Path, every: Mapping[str, tuple[str, ...]]) -> Path:
    """Return the path that links lead to, after checking its ending among those of the option."""
    if fault := files.fault_of_name(path):
        raise OutputError(f"{name}: '{shown(path)}': {fault} on this system; choose another")
    try:
        target = files.unlimited(path.resolve())
        is_folder = target.is_dir()
    except (OSError, ValueError, RuntimeError) as error:
        raise OutputError(f"{name}: '{shown(path)}' is not a valid path: {error}") from error
    if is_folder:
        raise OutputError(f"{path}: {name} is a directory, not a file")
    if every[name] and ending(path) not in every[name]:
        raise OutputError(f"{path}: {_must_end(name, ending(path), every)}")
    check_library_of(ending(path))
    return target


def _must_end(name: str, kind: str, every: Mapping[str, tuple[str, ...]]) -> str:
    """Return how an output must end, and which option the ending given belongs to."""
    endings = every[name]
    some = " or ".join(endings)
    if len(endings) > _SOME:
        some = f"{', '.join(endings[:_SOME])} or another kind of table"
    other = next((n for n, ends in every.items() if kind and kind in ends), None)
    return f"{name} must end in {some}" + (f"; {kind} is for {other}" if other else "")


def _check_replaceable(target: Path, overwrite: bool) -> None:
    """Raise OutputError if a target exists and may not be replaced."""
    if not os.path.lexists(target):
        return
    if not target.is_file():
        raise OutputError(f"{target}: exists and is not a regular file")
    if not overwrite:
        raise OutputError(f"{target}: the file exists already; --overwrite replaces it")


def _part_of(folder: Path) -> Path:
    """Return a new path in a folder for what is not complete yet."""
    return folder / f".geounfold-{uuid.uuid4().hex}.part"


def _check_writable(folder: Path, watcher: Watcher) -> None:
    """Raise OutputError if nothing can be made in a folder, which is tried."""
    if not folder.exists():
        raise OutputError(f"{folder}: no such folder; make it first")
    if not folder.is_dir():
        raise OutputError(f"{folder}: is a file, not a folder")
    trial = _part_of(folder)
    watcher.part(trial)
    try:
        trial.mkdir(0o700)
    except OSError as error:
        raise OutputError(
            f"{folder}: the folder cannot be written: {error.strerror or error}"
        ) from error
    finally:
        with suppress(OSError):
            trial.rmdir()


@contextmanager
def _as_output_error(targets: Iterable[Path]) -> Iterator[None]:
    """Raise OutputError, in one line, for the system's errors while writing."""
    try:
        yield
    except OSError as error:
        if error.errno == errno.ENOMEM:
            raise MemoryError from error
        names = ", ".join(str(target) for target in targets)
        raise OutputError(
            f"cannot write {names}: {error.strerror or error}; nothing was changed"
        ) from error


def _move_new(part: Path, target: Path) -> None:
    """Move a file in place unless the target exists."""
    try:
        files.move_new(part, target)
    except FileExistsError as error:
        raise OutputError(
            f"{target}: the file has appeared meanwhile; --overwrite replaces it"
        ) from error
