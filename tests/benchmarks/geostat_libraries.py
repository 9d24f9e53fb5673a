"""Table of geostatistics libraries: ordinary kriging from the 24 nearest samples of many.

    python tests/benchmarks/geostat_libraries.py [-o data/geostat_libraries.csv]

20,000 samples and 100,000 targets in a box 10 times wider than high, a spherical variogram 10 times
longer along than across. Each library is asked for what it can do of that and runs in a process of
its own, on one core; where all targets would take too long, as many as are named under `targets`.
`error` is the largest difference from systems of the same 24 samples that NumPy solves.
"""

import argparse
import csv
import json
import resource
import subprocess
import sys
import time

import numpy as np
from scipy.spatial import cKDTree

SAMPLES, TARGETS, NEAREST = 20_000, 100_000, 24
STRETCH = np.array([1.0, 1.0, 10.0])
RANGE = 200.0
FEATURES = {
    "gstlearn": ("yes", "yes, rotated", "min and max", "no", "3 ranges, rotated, nested"),
    "gstlearn, islands": ("given", "given", "given", "given", "3 ranges, rotated, nested"),
    "pykrige": ("nearest only", "no", "max", "no", "2 ratios, rotated, one structure"),
    "gstools": ("no", "no", "no", "no", "2 ratios, rotated, nested"),
}
COLUMNS = (
    *("library", "version", "moving", "ellipsoid", "samples per target", "max per hole"),
    *("anisotropy", "samples", "targets", "us per target", "peak MiB", "error", "note"),
)


def problem(samples, targets):
    """Return samples, values and targets."""
    rng = np.random.default_rng(0)
    box = 1000 / STRETCH
    return rng.random((samples, 3)) * box, rng.normal(size=samples), rng.random((targets, 3)) * box


def reference(points, values, targets):
    """Return estimates from the 24 nearest samples, solved by NumPy."""
    distance, near = cKDTree(points * STRETCH).query(targets * STRETCH, NEAREST)
    P = (points * STRETCH)[near]
    between = np.linalg.norm(P[:, :, None] - P[:, None], axis=3)
    A = np.ones((len(targets), NEAREST + 1, NEAREST + 1))
    A[:, :-1, :-1] = spherical(between)
    A[:, -1, -1] = 0.0
    b = np.ones((len(targets), NEAREST + 1))
    b[:, :-1] = spherical(distance)
    weights = np.linalg.solve(A, b[..., None])[:, :NEAREST, 0]
    return (weights * values[near]).sum(axis=1)


def spherical(h):
    """Return the spherical covariance of sill 1."""
    r = np.minimum(h / RANGE, 1.0)
    return 1 - 1.5 * r + 0.5 * r**3


def gstlearn(points, values, targets):
    """Krige by gstlearn's own moving neighbourhood, with its ball tree."""
    import gstlearn as gl  # noqa: TID251

    gl.defineDefaultSpace(gl.ESpaceType.RN, 3)
    tables = []
    for P in (points * STRETCH, targets * STRETCH):
        tables.append(gl.Db.create())
        for axis in range(3):
            column = np.ascontiguousarray(P[:, axis])
            tables[-1].addColumns(column, f"x{axis}", gl.ELoc.X, axis)
    tables[0].addColumns(values, "v", gl.ELoc.Z, 0)
    model = gl.Model.createFromParam(gl.ECov.SPHERICAL, RANGE, 1.0)
    model.setDriftIRF(0)
    near = gl.NeighMoving.create(False, NEAREST, 1e4, 1, 1, NEAREST, [], [], True, 10)
    gl.kriging(*tables, model, near, True, False, False)
    return tables[1].getColumn("Kriging.v.estim")


def islands(points, values, targets):
    """Krige by gstlearn from neighbours found here, as `geounfold.estimate` does."""
    from geounfold.estimation import Neighbourhood, Structure, Variogram, krige

    model = Variogram(0.0, (Structure("spherical", 1.0, (RANGE, RANGE, RANGE / 10)),))
    near = Neighbourhood(radii=(1000.0, 1000.0, 100.0), max_samples=NEAREST)
    return krige(points, values, targets, model, near).estimate


def pykrige(points, values, targets):
    """Krige from the nearest samples by PyKrige's loop, 1,000 targets a call."""
    from pykrige.ok3d import OrdinaryKriging3D

    model = OrdinaryKriging3D(
        *points.T,
        values,
        variogram_model="spherical",
        variogram_parameters=[1.0, RANGE, 0.0],
        anisotropy_scaling_z=10.0,
    )
    parts = [
        model.execute("points", *part.T, backend="loop", n_closest_points=NEAREST)[0]
        for part in np.array_split(targets, -(-len(targets) // 1000))
    ]
    return np.concatenate([np.asarray(p) for p in parts])


def gstools(points, values, targets):
    """Krige from all samples by GSTools, which has no neighbourhoods."""
    import gstools as gs

    model = gs.Spherical(dim=3, var=1.0, len_scale=[RANGE, RANGE, RANGE / 10], nugget=0.0)
    return gs.krige.Ordinary(model, points.T, values)(targets.T, return_var=False)


RUNS = {
    "gstlearn": (gstlearn, "gstlearn", SAMPLES, 20_000, "no limit per hole"),
    "gstlearn, islands": (
        *(islands, "gstlearn", SAMPLES, TARGETS),
        "neighbours by SciPy, systems by gstlearn: what geounfold does",
    ),
    "pykrige": (
        *(pykrige, "pykrige", 1_000, 500),
        "holds all distances: 3.2 GB for 20,000 samples; loops in Python",
    ),
    "gstools": (
        *(gstools, "gstools", 3_000, 1_000),
        "inverts one matrix of all samples: hours and 3.2 GB for 20,000; global, so not comparable",
    ),
}


def measure(name):
    """Print one library's figures as JSON."""
    from importlib.metadata import version

    run, package, samples, targets, note = RUNS[name]
    points, values, places = problem(samples, targets)
    run(points[:500], values[:500], places[:10])  # imports are not counted
    start = time.process_time()
    got = np.asarray(run(points, values, places))
    seconds = time.process_time() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    some = slice(0, 1000)
    error = np.abs(got[some] - reference(points, values, places[some])).max()
    row = {
        "library": name,
        "version": version(package),
        **dict(zip(COLUMNS[2:7], FEATURES[name], strict=True)),
        "samples": samples,
        "targets": targets,
        "us per target": round(seconds / targets * 1e6),
        "peak MiB": round(peak),
        "error": f"{error:.1g}",
        "note": note,
    }
    sys.stdout.write("\n" + json.dumps(row) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output")
    parser.add_argument("--library", choices=RUNS)
    args = parser.parse_args()
    if args.library:
        measure(args.library)
        return 0
    rows = []
    for name in RUNS:
        done = subprocess.run(
            [sys.executable, __file__, "--library", name],
            capture_output=True,
            text=True,
            check=True,
        )
        rows.append(json.loads(done.stdout.splitlines()[-1]))
        sys.stdout.write(f"{rows[-1]}\n")
    if args.output:
        with open(args.output, "w", newline="", encoding="utf-8") as file:  # noqa: PTH123
            writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
