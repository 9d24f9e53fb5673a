"""The command line: ``geounfold COMMAND ...``.

``entry`` runs a command. ``arguments`` parses its words, ``inputs`` reads files and options,
``commands`` has one module for each command, ``answers`` makes what it writes and prints,
``terminal`` shows messages and progress, ``process`` handles signals and crashes.
"""

from geounfold.cli.entry import main

__all__ = ["main"]
