"""The map that a command's BODY is: saved, or made of its blocks or its solid."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from geounfold.cli.domains.maps import one_map
from geounfold.cli.inputs.solid import block_size
from geounfold.cli.terminal.console import Console
from geounfold.io.paths import ending, existing_file

if TYPE_CHECKING:
    from geounfold.mapping.mesh_map import UnfoldingMap


def carrier_of(path: str, args: Namespace, console: Console) -> UnfoldingMap:
    """Return the map of a body: a saved one (.npz), or that of blocks or of a closed surface.

    Raises
    ------
    InputError
        The file cannot be read, or the body cannot be unfolded.
    """
    file = existing_file(Path(path))
    if ending(file) == ".npz":
        return one_map(args, path)
    from geounfold.io import read_points
    from geounfold.io.solids import fill, is_wireframe
    from geounfold.unfolding.run import unfold

    console.stage(f"reading {path}")
    if is_wireframe(file):
        made = fill(file, block_size(args.block_size))
        for sentence in made.told:
            console.note(f"{path}: {sentence}")
        return unfold(made, progress=console.stage).map  # type: ignore[return-value]
    return unfold(read_points(path).points, progress=console.stage).map  # type: ignore[return-value]
