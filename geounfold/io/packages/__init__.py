"""What each mining package writes: names of columns, rows above the data, frames, with sources.

`exports` lists the exports that are read, each with the published page that describes it. `names`
has the names of columns, `definition_rows` the rows that stand above the data, `datamine` the
frame of a rotated Datamine model.
"""
