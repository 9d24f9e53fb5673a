"""Estimation on the command line: its options, its samples and its summary."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from geounfold.cli.inputs.numbers import number, three_numbers, whole_number
from geounfold.cli.inputs.values import no_grade, values_rules
from geounfold.errors import InputError, OptionError
from geounfold.io.paths import existing_file

if TYPE_CHECKING:
    from geounfold.estimation import Estimation, Variogram
    from geounfold.geometry.mesh import Floats
    from geounfold.io import PointTable
    from geounfold.mapping.mesh_map import UnfoldingMap

_WHOLE = (
    *("min_samples", "max_samples", "max_per_hole"),
    *("max_per_octant", "min_holes", "min_octants"),
)


def estimation(
    args: Namespace,
    saved: UnfoldingMap,
    samples: PointTable,
    blocks: Floats,
    stage: Callable[[str], None],
) -> Estimation:
    """Return the estimates on blocks, given by their centroids (n, 3).

    Raises
    ------
    OptionError
        An option with an invalid value.
    InputError
        A file without a column that is needed, or that cannot be read.
    """
    near = _neighbourhood(args)
    mean = None if args.mean is None else number(args.mean, "--mean")
    power = number(args.power, "--power")
    workers = whole_number(args.workers, "--workers")
    soft = number(args.soft_boundary, "--soft-boundary")
    if soft < 0:
        raise OptionError(f"--soft-boundary needs 0 or more blocks, not '{args.soft_boundary}'")
    cells = _cells(args.decluster)
    size = None if args.block_size is None else three_numbers(args.block_size, "--block-size")
    parts = _discretise(args)
    also = _also(args)
    variogram = None if args.variogram is None else variogram_file(args.variogram)
    off = None if args.position_error is None else _position_error(args.position_error)
    count, seed = _realisations(args)
    from geounfold.estimation import estimate

    stage("estimating")
    found = estimate(
        saved, sample_table(samples, args), blocks, variogram,
        grade=args.grade, method=args.method, neighbourhood=near,
        mean=mean, power=power, workers=workers, values=values_rules(args), cells=cells,
        soft_boundary=soft, all_blocks=args.all_blocks, position_error=off,
        block_size=size, discretise=parts, also=also,
    )  # fmt: skip
    if count is None:
        return found
    from geounfold.estimation.realisations import with_realisations

    stage("simulating")
    return with_realisations(found, count, seed=seed)


def summarised(
    args: Namespace,
    result: Estimation,
    stage: Callable[[str], None],
    note: Callable[[str], None],
) -> dict[str, Any]:
    """Return the summary; with --cross-validate, the cross-validation too, which is noted."""
    out = result.summary()
    if args.cross_validate:
        from geounfold.estimation import score
        from geounfold.estimation.scores import cross_validation_told

        stage("cross-validating")
        found = result.cross_validation()
        scores = score(result.samples.grades, found.estimate)
        out["cross_validation"] = {**asdict(scores), "flags": found.counts()}
        holes = 0 if result.samples.holes is None else len(np.unique(result.samples.holes))
        told, poor = cross_validation_told(scores, holes)
        if poor:
            out["warnings"] = [*out["warnings"], told]
        else:
            note(told)
        for method in result.others:
            stage(f"cross-validating {method}")
            other = result.cross_validation(method)
            out["cross_validation"][method] = asdict(score(result.samples.grades, other.estimate))
    return out


def sample_table(samples: PointTable, args: Namespace) -> pd.DataFrame:
    """Return the samples' coordinates, grade and holes as one table."""
    if args.grade in (*samples.columns, *"xyz", "hole"):
        raise OptionError(f"--grade {args.grade} names a coordinate or the holes")
    grade = samples.column(args.grade)
    try:
        values_rules(args).read(grade).check(grade, samples.source)
    except InputError as error:
        raise no_grade(error, samples, args, args.grade) from error
    columns: dict[str, Any] = dict(zip("xyz", samples.points.T, strict=True))
    hole = args.hole or _hole(samples)
    if hole is not None:
        if list(samples.frame.columns).count(hole) != 1:
            raise InputError(f"{samples.source}: no column '{hole}', or more than one")
        columns["hole"] = samples.frame[hole].to_numpy()
    table = pd.DataFrame({**columns, args.grade: grade.to_numpy(dtype=object)})
    table.attrs["source"] = samples.source
    return table


def _discretise(args: Namespace) -> tuple[int, int, int]:
    """Return the points along each side of --discretise."""
    if args.discretise is None:
        return 3, 3, 3
    if args.block_size is None:
        raise OptionError("--discretise needs --block-size X,Y,Z: without it points are estimated")
    words = args.discretise.split(",")
    if len(words) != 3:
        raise OptionError(
            f"--discretise needs three numbers such as 3,3,3, not '{args.discretise}'"
        )
    a, b, c = (whole_number(word.strip(), "--discretise") for word in words)
    return a, b, c


def _realisations(args: Namespace) -> tuple[int | None, int]:
    """Return the number of --realisations, if any, and their seed."""
    seed = whole_number(args.seed, "--seed")
    if args.realisations is None:
        return None, seed
    if args.block_size is not None:
        raise OptionError("--realisations are of points: leave out --block-size")
    if args.method not in ("ordinary", "simple"):
        raise OptionError("--realisations need a variogram: --method ordinary or simple")
    return whole_number(args.realisations, "--realisations"), seed


def _also(args: Namespace) -> list[Any]:
    """Return the methods of --also."""
    from geounfold.estimation import METHODS

    if args.also is None:
        return []
    if args.also == "all":
        return [method for method in METHODS if method != args.method]
    words = [word.strip() for word in args.also.split(",")]
    for word in words:
        if word not in METHODS or word == args.method:
            raise OptionError(
                f"--also takes other methods than --method: {', '.join(METHODS)}, or all; "
                f"not '{word}'"
            )
    return words


def _cells(text: str | None) -> tuple[float, float, float] | str | None:
    """Return the sides of --decluster, auto, or None."""
    if text is None or text == "auto":
        return text
    sides = three_numbers(text, "--decluster", "50,50,10")
    if min(sides) <= 0:
        raise OptionError(f"--decluster needs sides above 0, or auto, not '{text}'")
    return sides


def _hole(samples: PointTable) -> str | None:
    """Return the column of the holes' names, if there is exactly one."""
    from geounfold.drillholes import ALIASES
    from geounfold.io.packages.names import plain_name

    aliases = ALIASES["assay"]["hole"]
    found = [str(name) for name in samples.frame.columns if plain_name(name) in aliases]
    return found[0] if len(found) == 1 else None


def _neighbourhood(args: Namespace) -> dict[str, Any]:
    """Return the options of the search that are given."""
    near: dict[str, Any] = {
        name: whole_number(getattr(args, name), f"--{name.replace('_', '-')}")
        for name in _WHOLE
        if getattr(args, name) is not None
    }
    if args.radii is not None:
        near["radii"] = three_numbers(args.radii, "--radii", "150,150,20")
    if args.rotation is not None:
        if args.radii is None:
            raise OptionError(
                "--rotation needs --radii: without them the search follows the variogram"
            )
        near["rotation"] = three_numbers(args.rotation, "--rotation", "30,0,0")
    return near


def _position_error(text: str) -> tuple[float, float]:
    """Return both standard deviations of --position-error, given or from a summary."""
    if text.lower().endswith(".json"):
        path = existing_file(Path(text))
        try:
            figures = json.loads(path.read_text(encoding="utf-8-sig"))
            found = figures["uncertainty"]
            along, across = (float(found[name]) for name in ("sd_along", "sd_across"))
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(f"{text}: no summary of `geounfold unfold --uncertainty`") from error
    else:
        such = f"--position-error needs two numbers of 0 or more such as 2.5,1, not '{text}'"
        try:
            along, across = (number(word, "--position-error") for word in text.split(","))
        except (ValueError, OptionError) as error:
            raise OptionError(such) from error
        if min(along, across) < 0:
            raise OptionError(such)
    return along, across


def variogram_file(path: str) -> Variogram:
    """Return the variogram of a .toml file, or of a .json file: a model, or a summary with one.

    Raises
    ------
    InputError
        The file is missing or not text.
    OptionError
        It holds no valid model.
    """
    from geounfold.estimation import from_json, from_toml

    try:
        text = existing_file(Path(path)).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as text") from error
    return from_toml(text, path) if path.lower().endswith(".toml") else from_json(text, path)
