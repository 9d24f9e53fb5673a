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
# # Cross-check of meshes
#
# geounfold's control mesh is made of prisms along the normals of the mid surface, and what happens
# inside it follows from them. This notebook asks two meshers that know nothing of prisms, fTetWild
# and, where it is installed, TetGen, to fill the same border. Our map lays the border flat; the
# inside follows by a rule of its own: each flat coordinate harmonic over the folded shape, or the
# whole as rigid as possible (ARAP). Then the blocks are carried by the other mesh, and compared.
#
# The body has limbs of 70 degrees and a hinge whose radius is not much larger than the layer is
# thick: a hard case for such rules, and one with a truth.

# %%
import numpy as np
from IPython.display import Image

import geounfold as gu
from geounfold.geometry.tet_shapes import dihedral_angles, radius_ratios
from geounfold.report.plots.bodies import draw_bodies
from geounfold.report.plots.crosscheck import draw_cuts, draw_histograms
from geounfold.report.plots.figures import png
from geounfold.synthetic import CASES

body = gu.simulate("steep", blocks=6000)
X, W = body
u = gu.unfold(X)
check = gu.crosscheck(u)
u

# %% [markdown]
# ## Volumes and borders
#
# The sum of the tetrahedra's signed volumes against the exact volume inside the border (divergence
# theorem). The prisms and TetGen keep the border; fTetWild may move it by its envelope, a tenth of
# a block. Distances between the borders are in blocks, both ways.

# %%
table = check.table
meshes = table.drop_duplicates("mesh").set_index("mesh")
meshes[["tetrahedra", "volume", "volume_difference", "hausdorff_to", "hausdorff_from", "seconds"]]

# %%
assert (meshes.error == "").all()
assert (meshes.volume_difference.abs() < 0.01).all()  # the project's bound; measured 0.0001
assert abs(meshes.volume_difference["prism"]) < 1e-12  # rounding
assert meshes[["hausdorff_to", "hausdorff_from"]].to_numpy().max() < 0.5  # measured 0.09
assert (meshes.inverted == 0).all()

# %% [markdown]
# ## Elements
#
# Prisms are all alike, none of them flat; fTetWild optimises for regular tetrahedra; TetGen, held
# to the border's triangles, leaves some slivers.

# %%
grids = check.grids
quality = {
    "dihedral angle, degrees": {n: dihedral_angles(g.V, g.T) for n, g in grids.items()},
    "radius ratio": {n: radius_ratios(g.V, g.T) for n, g in grids.items()},
}
Image(png(draw_histograms(quality)))

# %%
middle = float(np.median(X[:, 1]))
Image(png(draw_cuts(dict(grids), 1, middle)))

# %% [markdown]
# ## Where the blocks come to lie
#
# `rms`, `p95` and `max` are distances from where our map places a block, in blocks.
# `rms_same_interior` is what is left when the control mesh itself is given the same rule for its
# inside: the part that is due to the mesh.

# %%
figures = ["mesh", "interior", "rms", "p95", "max", "along_layers", "across_layers"]
table[[*figures, "rms_same_interior", "outside", "inverted_unfolded"]].round(3)

# %%
others = table[table.mesh != "prism"]
assert (others.outside == 0).all()
assert (others.rms_same_interior < 0.1).all()  # measured 0.02 to 0.04: meshes hardly matter

# %% [markdown]
# Meshes agree within a few hundredths of a block. The rules do not agree with flexural slip, and
# on this body by more than a quarter of a block: that is no fault of a mesh, since the control mesh
# shows the same. Where a layer between the radii $r_1$ and $r_2$ is bent, its true height is
# $r - r_1$, and the harmonic one
#
# $$ (r_2 - r_1) \, \frac{\ln (r / r_1)}{\ln (r_2 / r_1)}, $$
#
# higher by about $t^2 / 8R$ in the middle of a layer of thickness $t$ and mean radius $R$. Blocks
# lie too far out on the convex side, at the hinges, and by nothing on straight limbs.

# %%
name = "tetwild_harmonic"
apart = check.differences[name]
Image(png(draw_bodies(X, u.points, apart, f"{name}: difference, blocks", colours="cividis")))

# %% [markdown]
# Predicted against found: the formula, for the control mesh's thickness and the body's tightest
# hinge, is the most that heights can differ. The hinge is that tight at one place only.

# %%
s = np.linspace(0, CASES["steep"].length, 2001)
radius = 1 / np.abs(CASES["steep"].profile.curvature(s)).max()
thickness = np.ptp(u.control.unfolded.V[:, 2])
r1, r2 = radius - thickness / 2, radius + thickness / 2
r = np.linspace(r1, r2, 2001)
bound = (thickness * np.log(r / r1) / np.log(r2 / r1) - (r - r1)).max()
change = np.abs(check.points["prism_harmonic"][:, 2] - u.points[:, 2]).max()
print(f"hinge of radius {radius:.0f} m, control mesh {thickness:.0f} m thick")
print(f"heights differ by at most {bound:.1f} m as predicted, {change:.1f} m as found")
assert bound / 2 < change < bound  # measured two thirds of it

# %% [markdown]
# ## Which one is right
#
# The truth decides: root mean square distance from W after the best rigid motion, in blocks.

# %%
ours = gu.aligned_rms(u.points, W) / check.block
by_rule = {key: gu.aligned_rms(Y, W) / check.block for key, Y in check.points.items()}
print(f"our map {ours:.3f}", *(f"{key} {rms:.3f}" for key, rms in by_rule.items()), sep="\n")

# %%
assert ours < 0.12  # the prototype reaches 0.084 on the larger body of this kind
assert min(by_rule.values()) > 1.5 * ours  # measured 1.9 (arap) to 2.5 (harmonic) times
check.warnings
