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
# # Unfolding `sim_case_1`, stage by stage
#
# `sim_case_1` is a simulated ore body: one open anticline of 60 x 60 x 6 blocks of 10 m, with limbs
# that dip 30 degrees. It was laid out flat first (the truth W) and then folded by flexural slip
# (X), so every answer (Y) can be checked. A comment beside each asserted number gives its source:
# the body's own geometry, the thesis, or the prototype of the method.

# %%
import tempfile
from pathlib import Path

import numpy as np
from IPython.display import Image

import geounfold as gu
from geounfold.flattening import measures
from geounfold.geometry.measures import enclosed_volume
from geounfold.quality.truth import compare_with_truth
from geounfold.report.plots.bodies import (
    draw_bodies,
    draw_body,
    draw_control,
    draw_split,
    draw_surface,
)
from geounfold.report.plots.figures import draw_curves, draw_distribution, png, ratio_limits

body = gu.simulate("sim_case_1")
X, W = body
print(body.description, X.shape, sep="\n")
Image(png(draw_body(X, body.stratigraphic, "true stratigraphic coordinate", bands=6)))

# %% [markdown]
# ## One call
#
# Every option has its default: density hull, signed split, spring flattener, sheet method.

# %%
u = gu.unfold(X)
Y = u.points
u

# %% [markdown]
# ## Frame and lattice
#
# The stages work in units of one block, turned to the body's principal axes. This body was gridded
# *before* folding, so its folded centroids lie on no lattice, and the unit is the typical spacing
# of neighbours instead. The frame is an invertible similarity, so no information is lost.

# %%
print("lattice:", u.lattice)
print(f"one working unit: {u.frame.scale:.2f} m")
assert u.lattice is None
there_and_back = u.frame.to_world(u.frame.to_work(X))
assert np.abs(there_and_back - X).max() < 1e-9  # rounding of coordinates of 10^3 m: 10^-13

# %% [markdown]
# ## Hull and split
#
# The hull is closed and manifold. The signed graph Laplacian then separates top and bottom; it uses
# no direction as "up". The faces that belong to neither are the edge of the sheet, the rim.

# %%
hull, split = u.hull, u.fits[0].split
volume = enclosed_volume(u.hull_mesh.V, u.hull_mesh.F)
print(f"{hull.method}: {len(hull.mesh.F):,} faces; {hull.reason}")
print(f"enclosed volume {volume:,.0f} m3, true volume of the blocks {600 * 600 * 60:,} m3")
print(f"median thickness {split.median_thickness * u.frame.scale:.1f} m, true thickness 60 m")
# The hull rounds the rim, by less than one block in six: between 0.9 and 1 of the true volume.
assert 0.9 < volume / (600 * 600 * 60) < 1
assert abs(split.median_thickness * u.frame.scale - 60) < 2  # a fifth of a block
Image(png(draw_split(u.hull_mesh, split.side, split.rim)))

# %% [markdown]
# ## Medial points and mid surface
#
# A medial point lies half-way along each ray from the top to the bottom. Medial points are noisy
# and end before the rim. A smooth spline surface is fitted to them and continued to the rim.

# %%
medial = u.fits[0].sheet.medial
points = u.frame.to_world(medial.mesh.V)
thickness = 2 * medial.half * u.frame.scale
print(f"{len(points):,} medial points, {medial.trusted.mean():.0%} of them trusted")
Image(png(draw_body(points, thickness, "thickness at the medial points, m", limits=(55.0, 65.0))))

# %%
mid = u.surfaces["mid"]
strain = measures.edge_strain(mid.folded.V, mid.folded.F, mid.unfolded.V[:, :2])
print(f"mid surface: {len(mid.folded.F):,} faces, edge strain {strain:.6f} (root mean square)")
assert strain < 1e-3  # a cylinder is developable: the rest is chords instead of arcs
assert np.abs(mid.unfolded.V[:, 2]).max() < 1e-9  # datum: the mid surface lies at 0
Image(png(draw_surface(mid.folded, mid.unfolded, mid.folded.V[:, 2], "height when folded, m")))

# %% [markdown]
# ## Flattening by springs
#
# The flattener flattens the mid surface and two surfaces parallel to it, one above and one below,
# each on its own. Rigid motions then register the three. The upper one reaches further than the
# lower: the difference is the slip of the layers. Local-global steps bring the energy of Wang's
# spring-mass model to its minimum.

# %%
flattenings = u.fits[0].flattenings
for name, flat in flattenings.items():
    print(
        f"{name:7} {flat.stop} after {flat.iterations} steps, energy {flat.energy[0]:.3g} to "
        f"{flat.energy[-1]:.3g}, edge strain {flat.edge_error[-1]:.2g}, flips {flat.flips}"
    )
    assert flat.stop == "converged"
    assert flat.flips == 0
    # The thesis's springs begin at 0.0785 and stop at 0.0729 (on the thesis's own hull).
    assert flat.edge_error[-1] < 0.001
energies = {name: flat.energy for name, flat in flattenings.items()}
Image(png(draw_curves(energies, "step", "spring energy", logarithmic=True)))

# %%
top, bottom = u.top, u.bottom
gap = top.unfolded.V[:, 2].mean() - bottom.unfolded.V[:, 2].mean()
print(f"true thickness 60 m, mean distance of unfolded top and bottom {gap:.1f} m")
assert abs(gap - 60) < 1.5  # the thesis's own code gives 102 m for a body of 90 m
Image(png(draw_surface(top.folded, top.unfolded, top.unfolded.V[:, 2], "unfolded height, m")))

# %% [markdown]
# ## Control mesh
#
# The control mesh is made of prisms along the normals of the mid surface, cut into tetrahedra: the
# same tetrahedra in both spaces. The mesh reaches past the blocks, so every block lies inside.

# %%
control = u.control
print(f"{len(control.folded.V):,} vertices, {len(control.folded.T):,} tetrahedra")
print(f"volume {u.quality.volume_folded:,.0f} folded, {u.quality.volume_unfolded:,.0f} unfolded")
assert control.inverted_folded == control.inverted_unfolded == 0
assert abs(u.quality.volume_unfolded / u.quality.volume_folded - 1) < 1e-3  # slip keeps volume
Image(png(draw_control(control)))

# %% [markdown]
# ## Mapped points
#
# Barycentric coordinates carry every block. The inverse brings it back up to rounding.

# %%
print(f"outside {u.outside_share:.2%}, round trip at most {u.round_trip_max:.1e} m")
assert u.outside_share == 0
assert u.round_trip_max < 1e-4  # 1e-5 of a block is required; rounding leaves 1e-12 m
layers = u.stratigraphic
Image(png(draw_bodies(X, Y, layers, "stratigraphic coordinate", limits=(0.0, 1.0), bands=6)))

# %% [markdown]
# ## Distance from the truth
#
# The thesis's measure, epsilon, compares each block's mean distance to its 26 neighbours (NMD) in
# two sets of points. It is nearly blind to folds: the folded body itself scores 0.0172, better than
# the 0.0259 of the thesis's own code (its alpha shape mended), although that code does unfold. So
# this cell also prints the distance from the truth after the best rigid motion.

# %%
quality = compare_with_truth(X, Y, W)
nothing = quality.epsilon_nothing.mean
print(f"epsilon(W, Y): mean {quality.epsilon_truth.mean:.5f}, 95 % {quality.epsilon_truth.p95:.5f}")
print(f"epsilon(W, X): mean {nothing:.4f}, the folded body itself")
print(f"epsilon(X, Y): mean {quality.epsilon_folded.mean:.4f}; the thesis prints 0.0257")
print(f"RMS from the truth {quality.rms:.3f} m; of the folded body {quality.rms_nothing:.1f} m")
print("spacing along x, y, z over the true one:", *(f"{ratio:.5f}" for ratio in quality.spacing))
assert quality.epsilon_truth.mean < 0.0003  # the prototype reached 0.0002
assert quality.epsilon_truth.p95 < 0.001
assert abs(nothing - 0.0172) < 0.0002  # of the body itself, whatever the method
assert quality.rms < 0.15  # 0.015 of a block; the prototype reached 0.009
assert quality.rms_nothing > 30  # which epsilon does not show
assert np.abs(np.array(quality.spacing) - 1).max() < 0.001
Image(png(draw_distribution(gu.epsilon(W, Y), "epsilon(W, Y)")))

# %% [markdown]
# The pictures have the NMD in both spaces, with the neighbours of the folded body. Blocks at the
# rim have neighbours on one side only, so their distances are larger.

# %%
ids = gu.neighbours(X)
pair = (gu.nmd(X, ids), gu.nmd(Y, ids))
Image(png(draw_bodies(X, Y, pair, "neighbour mean distance, m", colours="cividis")))

# %%
error = u.columns["nmd_error"]
Image(png(draw_bodies(X, Y, error, "epsilon(X, Y)", colours="cividis")))

# %% [markdown]
# ## Distortion
#
# Flexural slip keeps volumes and thickness; layers slide over one another by their change of
# heading in radians. The heading is 30 cos(pi x / 600) degrees, so the shear is 30 degrees times
# 2/pi on average: 0.333.

# %%
ratio, shear = u.columns["volume_ratio"], u.columns["shear"]
expected = np.deg2rad(30) * 2 / np.pi
print(f"volume ratio {ratio.min():.4f} to {ratio.max():.4f}")
print(f"shear {shear.mean():.4f} on average, {expected:.4f} expected")
assert np.abs(ratio - 1).max() < 0.005  # tetrahedra as chords of the curved prisms
assert abs(shear.mean() / expected - 1) < 0.02
look = {"colours": "RdYlBu_r", "limits": ratio_limits(ratio)}
Image(png(draw_bodies(X, Y, ratio, "volume ratio", **look)))

# %%
Image(png(draw_bodies(X, Y, shear, "layer-parallel shear", colours="cividis")))

# %% [markdown]
# ## Saving and loading the map
#
# The file holds the control mesh, not the points. The loaded map carries any other points: here
# the mid-points between blocks and their nearest neighbours, to the flat space and back.

# %%
with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "map.npz"
    u.save(path)
    print(f"{path.stat().st_size / 1024:.0f} KiB")
    loaded = gu.load(path)
samples = ((X + X[ids[:, 0]]) / 2)[::7]
flat = loaded.to_flat(samples)
assert np.array_equal(flat, u.to_flat(samples))  # to the last bit
assert np.abs(loaded.to_folded(flat) - samples).max() < 1e-4

# %% [markdown]
# ## Summary
#
# `geounfold unfold --summary` writes this dict.

# %%
summary = u.summary()
{key: summary[key] for key in ("hull", "control_mesh", "nmd", "outside_share", "warnings")}
