"""Ordinary kriging of many blocks: time, memory, and the share spent outside the library.

    python tests/benchmarks/estimate.py [--targets 1000000] [--workers 2]

20,000 samples of 400 holes, the 24 nearest in the search ellipsoid. The share is measured on 50,000
targets in this process: what is not spent in calls of gstlearn.
"""

import argparse
import json
import resource
import sys
import time

import numpy as np

from geounfold.backends import gstlearn
from geounfold.estimation import Neighbourhood, Structure, Variogram, krige
from geounfold.estimation.support import discretised

MODEL = Variogram(0.1, (Structure("spherical", 0.9, (200, 200, 20)),))
CALLED = (
    *("kriging", "NeighMoving_create", "Db_create", "Db_addColumns", "Db_getColumn"),
    *("Model_createFromParam", "delete_Db"),
)


def problem(targets):
    """Return samples, their values and holes, and targets."""
    rng = np.random.default_rng(0)
    box = np.array([1000.0, 1000.0, 100.0])
    places = rng.random((20_000, 3)) * box, rng.normal(size=20_000), rng.integers(0, 400, 20_000)
    return *places, rng.random((targets, 3)) * box


def timed_blocks(near):
    """Return microseconds a block of 3 x 3 x 3 points, in this process."""
    points, values, _, places = problem(50_000)
    inside = discretised(np.array([10.0, 10.0, 5.0]), (3, 3, 3))
    axes = np.broadcast_to(np.eye(3), (len(places), 3, 3))
    start = time.perf_counter_ns()
    krige(points, values, places, MODEL, near, blocks=(inside, axes))
    return (time.perf_counter_ns() - start) / 1e3 / len(places)


def timed(near, holes_too):
    """Return microseconds a target, and the share outside gstlearn."""
    points, values, holes, places = problem(50_000)
    module = gstlearn.library()._gstlearn
    spent = [0.0]

    def watched(function):
        def call(*args, **words):
            start = time.perf_counter_ns()
            answer = function(*args, **words)
            spent[0] += time.perf_counter_ns() - start
            return answer

        return call

    kept = {name: getattr(module, name) for name in CALLED if hasattr(module, name)}
    for name, function in kept.items():
        setattr(module, name, watched(function))
    try:
        start = time.perf_counter_ns()
        krige(points, values, places, MODEL, near, holes=holes if holes_too else None)
        whole = time.perf_counter_ns() - start
    finally:
        for name, function in kept.items():
            setattr(module, name, function)
    return whole / 1e3 / len(places), 1 - spent[0] / whole


def main():
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--targets", type=int, default=1_000_000)
    parser.add_argument("--workers", type=int, default=2)
    args = parser.parse_args()
    radii = (400.0, 400.0, 40.0)
    out = {}
    for name, limit in (("no limit per hole", None), ("6 per hole", 6)):
        near = Neighbourhood(radii=radii, max_per_hole=limit)
        microseconds, share = timed(near, limit is not None)
        out[name] = {
            "us per target": round(microseconds),
            "share outside gstlearn": round(share, 3),
        }
    out["blocks, no limit per hole"] = {
        "us per target": round(timed_blocks(Neighbourhood(radii=radii)))
    }
    if args.targets:
        points, values, _, places = problem(args.targets)
        start = time.perf_counter()
        got = krige(points, values, places, MODEL, Neighbourhood(radii=radii), workers=args.workers)
        out["whole"] = {
            "targets": args.targets,
            "workers": args.workers,
            "seconds": round(time.perf_counter() - start, 1),
            "peak MiB": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
            "peak MiB of a worker": round(
                resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
            ),
            "flags": got.counts(),
        }
    sys.stdout.write(json.dumps(out, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
