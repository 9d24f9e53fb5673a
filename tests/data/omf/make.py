"""Projects of both versions of the library ``omf``, for the tests and for the files beside them.

Run by a Python that has one of them, this writes what that one can::

    python tests/data/omf/make.py tests/data/omf
"""

from __future__ import annotations

import datetime
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np

# National-grid coordinates in feet, as single precision cannot hold them.
XYZ = np.array([[2296021.09, 414095.85, 1 / 3], [2296031.1, 414095.8, 1590.1], [2296021.0, 4e5, 0]])
TURNED = {"axis_u": [0.0, 1.0, 0.0], "axis_v": [-1.0, 0.0, 0.0], "axis_w": [0.0, 0.0, 1.0]}
TENSORS = {
    "tensor_u": np.array([10.0, 20.0]),
    "tensor_v": np.full(3, 5.0),
    "tensor_w": np.array([1.0, 2.0, 1.0, 1.0]),
}


def version1(omf: Any) -> dict[str, Any]:
    """Return one project by ``omf`` 1: points, a surface and a volume."""

    def data(kind: Any, name: str, array: Any, **more: Any) -> Any:
        return kind(name=name, location="vertices", array=array, **more)

    words = omf.Legend(values=omf.StringArray(array=["low", "high"]))
    colours = omf.Legend(values=omf.ColorArray(array=[[1, 2, 3], [4, 5, 6]]))
    holes = omf.PointSetElement(
        name="holes",
        geometry=omf.PointSetGeometry(vertices=XYZ, origin=[0.0, 0.0, 7.0]),
        data=[
            data(omf.ScalarData, "au", np.array([1.0, np.nan, 3.0])),
            data(omf.ScalarData, "n", np.array([1, -2, 2**40])),
            data(omf.StringData, "rock", ["a", "é", ""]),
            data(omf.MappedData, "class", np.array([1, 0, -1]), legends=[colours, words]),
            data(omf.Vector3Data, "dip", np.arange(9.0).reshape(3, 3)),
            data(omf.ColorData, "paint", [[1, 2, 3]] * 3),
            data(omf.DateTimeData, "day", [datetime.datetime(2020, 1, k) for k in (1, 2, 3)]),
        ],
    )
    top = omf.SurfaceElement(
        name="top",
        geometry=omf.SurfaceGeometry(vertices=XYZ, triangles=np.array([[0, 1, 2]])),
    )
    cells = omf.ScalarData(name="au", location="cells", array=np.arange(24.0))
    geometry = omf.VolumeGridGeometry(**TENSORS, **TURNED, origin=[100.0, 200.0, 0.0])
    blocks = omf.VolumeElement(name="blocks", geometry=geometry, data=[cells])

    def project(*elements: Any) -> Any:
        return omf.Project(
            name="p", units="feet", origin=[100.0, 0.0, 0.0], elements=list(elements)
        )

    return {"version1": project(holes, top), "version1_volume": project(blocks)}


def prerelease(omf: Any) -> dict[str, Any]:
    """Return projects by ``omf`` 2.0.0a0, by name: points with a surface, and block models."""

    def numbers(name: str, location: str, array: Any) -> Any:
        return omf.NumericAttribute(name=name, location=location, array=np.asarray(array))

    legend = omf.CategoryColormap(indices=[10, 20], values=["low", "high"])
    holes = omf.PointSet(
        name="holes",
        vertices=XYZ,
        attributes=[
            numbers("au", "vertices", [1.0, np.nan, 3.0]),
            numbers("n", "vertices", [1, -2, 2**40]),
            numbers("assayed", "vertices", [True, False, True]),
            omf.VectorAttribute(
                name="dip", location="vertices", array=np.arange(9.0).reshape(3, 3)
            ),
            omf.StringAttribute(name="rock", location="vertices", array=["a", "é", ""]),
            omf.CategoryAttribute(
                name="class", location="vertices", array=np.array([20, 10, -1]), categories=legend
            ),
        ],
    )
    top = omf.Surface(name="top", vertices=XYZ, triangles=np.array([[0, 1, 2]]))
    tensor = omf.TensorGridBlockModel(**TENSORS, **TURNED, corner=[100.0, 200.0, 0.0])
    tensor.attributes = [numbers("au", "cells", np.arange(24.0))]
    # Of 2 x 2 x 2 blocks, the one at (1, 1, 0) is not there.
    regular = omf.RegularBlockModel(block_count=[2, 2, 2], block_size=[10.0, 5.0, 2.0])
    regular.cbc = np.array([1, 1, 1, 0, 1, 1, 1, 1])
    regular.attributes = [numbers("au", "cells", np.arange(7.0))]
    parents = {"parent_block_count": [3, 1, 1], "parent_block_size": [10.0, 10.0, 4.0]}
    # The first block is whole, the second not there, the third in 2 x 2 x 1 parts.
    divided = omf.RegularSubBlockModel(sub_block_count=[2, 2, 1], **parents)
    divided.cbc = np.array([1, 0, 4])
    divided.attributes = [
        numbers("au", "sub_blocks", np.arange(5.0)), numbers("zone", "parent_blocks", [7, 8])
    ]  # fmt: skip
    # The first block in 8, the fourth of which (1, 1, 0) in 8 again; the second whole.
    octree = omf.OctreeSubBlockModel(
        parent_block_count=[1, 1, 2], parent_block_size=[16.0, 32.0, 64.0]
    )
    octree.reset_cbc()
    octree.reset_zoc()
    octree.refine(0)
    octree.refine(3)
    octree.attributes = [numbers("au", "sub_blocks", np.arange(16.0))]
    free = omf.ArbitrarySubBlockModel(**parents)
    free.cbc = np.array([1, 0, 2])
    free.sub_block_corners = np.array([[0, 0, 0], [0, 0, 0], [0.25, 0, 0]])
    free.sub_block_sizes = np.array([[1, 1, 1], [0.25, 1, 1], [0.75, 1, 1]])
    free.attributes = [numbers("au", "sub_blocks", np.arange(3.0))]

    def project(*elements: Any) -> Any:
        made = omf.Project(name="p", elements=list(elements))
        made.metadata = {"coordinate_reference_system": "EPSG:26711", "units": "feet"}
        return made

    return {
        "prerelease": project(omf.Composite(name="all", elements=[holes, top])),
        "prerelease_tensor": project(tensor),
        "prerelease_regular": project(regular),
        "prerelease_divided": project(divided),
        "prerelease_octree": project(octree),
        "prerelease_free": project(free),
    }


def is_first(omf: Any) -> bool:
    """Return whether the library is of version 1."""
    return hasattr(omf, "OMFWriter")


def write(folder: Path) -> list[str]:
    """Write the projects that the installed library can, and return their names."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        import omf

        projects = version1(omf) if is_first(omf) else prerelease(omf)
        for name, project in projects.items():
            if is_first(omf):
                omf.OMFWriter(project, str(folder / f"{name}.omf"))
            else:
                omf.save(project, str(folder / f"{name}.omf"), mode="w")
    return list(projects)


if __name__ == "__main__":
    print("\n".join(write(Path(sys.argv[1]))))  # noqa: T201
