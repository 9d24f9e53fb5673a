"""Pages that the build makes: the help of every command, as the program prints it."""

from __future__ import annotations

import argparse
from typing import Any

_MARK = "<!-- help of every command -->"


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Return a page's text with the mark replaced by every command's help."""
    return markdown.replace(_MARK, _help()) if _MARK in markdown else markdown


def _help() -> str:
    from geounfold.cli.arguments.parser import build_parser

    parser = build_parser()
    chosen = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    parts = [f"```text\n{parser.format_help()}```\n"]
    for name, command in chosen[0].choices.items():
        parts.append(f"## {name}\n\n```text\n{command.format_help(full=True)}```\n")
    return "\n".join(parts)
