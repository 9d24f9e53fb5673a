"""Texts that the full help of several commands shares; lines of 79 characters at most."""

from __future__ import annotations

TABLES = ".csv, .csv.gz or .parquet"

POINTS = ".csv, .parquet or another format"

POINT_FORMATS = """\
formats of points:
  .csv .csv.gz .parquet; .txt .asc .tsv .dat .xyz .prn (and .gz) read only
  GSLIB .gslib .geoeas .dat .gs (text becomes codes)
  VTK .vtu .vtp; .vti .vtr .vts .vtk read only; of solid cells the centres
  Surpac .str and lines of .dxf read only: their vertices
  GOCAD .vs (text becomes codes); .ts read only
  OMF .omf and .geoh5; of block models the centroids, dx, dy, dz and i, j, k"""

FORMATS = f"""\
{POINT_FORMATS}
formats of surfaces:
  .ply .obj .off .stl (single precision) .vtp .omf .geoh5 .dxf (faces),
  GOCAD .ts, or a table with columns x, y, z, v1, v2, v3
geoh5, DXF, and OMF to be written, need: pip install 'geounfold[formats]'"""

RESULTS = """\
results:
  unfolded_x, unfolded_y, unfolded_z
                   coordinates without the folds, in the input's unit; z is up
                   towards the top side, in true thickness
  stratigraphic    0 at the bottom surface, 1 at the top
  location         inside the control mesh, extrapolated around it, or outside
                   the map's reach: no result
  mesh_distance    distance from the control mesh, 0 inside it"""

KEPT_ROWS = """\
OUT has every column and row of POINTS, in order. A result replaces a column of
the same name in its place."""

WHERE = """\
choosing rows, with --where EXPR:
  comparisons  COLUMN = VALUE, != (or <>), <, <=, >, >=
               COLUMN in (A, B), COLUMN not in (A, B)
               COLUMN is missing, COLUMN is not missing
  joined by    and, or, not, brackets; and binds before or
  Left of a sign stands a column, right of it a value: a number, a word, or
  text in quotes. Names of columns with blanks are in quotes or backticks;
  backticks right of a sign name a column too. Columns are found in any letter
  case; text is compared exactly, numbers as numbers. A missing value equals
  nothing; != is the opposite of =. Nothing is evaluated as code.
  Rows that are not chosen have the location "not selected"."""

ANGLES = """\
turned block models:
  bearing is the compass direction of the model's own y axis (0: not turned),
  plunge its inclination below the horizontal, and dip the angle by which the x
  axis turns downwards about it, in degrees. With --origin, OUT has world_x,
  world_y and world_z too; commands read these before other coordinates."""

LIMITS = """\
limits of the model, with --limits L ...:
  L is a surface file, a box X0,X1,Y0,Y1,Z0,Z1 (empty where the model goes on)
  or a .csv polygon of x and y. The rim there is a cut, no pinch-out. A limit
  passes within half a block of the blocks' faces; the closing lines and the
  summary tell what share of the rim each takes."""

HOLES = """\
drill-holes:
  --samples-out has hole, from, to; x, y, z of the midpoint of each interval or
  composite; position (surveyed, or extrapolated straight on below the last
  survey); coverage of composites; the grades; and the results. --traces-out
  has hole, depth, x, y, z, position and the results along every hole. As .vtp
  it holds lines in the folded space and the point array unfolded. Messages and
  the summary name the rows that cannot be used."""


def joined(*texts: str) -> str:
    """Return texts with an empty line between each two."""
    return "\n\n".join(texts)
