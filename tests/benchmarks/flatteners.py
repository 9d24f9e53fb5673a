"""Measure the flatteners on seeded and real surfaces, side by side in one process.

    python tests/benchmarks/flatteners.py [--only NAME ...] [--data ../shared/data] [-o TABLE.csv]

Surfaces: a cylinder sheet, a corrugated fold (both developable but for their triangles), a gentle
dome, a saddle and a spherical cap, their vertices moved about at random by a quarter of a cell, of
1,000, 10,000 and 100,000 triangles; and where the folder ``--data`` is there, the disks of
``scec_cfm`` (real faults) and ``param_bff`` (meshes that try flatteners).

One row per surface and free flattener, each as it is without repair; columns:

  edge_strain          root mean square of flat length / folded length - 1
  symmetric_dirichlet  mean of s1^2 + s2^2 + 1/s1^2 + 1/s2^2: 4 for an isometry, inf with a flip
  flips, overlaps      triangles turned over, pairs of border edges that meet
  iterations, stop     as the method reports them
  cpu_seconds          processor time, checks of the surface and start included, once
  over_arap            ``spring`` on generated surfaces: its time over that of libigl's ARAP, both
                       run until a step moves no vertex by more than 1e-6 of the surface's size
  over_arap_alike      the same, both stopped at the first step whose edge strain is no more than
                       what ARAP's convergence leaves, to four figures
  error                why there is no answer

The two ratios are of medians over interleaved repeats, in processor time.  libigl's ARAP runs bare
there: from the same checks and Tutte's embedding, nothing recorded, and in the second ratio no look
at the displacement either.  On 100,000 triangles the methods that take minutes are left out.

Rows of an existing table that are not measured again stay.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from geounfold.backends.igl import ArapSteps, face_components
from geounfold.errors import GeounfoldError
from geounfold.flattening import FLATTENERS, ArapOptions, SpringOptions, flatten, measures
from geounfold.flattening._problem import Problem, displacement, make_problem, upright
from geounfold.flattening._start import check_disk, tutte
from geounfold.geometry.measures import lengths
from geounfold.geometry.mesh import Floats, TriMesh
from geounfold.io import read_surface, write_table

REPOSITORY = Path(__file__).resolve().parents[2]
SIZES = (1_000, 10_000, 100_000)
REPEATS = {1_000: 15, 10_000: 7, 100_000: 3}
FAST = ("spring", "arap", "lscm", "harmonic")
"""Flatteners that run on 100,000 triangles too."""

FIGURES = 1e-4
"""Relative difference of edge strains that counts as none."""

KEY = ["surface", "faces", "flattener"]


def sheet(size: int, height: Callable[[Floats, Floats], tuple[Floats, Floats, Floats]]) -> TriMesh:
    """Return a square of about ``size`` triangles, shaped by ``height(x, y) -> x, y, z``."""
    k = int(np.sqrt(size / 2))
    i, j = (a.ravel() for a in np.meshgrid(np.arange(k + 1), np.arange(k + 1), indexing="ij"))
    inside = ((i > 0) & (i < k) & (j > 0) & (j < k))[:, None]
    moved = np.random.default_rng(1).uniform(-0.25, 0.25, (len(i), 2))
    x, y = ((np.stack([i, j], axis=1) + inside * moved) / k).T
    node = np.arange((k + 1) ** 2).reshape(k + 1, k + 1)
    a, b, c, d = (s.ravel() for s in (node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]))
    even = ((i + j).reshape(k + 1, k + 1)[:-1, :-1].ravel() % 2 == 0)[:, None]
    low = np.where(even, np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
    high = np.where(even, np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
    return TriMesh(np.stack(height(x, y), axis=1), np.concatenate([low, high]))


def cylinder(x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Return an arc of 143 degrees."""
    return -np.sin(2.5 * x) / 2.5, y, np.cos(2.5 * x) / 2.5


def fold(x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Return three corrugations with limbs of 56 degrees, one after the other."""
    return x, y, 0.08 * np.sin(6 * np.pi * x)


def dome(x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Return a gentle dome."""
    return x, y, 0.2 * np.exp(-8 * ((x - 0.5) ** 2 + (y - 0.5) ** 2))


def saddle(x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Return a saddle."""
    return x, y, 0.6 * ((x - 0.5) ** 2 - (y - 0.5) ** 2)


def cap(x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Return a cap of the unit sphere, its corners 40 degrees from the top."""
    p, q = x - 0.5, y - 0.5
    r = np.maximum(np.hypot(p, q), 1e-300)
    turn = np.sin(r) / r
    return p * turn, q * turn, np.cos(r)


SHAPES = {s.__name__: s for s in (cylinder, fold, dome, saddle, cap)}


def surfaces(data: Path) -> Iterator[tuple[str, TriMesh, int]]:
    """Yield name, mesh and size (0 for real surfaces)."""
    for size in SIZES:
        for name, shape in SHAPES.items():
            yield name, sheet(size, shape), size
    for path in [*sorted((data / "scec_cfm").glob("*.ts")), *(data / "param_bff").glob("*.obj")]:
        mesh = read_surface(path)
        part = face_components(mesh.F)
        largest = mesh.submesh(part == np.bincount(part).argmax())[0]
        try:
            check_disk(largest)
        except GeounfoldError as err:
            print(f"{path.name}: left out, {err}", file=sys.stderr)  # noqa: T201
            continue
        yield path.stem, largest, 0


def cpu(call: Callable[[], object]) -> float:
    """Return the processor seconds of a call."""
    started = time.process_time()
    call()
    return time.process_time() - started


def prepared(mesh: TriMesh) -> Problem:
    """Return the checked problem, as ``flatten`` has it."""
    return make_problem(mesh, check_disk(mesh), None)


def strain_of(problem: Problem, uv: Floats) -> float:
    """Return the root mean square edge strain."""
    return float(np.sqrt(np.mean((lengths(uv, problem.edges) / problem.rest - 1) ** 2)))


def bare_arap(mesh: TriMesh, steps: int | None = None, strains: list[float] | None = None) -> None:
    """Run libigl's ARAP to the default tolerance, or a number of steps."""
    problem, options = prepared(mesh), ArapOptions()
    size = problem.size
    step = ArapSteps((mesh.V - mesh.V.mean(axis=0)) / size, mesh.F)
    uv = tutte(problem) / size
    for _ in range(steps or options.max_iter):
        before, uv = uv, step(uv)
        uv -= uv.mean(axis=0)
        if strains is not None:
            strains.append(strain_of(problem, uv * size))
        if steps is None and displacement(before, uv) <= options.tol:
            break
    upright(uv * size, mesh.F)


def beside_arap(mesh: TriMesh, repeats: int) -> dict[str, float]:
    """Return the two ratios of time."""
    strains: list[float] = []
    bare_arap(mesh, strains=strains)
    enough = strains[-1] * (1 + FIGURES)
    steps = int(np.argmax(np.array(strains) <= enough)) + 1
    for count in range(1, SpringOptions().max_iter + 1):
        few = SpringOptions(max_iter=count)
        if flatten(mesh, options=few, repair=False).edge_error[-1] <= enough:
            break
    alike = SpringOptions(tol=ArapOptions().tol)
    runs: dict[str, list[Callable[[], object]]] = {
        "over_arap": [
            lambda: flatten(mesh, options=alike, repair=False),
            lambda: bare_arap(mesh),
        ],
        "over_arap_alike": [
            lambda: flatten(mesh, options=few, repair=False),
            lambda: bare_arap(mesh, steps),
        ],
    }
    ratios = {}
    for name, pair in runs.items():
        times = [[cpu(call) for call in pair] for _ in range(repeats)]
        ours, theirs = (statistics.median(column) for column in zip(*times, strict=True))
        ratios[name] = ours / theirs
    return ratios


def row(name: str, mesh: TriMesh, method: str) -> dict[str, Any]:
    """Return one flattener's figures on one surface."""
    out: dict[str, Any] = {"surface": name, "faces": len(mesh.F), "flattener": method}
    started = time.process_time()
    try:
        flat = flatten(mesh, method, repair=False)
    except GeounfoldError as err:
        return out | {"error": str(err)}
    out["cpu_seconds"] = time.process_time() - started
    arrays = mesh.V, mesh.F, flat.uv
    return out | {
        "edge_strain": measures.edge_strain(*arrays),
        "symmetric_dirichlet": measures.symmetric_dirichlet(*arrays),
        "flips": flat.flips,
        "overlaps": flat.overlaps,
        "iterations": flat.iterations,
        "stop": str(flat.stop),
        "error": "",
    }


COLUMNS = [
    *KEY,
    *("edge_strain", "symmetric_dirichlet", "flips", "overlaps", "iterations", "stop"),
    *("cpu_seconds", "over_arap", "over_arap_alike", "error"),
]


def merged(rows: list[dict[str, Any]], path: Path | None) -> pd.DataFrame:
    """Return the rows, and those of an existing table that they do not replace."""
    table = pd.DataFrame(rows, columns=COLUMNS)
    if path is not None and path.exists():
        before = pd.read_csv(path, keep_default_na=False, na_values=[""])
        table = pd.concat([before, table]).drop_duplicates(KEY, keep="last")
    order = {name: k for k, name in enumerate(FLATTENERS)}
    table = table.sort_values(KEY, key=lambda c: c.map(order) if c.name == "flattener" else c)
    for column in ("edge_strain", "symmetric_dirichlet", "cpu_seconds"):
        table[column] = table[column].map(lambda v: float(f"{v:.5g}"))
    for column in ("over_arap", "over_arap_alike"):
        table[column] = table[column].astype(float).round(2)
    counts = dict.fromkeys(("flips", "overlaps", "iterations"), "Int64")
    return table.astype(counts).reset_index(drop=True)


def main(argv: list[str] | None = None) -> int:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description="Measure the flatteners side by side.")
    parser.add_argument("--only", nargs="*", help="surfaces by name, or name and faces: dome:9800")
    parser.add_argument("--flatteners", nargs="*", help="flatteners by name (default: all free)")
    parser.add_argument("--data", type=Path, default=REPOSITORY.parent / "shared" / "data")
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args(argv)
    free = [name for name, flattener in FLATTENERS.items() if flattener.free]
    rows = []
    for name, mesh, size in surfaces(args.data):
        if args.only and not {name, f"{name}:{len(mesh.F)}", f"{name}:{size}"} & set(args.only):
            continue
        for method in args.flatteners or (free if size < max(SIZES) else FAST):
            figures = row(name, mesh, method)
            if method == "spring" and size:
                figures |= beside_arap(mesh, REPEATS[size])
            print(figures, file=sys.stderr, flush=True)  # noqa: T201
            rows.append(figures)
        if args.output is not None:
            write_table(args.output, merged(rows, args.output))
    print(merged(rows, None).to_string())  # noqa: T201
    return 0


if __name__ == "__main__":
    sys.exit(main())
