# ---
# jupyter:
#   jupytext:
#     notebook_metadata_filter: kernelspec,jupytext,-jupytext.text_representation.jupytext_version
#     text_representation:
#       extension: .py
#       format_name: percent
#       format_version: '1.3'
#   kernelspec:
#     display_name: Python 3 (ipykernel)
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Flatteners compared
#
# This notebook runs every flattener on the same surfaces and puts the figures in one table. The
# exact answer is known for developable surfaces (cylinder, cone). A spherical cap has no exact
# answer, so flatteners differ in how they share its strain. If real fault surfaces and benchmark
# meshes are at hand, they follow.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import Image

import geounfold as gu
from geounfold.geometry.measures import triangle_areas
from geounfold.io import read_surface
from geounfold.report.plots.bodies import draw_surface
from geounfold.report.plots.figures import png

SHARED = Path("../../shared/data")


def grid(nx: int, ny: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the points of a grid (nx * ny, 2) and its triangles, counter-clockwise."""
    i, j = np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij")
    k = i * ny + j
    a, b, c, d = (s.ravel() for s in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    P = np.column_stack([i.ravel(), j.ravel()]).astype(float)
    return P, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


# %% [markdown]
# ## Surfaces
#
# The surfaces are a cylinder of 200 degrees, which overhangs itself as an overturned fold does; a
# third of a cone; a cap of 50 degrees; and a gentle egg-box, which is the shape of refolded layers.

# %%
P, F = grid(41, 21)
s, t = P[:, 0] / 40, P[:, 1] / 20
angle = np.deg2rad(200) * (s - 0.5)
cylinder = np.column_stack([20 * np.sin(angle), 30 * t, 20 * np.cos(angle)])
angle, slant = np.deg2rad(120) * (s - 0.5), 10 + 30 * t
cone = np.column_stack([slant * np.cos(angle), slant * np.sin(angle), 0.8 * slant])
P, G = grid(29, 29)
Q = (P / 28 - 0.5) * 2 * np.deg2rad(50) / np.sqrt(2)
r = np.linalg.norm(Q, axis=1)
cap = 30 * np.column_stack([Q * np.sinc(r / np.pi)[:, None], np.cos(r)])
egg_box = np.column_stack([P, 2 * np.sin(P[:, 0] / 4) * np.sin(P[:, 1] / 4)])
surfaces = {
    "cylinder": (cylinder, F[:, ::-1]),
    "cone": (cone, F),
    "cap": (cap, G),
    "egg box": (egg_box, G),
}
DEVELOPABLE = ("cylinder", "cone")
faults = {
    "Kettleman Hills": "scec_cfm/*Kettleman_Hills*.ts",
    "Red Mountain": "scec_cfm/*Red_Mountain*.ts",
    "Oceanside": "scec_cfm/*Oceanside_detachment_alt1*.ts",
    "hemisphere": "param_bff/hemisphere.obj",
}
for name, pattern in faults.items():
    for path in sorted(SHARED.glob(pattern))[:1]:
        mesh = read_surface(path)
        surfaces[name] = (mesh.V, mesh.F)
    if name not in surfaces:
        print(f"{name}: {SHARED / pattern} is absent, left out")
print({name: len(F) for name, (_, F) in surfaces.items()})

# %% [markdown]
# ## One call
#
# `repair` is on by default: it mends triangles that fold or overlap, and the note says so. If an
# answer were not one-to-one, the table's last column would have the error.

# %%
table = gu.compare(surfaces)
figures = ["edge_strain", "area_error", "symmetric_dirichlet", "flips", "overlaps", "seconds"]
failed = table[table["error"] != ""]
print(failed[["surface", "flattener", "error"]].to_string() if len(failed) else "no failure")
assert (table.loc[table["error"] == "", ["flips", "overlaps"]] == 0).all(axis=None)
table[["surface", "flattener", *figures, "note"]].style.format(precision=5)

# %% [markdown]
# ## Strain
#
# Geostatistics needs correct lengths, because ranges are lengths. The rms strain of edges counts
# every edge alike. A fault surface with eight edges of millimetres among kilometres (Kettleman
# Hills) is then judged by those eight edges. So the strain over area is computed too: the symmetric
# Dirichlet energy is 4 for an isometry, and 4 plus 8 times the mean square of a small principal
# strain.

# %%
shape = {"index": "flattener", "columns": "surface", "sort": False}
edges = table.pivot_table(values="edge_strain", **shape)
energy = table.pivot_table(values="symmetric_dirichlet", **shape)
strain = np.sqrt(np.maximum(energy - 4, 0) / 8)
print("rms strain of edges")
print(edges.to_string(float_format="{:.5f}".format))
print("\nrms principal strain over area")
strain.style.format("{:.5f}").background_gradient(cmap="cividis", axis=0)

# %%
isometric = ["spring", "arap", "slim"]
for name in DEVELOPABLE:
    # A ruled mesh of a developable surface unrolls facet by facet; the solvers' stop rules leave
    # the only strain.
    assert edges.loc[isometric, name].max() < 1e-4, name
for name in strain.columns:
    best = strain.loc[isometric, name].min()
    # The springs are among the best. Kettleman Hills is nearly plane and needs hardly any strain;
    # there the springs leave a thousandth, at its edges of millimetres.
    assert strain.loc["spring", name] < max(2 * best, 1e-3), name
for name in ("cap", "egg box", "hemisphere"):
    if name in strain:
        assert strain.loc[isometric, name].min() > 0.005, (
            name
        )  # curvature makes some strain inevitable
# A cap of 50 degrees keeps sin(0.87) / 0.87 = 0.88 of its rim circle, so strains reach 0.12.
assert 0.005 < edges.loc["spring", "cap"] < 0.06
# These two keep angles at the price of lengths.
for name in ("lscm", "harmonic"):
    assert edges.loc[name, "cap"] > edges.loc["spring", "cap"]

# %%
figure, axes = plt.subplots(1, 2, figsize=(12.5, 4), layout="constrained")
wide = np.arange(len(edges.columns))
marks = "osD^vPX*<>h"
for ax, column, label in zip(
    axes, ("edge_strain", "seconds"), ("edge strain (rms)", "seconds"), strict=True
):
    values = table.pivot_table(index="flattener", columns="surface", values=column, sort=False)
    for k, name in enumerate(values.index):
        shown = np.maximum(values.loc[name, edges.columns], 1e-8)
        ax.plot(wide, shown, marks[k % len(marks)], label=name, color=f"C{k % 10}")
    ax.set_yscale("log")
    ax.set_xticks(wide, edges.columns, rotation=30, ha="right")
    ax.set_ylabel(label)
    ax.grid(alpha=0.3)
axes[1].legend(frameon=False, ncols=2, fontsize=8)
plt.show()

# %% [markdown]
# ## Where the cap is strained
#
# In the springs' answer, edges at the rim are too short when flat, and edges in the middle too
# long.

# %%
V, F = surfaces["cap"]
flat = gu.flatten((V, F), "spring")
level = flat.mesh.with_vertices(np.column_stack([flat.uv, np.zeros(len(flat.uv))]))
area = triangle_areas(level.V, level.F) / triangle_areas(V, flat.mesh.F)
print(f"area, flat over folded: {area.min():.3f} to {area.max():.3f}")
assert area.min() < 1 < area.max()
Image(png(draw_surface(flat.mesh, level, area, "area, flat over folded", colours="RdYlBu_r")))

# %% [markdown]
# ## Why answers are repaired
#
# Without repair, angle-preserving LSCM on a half-cylinder and ARAP on rough surfaces may flip
# triangles or overlap. `repair=False` returns the answer of each method as it is.

# %%
rows = []
for surface, mesh in surfaces.items():
    for name in ("arap", "lscm", "spring", "slim"):
        raw = gu.flatten(mesh, name, repair=False)
        rows.append((surface, name, raw.flips, raw.overlaps))
        assert np.isfinite(raw.uv).all()
for surface, name, flips, overlaps in rows:
    if flips or overlaps:
        print(f"{name} on {surface}: {flips} flipped, {overlaps} overlaps before repair")
print(f"{sum(not (f or o) for *_, f, o in rows)} of {len(rows)} answers are one-to-one unrepaired")
