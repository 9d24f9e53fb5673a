"""The parser of a command: a short help, a full help, and errors of one line."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from geounfold.errors import OptionError, nearest

_UNKNOWN = re.compile(r"unrecognized arguments: .*?(--[\w-]+)|COMMAND: invalid choice: '([^']*)'")

EXIT_STATUS = "exit status: 0 done, 2 wrong input or option, 1 other failure, 130 interrupted"


class Parser(argparse.ArgumentParser):
    """A parser with a short and a full help; its errors are OptionError, without usage text.

    Parameters
    ----------
    details : str, optional
        Text that only the full help has: columns of the results, file formats.
    examples : sequence of str, optional
        Command lines that end the help; a long one has line breaks behind backslashes.
    settings
        Those of `argparse.ArgumentParser`.
    """

    def __init__(self, *, details: str = "", examples: Sequence[str] = (), **settings: Any) -> None:
        super().__init__(add_help=False, allow_abbrev=False, formatter_class=_Formatter, **settings)
        self.examples = tuple(examples)
        self._details = details
        self._sections: list[Section] = []
        self._commands: Any = None

    def section(self, title: str) -> Section:
        """Return a new section of options, below those that are there."""
        self._sections.append(Section(title, self.add_argument_group(title)))
        return self._sections[-1]

    def commands(self) -> Any:
        """Return what commands are added to, with ``add_parser``."""
        self._commands = self.add_subparsers(dest="command", metavar="COMMAND", required=True)
        return self._commands

    def format_help(self, *, full: bool = False) -> str:
        """Return the help: usage, options, exit status, examples; with `full` rare options too."""
        formatter = self._get_formatter()
        formatter.add_usage(self.usage or self._short_usage(), (), ())
        formatter.add_text(self.description)
        shown = [(section.title, section.actions(full=full)) for section in self._sections]
        if self._commands is not None:
            shown.insert(0, ("commands", list(self._commands._get_subactions())))
        for title, actions in shown:
            formatter.start_section(title)
            formatter.add_arguments(actions)
            formatter.end_section()
        if full:
            formatter.add_text(self._details)
        formatter.add_text(EXIT_STATUS)
        if self.examples:
            lines = [line for example in self.examples for line in example.splitlines()]
            formatter.add_text("\n  ".join(["examples:", *lines]))
        return formatter.format_help()

    def print_help(self, file: Any = None, *, full: bool = False) -> None:
        """Print the help on stdout, or into a file."""
        self._print_message(self.format_help(full=full), file or sys.stdout)

    def error(self, message: str) -> NoReturn:
        """Raise OptionError; an unknown flag or command gets the nearest valid one."""
        unknown = _UNKNOWN.search(message)
        if unknown is not None:
            flag, command = unknown.groups()
            valid = (
                self._flags() if flag else list(self._commands.choices if self._commands else ())
            )
            near = self._owners(flag) if flag in valid else nearest(flag or command, valid)
            message = f"{message.partition(' (choose')[0]}{near}"
        raise OptionError(f"{message} (see '{self.prog} --help')")

    def _owners(self, flag: str) -> str:
        """Return which commands have a flag that the command given has not."""
        commands = self._commands.choices if self._commands else {}
        names = [
            n for n, p in commands.items() if any(flag in a.option_strings for a in p._actions)
        ]
        return f" ({flag} is an option of {', '.join(names)})"

    def _flags(self) -> list[str]:
        """Return the long flags of this parser and of its commands."""
        parsers = [self, *(self._commands.choices.values() if self._commands else ())]
        return [f for p in parsers for a in p._actions for f in a.option_strings if f[:2] == "--"]

    def _short_usage(self) -> str:
        """Return the usage with what is needed; "[options]" replaces the others."""
        words = ["%(prog)s"]
        for action in self._actions:
            if not action.option_strings:
                words.append(f"{action.metavar}" if action.required else f"[{action.metavar}]")
            elif action.required:
                words += [action.option_strings[0], f"{action.metavar}"]
        return " ".join([*words, "[options]"])


class Section:
    """Options under one heading of a help.

    Parameters
    ----------
    title : str
        The heading.
    group : argparse group
        Where the options are added.
    """

    def __init__(self, title: str, group: Any) -> None:
        self.title = title
        self._group = group
        self._actions: list[tuple[argparse.Action, bool]] = []

    def add(self, *names: str, rare: bool = False, **settings: Any) -> None:
        """Add an argument.

        Parameters
        ----------
        names : str
            The flags, or the name of a positional argument.
        rare : bool, optional
            Only the full help shows it.
        settings
            Those of argparse's ``add_argument``.
        """
        self._actions.append((self._group.add_argument(*names, **settings), rare))

    def actions(self, *, full: bool) -> list[argparse.Action]:
        """Return the arguments that the help shows."""
        return [action for action, rare in self._actions if full or not rare]


class HelpAll(argparse.Action):
    """Print the full help and leave."""

    def __init__(self, option_strings: Sequence[str], dest: str, **settings: Any) -> None:
        super().__init__(option_strings, argparse.SUPPRESS, nargs=0, **settings)

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        """Print and leave."""
        assert isinstance(parser, Parser)
        parser.print_help(full=True)
        parser.exit()


class _Formatter(argparse.RawDescriptionHelpFormatter):
    """Short option names beside their help: "-o, --output OUT", "--[no-]name"."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, max_help_position=27)

    def _format_action_invocation(self, action: argparse.Action) -> str:
        if isinstance(action, argparse.BooleanOptionalAction):
            return f"--[no-]{action.option_strings[0][2:]}"
        if not action.option_strings or action.nargs == 0:
            return super()._format_action_invocation(action)
        values = self._format_args(action, action.dest.upper())
        return f"{', '.join(action.option_strings)} {values}"
