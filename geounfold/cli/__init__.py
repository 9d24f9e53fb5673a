"""The command line: ``geounfold COMMAND ...``."""

from geounfold.cli.entry import main

__all__ = ["main"]
