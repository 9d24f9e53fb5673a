"""What the report's viewer is given: exact to a stated step, small, always the same, harmless."""

from __future__ import annotations

import base64
import json
import re

import numpy as np
import pytest

from geounfold.errors import InputError, MissingDependencyError
from geounfold.geometry.mesh import Floats
from geounfold.quality.neighbour_distances import NEIGHBOURS, neighbours
from geounfold.report import CarriedHoles, CarriedPoints, report_html
from geounfold.report.arrays import quantised, quantised_points
from geounfold.report.blocks import LIMIT, block_shape, chosen_blocks, gradients, outer_blocks
from geounfold.report.body import ReportBody
from geounfold.report.charts import distribution, nice_ticks
from geounfold.report.columns import MOST_CATEGORIES, read_columns
from geounfold.report.html_text import json_for_script
from geounfold.report.payload import GRADIENT_STEP, MOST_POINTS, Payload, payload
from geounfold.report.plots.rendering import block_sides, check_rendering
from geounfold.report.without_folders import without_folders

FORMS = {"u1": "<u1", "u2": "<u2", "i2": "<i2", "u4": "<u4", "f4": "<f4", "f8": "<f8"}


def decoded(packed):
    """Return an array as the page reads it, in the data's unit if it is quantised."""
    codes = np.frombuffer(base64.b64decode(packed["data"]), dtype=FORMS[packed["form"]])
    if np.ndim(packed.get("offset", 0.0)):
        codes = codes.reshape(-1, 3)
    return np.asarray(packed.get("offset", 0.0)) + np.asarray(packed.get("step", 1.0)) * codes


def lattice(*shape: int, step: float = 1.0) -> Floats:
    axes = [step * np.arange(n, dtype=np.float64) for n in shape]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def rolled(points: Floats, radius: float) -> Floats:
    """Return points of a slab rolled up about y: x along the arc, z outward."""
    angle, r = points[:, 0] / radius, radius + points[:, 2]
    return np.column_stack([r * np.sin(angle), points[:, 1], r * np.cos(angle)])


def packed(X: Floats, Y: Floats, columns=None, total: int | None = None, **options) -> Payload:
    ids = neighbours(X) if len(X) > NEIGHBOURS else None
    rows = np.arange(1, len(X) + 1)
    body = ReportBody(X, Y, rows, total or len(X), columns or {}, {}, ids, None)
    return payload(body, **options)


# ------------------------------------------------------------------------------------------ arrays


def test_points_come_back_to_half_a_step_and_levels_exactly():
    rng = np.random.default_rng(1)
    # UTM-like offsets: 65,534 steps over sides of 1,600, 2,000 and 600 m are 0.024, 0.031, 0.009 m.
    X = [5e5, 4e6, -300] + [1600, 2000, 600] * rng.random((4000, 3))
    there = quantised_points(X)
    step = np.array(there["step"])
    np.testing.assert_allclose(step, np.ptp(X, axis=0) / 65534)
    # Half a step of rounding, and what doubles of 4e6 resolve (5e-10).
    assert (np.abs(decoded(there) - X) <= step / 2 + 1e-9).all()
    blocks = lattice(50, 40, 9, step=12.5) + np.array([5e5 + 0.25, 4e6, -7.5])
    # Levels are whole multiples of the step: nothing is lost but doubles' rounding.
    np.testing.assert_allclose(decoded(quantised_points(blocks)), blocks, rtol=0, atol=2e-9)


def test_a_flat_body_is_quantised_all_the_same():
    X = lattice(5, 5, 1)
    np.testing.assert_array_equal(decoded(quantised_points(X)), X)


def test_short_columns_keep_their_blanks():
    v = np.array([1.0, np.nan, 3.0, 2.0])
    back = quantised(v, 1.0, 2.0 / 65534)
    codes = np.frombuffer(base64.b64decode(back["data"]), dtype="<u2")
    assert codes.tolist() == [0, 65535, 65534, 32767]


@pytest.mark.parametrize(
    ("values", "form", "off"),
    [
        ([0.1, 0.25, -3.5], "f4", 2e-7),  # half of float32's 2^-23 of 3.5
        ([4e6 + 0.123, 4e6 + 0.5, 4e6], "f4", 1e-7),  # relative to the lowest
        ([0, 2**24 + 1, 2**31], "f8", 0),  # whole numbers beyond float32's
    ],
)
def test_columns_come_back_in_the_smallest_form_that_holds_them(values, form, off):
    (column,), left = read_columns({"a": values}, 3, "Input")
    there = column.packed(short=False)
    assert there["form"] == form
    assert not left
    np.testing.assert_allclose(decoded(there), values, rtol=0, atol=off)


def test_kinds_of_columns_are_told_apart():
    many = [f"t{i}" for i in range(MOST_CATEGORIES + 1)] * 2
    n = len(many)
    kept, left = read_columns(
        {
            "rock": ["ore", "", "waste"] + ["ore"] * (n - 3),
            "text numbers": ["1", " ", "2.5"] + ["3"] * (n - 3),
            "boolean": [True, False] * (n // 2),
            "one": [7.0] * n,
            "none": [np.nan] * n,
            "infinite": [np.inf, 1.0] * (n // 2),
            "names": many,
            "short": [1.0],
        },
        n,
        "Input",
    )
    assert left == ["names", "short"]
    by = {column.name: column for column in kept}
    assert by["rock"].categories == ("ore", "waste")
    assert by["rock"].values[:4].tolist() == [0, -1, 1, 0]
    np.testing.assert_array_equal(by["text numbers"].values[:3], [1, np.nan, 2.5])
    assert by["one"].packed(short=False)["form"] == "constant"
    assert by["none"].packed(short=False)["kind"] == "empty"
    assert by["infinite"].packed(short=False)["missing"] == n // 2
    assert by["boolean"].values[:2].tolist() == [1.0, 0.0]
    assert by["rock"].packed(short=False)["categories"] == ["ore", "waste"]


def test_limits_of_colour_leave_out_outliers_and_ratios_lie_about_one():
    v = np.r_[np.linspace(0, 1, 999), 1000.0]
    kept, _ = read_columns({"cu": v, "volume_ratio": 1 + v / 1e4}, 1000, "Input", "Results")
    cu, ratio = (column.packed(short=False) for column in kept)
    assert cu["limits"] == np.percentile(v, [1, 99]).tolist()
    assert cu["range"] == [0.0, 1000.0]
    assert ratio["colours"] == "diverging"
    assert sum(ratio["limits"]) == pytest.approx(2.0)  # as far below 1 as above


# ------------------------------------------------------------------------------------------ blocks


def test_outer_blocks_of_a_box_are_its_shell():
    X = lattice(9, 7, 5)
    turn = np.array([[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    for points in (X, 2.5 * X @ turn):
        outer = outer_blocks(points, block_shape(points, {}))
        assert np.count_nonzero(outer) == 9 * 7 * 5 - 7 * 5 * 3  # all but the box within


def test_boxes_follow_a_turned_lattice():
    turn = np.array([[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    X = (lattice(9, 8, 5) * [4.0, 4.0, 2.0]) @ turn  # rows of turn are the lattice's axes
    blocks = packed(X, X + 100.0).content["blocks"]
    np.testing.assert_allclose(blocks["sides"], [4, 4, 2])
    np.testing.assert_allclose(np.reshape(blocks["axes"], (3, 3)), turn.T, atol=1e-9)
    F = decoded(blocks["gradients"]).reshape(-1, 3, 3)  # moved, not bent: the axes themselves
    np.testing.assert_allclose(F, np.broadcast_to(turn.T, F.shape), atol=GRADIENT_STEP)


def test_sub_blocks_have_their_own_sizes_and_hide_each_other():
    # A box of 6 x 6 x 6 units in parents of 2; the parents of one half cut into eight.
    parents = 2 * lattice(3, 3, 3) + 1.0
    cut = parents[:, 0] > 4
    corners = lattice(2, 2, 2) - 0.5
    X = np.vstack([parents[~cut], (parents[cut, None] + corners).reshape(-1, 3)])
    size = np.repeat([2.0, 1.0], [18, 72])
    assert block_shape(X, dict.fromkeys(("dx", "dy", "dz", "xinc", "yinc", "zinc"), size)) is None
    shape = block_shape(X, {"DIM_X": size, "dim_y": size, "dim_z": [str(s) for s in size]})
    np.testing.assert_array_equal(shape.sizes, np.column_stack([size] * 3))
    hidden = X[~outer_blocks(X, shape)]
    # Within: the middle parent, and sub-blocks that no side of the box touches (x of 4 to 5).
    assert np.count_nonzero(~outer_blocks(X, shape)) == 1 + 4 * 4
    assert hidden.min() > 1
    assert hidden.max() < 5
    assert block_shape(X, {"dim_x": size, "dim_y": size, "dim_z": 0 * size}) is None


def test_samples_prefer_the_outside_and_keep_some_inside():
    outer = np.arange(1000) < 300
    rows = chosen_blocks(outer, limit=500)
    assert len(np.unique(rows)) == 500
    assert np.count_nonzero(outer[rows]) == 300
    rows = chosen_blocks(outer, limit=200)
    assert np.count_nonzero(outer[rows]) == 160  # a fifth is kept for slices
    np.testing.assert_array_equal(rows, chosen_blocks(outer, limit=200))


def test_gradients_of_a_linear_map_are_its_matrix():
    X = lattice(6, 5, 4)
    A = np.array([[0.9, 0.3, 0.0], [-0.3, 1.1, 0.2], [0.0, 0.1, 0.8]])
    F = gradients(X, X @ A.T, neighbours(X), np.array([0, 17, 119]))
    # Held to the nearest rotation by a thousandth: at most 1e-3 of |A - R| < 0.4 over the least
    # share of the neighbours' squares along an axis (0.1 at corners).
    np.testing.assert_allclose(F, np.broadcast_to(A, (3, 3, 3)), atol=0.004)


def test_gradients_of_a_sheet_of_one_block_turn_with_it():
    X = lattice(8, 8, 1)
    R = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])  # about y by 90 degrees
    F = gradients(X, X @ R.T, neighbours(X), np.arange(64))
    np.testing.assert_allclose(F, np.broadcast_to(R, (64, 3, 3)), atol=1e-9)


def test_neighbours_that_were_torn_away_do_not_bend_a_block():
    X = lattice(6, 6, 3)
    Y = X.copy()
    Y[X[:, 0] > 2.5, 0] += 50  # a gap of fifty blocks
    F = gradients(X, Y, neighbours(X), np.arange(len(X)))
    np.testing.assert_allclose(F, np.broadcast_to(np.eye(3), F.shape), atol=1e-9)


def test_blocks_are_boxes_where_they_form_a_lattice_and_bent_in_the_other_space():
    flat = lattice(20, 6, 4)
    folded = rolled(flat, 15.0)
    blocks = packed(flat, folded).content["blocks"]
    assert blocks["bent"] == "unfolded"
    assert blocks["sides"] == [1.0, 1.0, 1.0]
    F = decoded(blocks["gradients"]).reshape(-1, 3, 3)
    # Along the arc a block is stretched by (r + z)/r: 1.0 below, 1.2 on top.
    stretch = np.linalg.svd(F, compute_uv=False)
    assert stretch.max() == pytest.approx(1.2, abs=0.05)
    assert packed(folded, flat).content["blocks"]["bent"] == "folded"


# ----------------------------------------------------------------------------------------- payload


def holes_of(X: Floats, count: int) -> CarriedHoles:
    names = np.repeat([f"H{i}" for i in range(count // 50)], 50)
    P = np.resize(X, (len(names), 3)).astype(np.float64)
    flat = P.copy()
    flat[::7] = np.nan
    grades = {f"g{i}": np.linspace(i, i + 1, len(P)) for i in range(12)}
    return CarriedHoles(CarriedPoints(names, P, flat), CarriedPoints(names, P, flat, grades))


def test_fifty_thousand_blocks_with_everything_fit_into_the_page():
    # 54,400 blocks, 60 columns of noise, drill-holes beyond the limit: the most that is held.
    X = lattice(40, 40, 34)
    rng = np.random.default_rng(4)
    columns = {f"c{i}": rng.random(len(X)) for i in range(60)}
    given = packed(X, rolled(X, 100.0), columns, holes=holes_of(X, 3 * MOST_POINTS))
    # 12 MB less 1.5 for the still pictures, which took 0.8 to 1.3 on bodies of 21,600 to 54,400.
    assert len(json_for_script(given.content)) < 10.5e6
    assert given.content["blocks"]["count"] == LIMIT
    said = " ".join(given.notes)
    for expected in ("50,000 of 54,400 blocks", "c36", "1/65,534", "20,000 of 60,000 points"):
        assert expected in said
    assert "c35" not in said
    assert given.content["holes"]["traces"]["count"] <= MOST_POINTS + 2 * 1200  # and holes' ends


@pytest.mark.slow
def test_the_whole_page_stays_below_twelve_megabytes():
    # The same with still pictures; noise in every column is what compresses worst.
    try:
        check_rendering()
    except MissingDependencyError as error:
        pytest.skip(str(error))
    X = lattice(40, 40, 34)
    rng = np.random.default_rng(4)
    names = ("stratigraphic", "nmd_error", "volume_ratio", "shear", *(f"c{i}" for i in range(60)))
    columns = {name: 0.5 + rng.random(len(X)) for name in names}
    holes = holes_of(X, 3 * MOST_POINTS)
    page = report_html({}, X, rolled(X, 100.0), columns, holes=holes)
    assert len(page.encode()) < 12e6


def test_rows_and_places_belong_together():
    corner = np.array([1e5, 2e5, 0])
    X = lattice(40, 40, 34) + corner
    Y = rolled(X - corner, 100.0)
    given = packed(X, Y, {"row": np.arange(1, len(X) + 1)}).content
    rows = decoded(given["blocks"]["rows"]).astype(np.int64)
    (values,) = given["columns"]
    np.testing.assert_array_equal(decoded(values), rows)
    np.testing.assert_allclose(decoded(given["blocks"]["folded"]), X[rows - 1], atol=1e-9)
    step = given["blocks"]["unfolded"]["step"]
    off = np.abs(decoded(given["blocks"]["unfolded"]) - Y[rows - 1])
    assert (off <= 0.5001 * np.array(step)).all()


def test_holes_keep_their_order_names_and_gaps():
    X = lattice(6, 6, 3)
    points = CarriedPoints(
        ["b", "b", "a"], X[:3], np.vstack([X[:2], [[np.nan] * 3]]), {"cu": [1, 2, 3]}
    )
    given = packed(X, X, holes=CarriedHoles(traces=points)).content["holes"]["traces"]
    assert given["names"] == ["b", "a"]
    assert decoded(given["hole"]).tolist() == [0, 0, 1]
    np.testing.assert_allclose(decoded(given["folded"]), X[:3])
    assert np.isnan(decoded(given["unfolded"])[2]).all()


def test_the_same_run_gives_the_same_bytes():
    X = lattice(9, 8, 4)
    one, two = (json_for_script(packed(X, rolled(X, 20.0), {"a": X[:, 0]}).content) for _ in "ab")
    assert one == two


def test_hostile_names_and_texts_cannot_end_the_script():
    X = lattice(4, 4, 3)
    bad = "</script><script>alert(1)</script><!--"
    texts = [bad, "&lt;", "\u2028"] * 16
    given = json_for_script(packed(X, X, {bad: X[:, 0], "texts": texts}).content)
    assert "<" not in given
    assert ">" not in given
    back = json.loads(given)
    assert [column["name"] for column in back["columns"]] == [bad, "texts"]
    assert bad in back["columns"][1]["categories"]


def test_blocks_without_an_image_are_counted():
    X = lattice(4, 4, 3)
    assert packed(X, X, total=50).notes == ("2 blocks without an image are not drawn.",)


# ------------------------------------------------------------------------------- words and pictures


def test_no_folder_survives_wherever_its_file_is_named():
    summary = {
        "command": "geounfold unfold '/home/me/my data/b.csv' --report=/srv/out/r.html -o flat.csv",
        "input": {"file": "/home/me/my data/b.csv"},
        "drillholes": {"files": {"collar": "../holes/c.csv"}},
        "warnings": ["/home/me/my data/b.csv: 3 rows", "../holes/c.csv: hole A"],
    }
    shown = without_folders(summary)
    assert shown["warnings"] == ["b.csv: 3 rows", "c.csv: hole A"]
    assert shown["input"] == {"file": "b.csv"}
    for hidden in ("/home", "/srv", "../holes"):
        assert hidden not in json.dumps(shown)
    assert without_folders({"command": "it's broken"}) == {"command": "it's broken"}


@pytest.mark.parametrize(
    ("low", "high", "ticks"),
    [
        (0.0, 1.0, [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]),
        (-1.5, 1.2, [-1.0, 0.0, 1.0]),
        (0.98, 1.02, [0.98, 0.99, 1.0, 1.01, 1.02]),
        (3.0, 3.0, [3.0]),
    ],
)
def test_ticks_are_round_numbers_within(low, high, ticks):
    assert nice_ticks(low, high) == ticks


def test_charts_say_in_words_what_they_show():
    v = np.arange(1, 1001) / 1000
    page = distribution(v, "a < b")
    assert page.count("<svg") == 3
    assert "a &lt; b" in page
    # Quantiles of 0.001 ... 1: linear between ranks, 0.5005, 0.9001, 0.95005.
    assert "50% at or below 0.5005, 90% at or below 0.9001" in page
    assert "1,000 blocks from 0.001 to 1" in page
    assert "NaN" not in distribution(np.full(9, 2.5), "alike")
    assert "from 0.99999912 to 1.0000008" in distribution(np.array([0.99999912, 1.0000008]), "x")
    with pytest.raises(InputError, match="x: needs finite values"):
        distribution(np.array([np.nan]), "x")


def test_no_label_of_an_axis_leaves_the_picture():
    page = distribution(np.linspace(0.0, 0.0005 / 0.99, 1000), "x")
    labels = re.findall(r'<text x="([0-9.]+)" y="220" class="mid">([^<]+)</text>', page)
    assert labels[5][1] == "0.0005"  # at the very end: the limit is the 99th percentile
    assert all(float(x) + 3.5 * len(name) <= 400 for x, name in labels)


def test_sides_follow_the_space_that_is_drawn_as_boxes():
    flat = lattice(20, 6, 4)
    folded = rolled(flat, 15.0)
    given = packed(folded, flat).content["blocks"]
    assert given["sides"] == block_sides(flat).tolist()
