"""Exports of mining packages that are read, each with the published page of its layout.

`docs/how-to/exports.md` is the table of these rows; a test makes a file of each row's layout and
reads it. A page was read in autumn 2026; what no public page shows is said so in ``read``.
"""

from __future__ import annotations

from dataclasses import dataclass

MAPTEK = "https://help.maptek.com/vulcan/"
MICROMINE = "https://webhelp.micromine.com/mm/25.5/English/Content/mmfiles/"
DATAMINE = "https://docs.dataminesoftware.com/"
SEEQUENT = "https://help.seequent.com/Energy/2023.2/en-GB/Content/block-models/"


@dataclass(frozen=True)
class Export:
    """One export of a package.

    Attributes
    ----------
    package, export : str
        Names as the package has them.
    read : str
        What geounfold reads of it.
    source : str
        Address of the page, or the book, that publishes the layout; empty if none was found.
    """

    package: str
    export: str
    read: str
    source: str = ""


EXPORTS: tuple[Export, ...] = (
    Export(
        "Vulcan",
        "Model to CSV",
        "centroids, lengths, all variables; rows 2 to 4 (description, type, default) left out",
        f"{MAPTEK}2024.0.0/Content/topics/Block/Transfer/Block_MODELCSV.htm",
    ),
    Export(
        "Vulcan",
        "Export ASCII with header",
        "centroids, lengths, variables, separated by blanks; without header: refused, names needed",
        f"{MAPTEK}2025.3/topics/Block/Transfer/Block_Transfer_ExportASCII.htm",
    ),
    Export(
        "Micromine",
        "Block model, CSV",
        "EAST, NORTH, RL and sides _EAST, _NORTH, _RL; rows of types, origin and rotation left "
        "out; refused unless the block origin is the centre",
        f"{MICROMINE}IDH_EXPORT_BM_CSV.htm",
    ),
    Export(
        "Datamine",
        "Block model, CSV",
        "XC, YC, ZC and XINC, YINC, ZINC",
        f"{DATAMINE}StudioNPVS/Latest/Process_Help_XML/copymod.htm",
    ),
    Export(
        "Datamine",
        "Rotated block model, CSV",
        "turned about z: moved to the world by X0, ANGLE, ROTAXIS, XMORIG; about other axes: "
        "--origin and --rotation asked for; XWORLD, YWORLD, ZWORLD before all",
        f"{DATAMINE}StudioNPVS/Latest/Process_Help_XML/copymod.htm",
    ),
    Export(
        "Datamine",
        "Points of strings or wireframes, CSV",
        "XPT, YPT, ZPT or XP, YP, ZP",
        f"{DATAMINE}StudioUG/Latest/Process_Help_XML/origin.htm",
    ),
    Export(
        "Leapfrog",
        "Block model, CSV with embedded header",
        "X, Y, Z, sides dX, dY, dZ; the definition above (lines with #) skipped",
        f"{SEEQUENT}export-block-models.htm",
    ),
    Export(
        "Leapfrog",
        "Block model, CSV with text header, or as points",
        "X, Y, Z and all columns; the .txt beside it is not needed",
        f"{SEEQUENT}export-block-models.htm",
    ),
    Export(
        "Surpac",
        "String file (.str)",
        "strings with y before x; descriptions d1, d2 ...",
        "https://brentbuffham.github.io/kirra-docs/importing/surpac-dtm-str.html",
    ),
    Export(
        "Surpac",
        "Block model, CSV",
        "columns Y, X, Z by their names, in any order (no public page found)",
    ),
    Export(
        "Deswik",
        "Block model, CSV",
        "x_centre, y_centre, z_centre and similar names (no public page found)",
    ),
    Export(
        "MinePlan, GEMS",
        "Block model, text",
        "EASTING, NORTHING, ELEVATION and similar names (no public page found)",
    ),
    Export(
        "GSLIB, SGeMS",
        "Point set",
        "columns of the header; coordinates by name",
        "http://pangea.stanford.edu/ERE/research/scrf/software/gslib/help/help2.html",
    ),
    Export(
        "GIFtools",
        "XYZ",
        "columns separated by blanks; comments of /, ! and % above skipped",
        "https://giftoolscookbook.readthedocs.io/en/latest/content/fileFormats/XYZfile.html",
    ),
    Export(
        "MassFlow",
        "Mine block file",
        "Easting, Northing, Elevation, tabs or commas; the first line and the third left out",
        "https://docs.itascacg.com/itasca910/template/enginetemplate/doc/manual/template_manual/"
        "template_commands/cmd_massflow.mineblock.import.html",
    ),
    Export(
        "Isatis",
        "ASCII with header",
        "a table below comments (#) if the last of them, or the first row, names the columns "
        "(no public page found)",
    ),
    Export(
        "AutoCAD and all packages",
        "DXF",
        "3DFACE, meshes: a surface; LINE, LWPOLYLINE, POLYLINE: strings; blocks followed",
        "https://ezdxf.readthedocs.io/en/stable/dxfentities/",
    ),
    Export(
        "VTK, ParaView",
        "Legacy .vtk, .vtr, .vts",
        "centres and sides of solid cells, or points",
        "https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html",
    ),
)


def table() -> str:
    """Return the exports as a table in Markdown."""
    rows = ["| package | export | geounfold reads | layout |", "|---|---|---|---|"]
    for e in EXPORTS:
        source = f"[page]({e.source})" if e.source else "-"
        rows.append(f"| {e.package} | {e.export} | {e.read} | {source} |")
    return "\n".join(rows) + "\n"
