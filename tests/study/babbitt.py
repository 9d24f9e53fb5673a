"""Real drill-holes: whole-hole cross-validation of copper and nickel in the Babbitt deposit.

    python tests/study/babbitt.py [../shared/data/babbitt] [-o data/babbitt.csv]

The body is the solid of the mineralised zone, filled with blocks of 150 x 150 x 75 ft; samples are
composites of 20 ft of the holes in it. Arms, fits and neighbourhoods are those of `study.py`, but
that no truth is known: the best of nine folded settings is told by its own error, their axes
are turned about the strike of the mean plane, and the
stratigraphic height is taken between the solid's highest and lowest block of each column.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pyvista as pv
from scipy.spatial import cKDTree
from study import NEAREST, PER_HOLE, TILTS, neighbourhood, some_holes

import geounfold as gu
from geounfold.estimation import fit_variogram, hole_numbers, krige, score
from geounfold.io import read_surface

STEPS = np.array([150.0, 150.0, 75.0])  # feet
COMPOSITE, FITTED = 20.0, 2000


def filled(solid) -> np.ndarray:
    """Return the centroids of blocks inside a closed surface."""
    low, high = solid.V.min(axis=0), solid.V.max(axis=0)
    axes = [np.arange(a + s / 2, b, s) for a, b, s in zip(low, high, STEPS, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    faces = np.column_stack([np.full(len(solid.F), 3), solid.F]).ravel()
    surface = pv.PolyData(solid.V - low, faces)
    inside = pv.PolyData(grid - low).select_interior_points(surface, check_surface=False)
    return grid[np.asarray(inside["selected_points"], dtype=bool)]


def level(blocks, points) -> np.ndarray:
    """Return heights between bottom and top of the nearest column, times the mean thickness."""
    columns, index = np.unique(blocks[:, :2], axis=0, return_inverse=True)
    top, bottom = np.full(len(columns), -np.inf), np.full(len(columns), np.inf)
    np.maximum.at(top, index.ravel(), blocks[:, 2] + STEPS[2] / 2)
    np.minimum.at(bottom, index.ravel(), blocks[:, 2] - STEPS[2] / 2)
    near = cKDTree(columns).query(points[:, :2])[1]
    thick = (top - bottom)[near]
    return float((top - bottom).mean()) * (points[:, 2] - bottom[near]) / thick


def axis_of(blocks) -> float:
    """Return the strike of the mean plane of the body, degrees clockwise from +y."""
    columns, index = np.unique(blocks[:, :2], axis=0, return_inverse=True)
    height = np.bincount(index.ravel(), blocks[:, 2]) / np.bincount(index.ravel())
    slope = np.linalg.lstsq(np.c_[columns - columns.mean(axis=0), np.ones(len(columns))], height)[0]
    # Strike of the mean plane: across its steepest way down.
    return float(np.degrees(np.arctan2(slope[0], slope[1]))) + 90.0


def main(argv=None) -> int:
    """Write a row for each grade and arm."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, nargs="?", default=Path("../shared/data/babbitt"))
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args(argv)
    blocks = filled(read_surface(args.data / "Mpz.stl"))
    u = gu.unfold(blocks)
    tables = [args.data / f"{n}_BABBITT.csv" for n in ("collar", "survey", "assay")]
    holes = gu.read_drillholes(*tables, dip_positive_down=True, drop_invalid=True)
    composites = holes.samples(COMPOSITE)
    folded = composites[["x", "y", "z"]].to_numpy()
    carried = u.map.carry(folded)
    bearing = axis_of(blocks)
    sys.stdout.write(
        f"{len(blocks)} blocks, proved {u.certificate.injective}, axis {bearing:.0f} degrees, "
        f"{len(composites)} composites, {int(carried.inside.sum())} inside\n"
    )
    settings = [
        {"anisotropy": "isotropic"},
        *({"anisotropy": "transverse", "rotation": (bearing, 0.0, t)} for t in TILTS),
        *({"anisotropy": "orthotropic", "rotation": (bearing, 0.0, t)} for t in TILTS[1:4]),
    ]
    rows = []
    for grade in ("CU", "NI"):
        values = composites[grade].to_numpy()
        kept = carried.inside & np.isfinite(values)
        v, number = values[kept], hole_numbers(composites["hole"].to_numpy()[kept])
        fitted = some_holes(number, FITTED, 0)
        flat = np.column_stack([folded[kept, :2], level(blocks, folded[kept])])
        tries = [("folded", folded[kept], how) for how in settings]
        tries += [("stratigraphic", flat, {}), ("geounfold", carried.points[kept], {})]
        for arm, P, how in tries:
            model = fit_variogram(P[fitted], v[fitted], **how).model
            near = neighbourhood(model, P)
            back = krige(P, v, P, model, near, holes=number, leave_out=number)
            s = score(v, back.estimate)
            rows.append(
                {
                    "grade": grade,
                    "arm": arm,
                    "setting": " ".join(str(x) for x in how.values()),
                    "holes": int(number.max()) + 1,
                    "samples": len(v),
                    "deviation": v.std(),
                    "cv_rmse": s.rmse,
                    "cv_bias": s.bias,
                    "cv_slope": s.slope,
                    "cv_correlation": s.correlation,
                    "range_along": model.ranges[0],
                    "range_across": model.ranges[2],
                    "nearest": NEAREST,
                    "per_hole": PER_HOLE,
                }
            )
            sys.stdout.write(f"{rows[-1]}\n")
            sys.stdout.flush()
    table = pd.DataFrame(rows)
    if args.output:
        table.to_csv(args.output, index=False, float_format="%.5g", lineterminator="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
