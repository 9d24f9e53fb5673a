"""The help: short enough to read, complete with --help-all, its examples valid."""

from __future__ import annotations

import argparse
import shlex

import pytest

from geounfold.cli import main
from geounfold.cli.arguments.help import Parser
from geounfold.cli.arguments.parser import GREEDY, build_parser
from geounfold.errors import OptionError

TOP = build_parser()
COMMANDS: dict[str, Parser] = next(
    a.choices for a in TOP._actions if isinstance(a, argparse._SubParsersAction)
)


def _help(capsys: pytest.CaptureFixture[str], *argv: str) -> str:
    assert main(argv) == 0
    out, err = capsys.readouterr()
    assert err == ""
    return out


def test_alone_it_prints_the_commands_one_line_each(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    out = _help(capsys)
    assert out == _help(capsys, "--help")
    section = out.partition("commands:\n")[2].partition("\n\n")[0]
    lines = [line.split(maxsplit=1) for line in section.splitlines()]
    assert [name for name, _ in lines] == list(COMMANDS)
    assert all(text.strip() for _, text in lines)


@pytest.mark.parametrize("command", COMMANDS)
def test_the_short_help_fits_a_terminal(
    command: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    lines = _help(capsys, command, "--help").splitlines()
    assert len(lines) <= 60
    assert max(map(len, lines)) <= 80
    examples = lines[lines.index("examples:") + 1 :]
    assert sum(line.startswith("  geounfold ") for line in examples) >= 2
    full = _help(capsys, command, "--help-all").splitlines()
    assert max(map(len, full)) <= 80
    assert len(full) >= len(lines)


@pytest.mark.parametrize("command", COMMANDS)
def test_the_full_help_has_every_option(command: str) -> None:
    parser = COMMANDS[command]
    full = parser.format_help(full=True)
    for action in parser._actions:
        for flag in action.option_strings:
            assert flag.replace("--no-", "--[no-]") in full or f"--[no-]{flag[2:]}" in full


def test_rare_options_are_in_the_full_help_only(capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("unfold", "compare", "crosscheck"):
        short = _help(capsys, command, "--help")
        full = _help(capsys, command, "--help-all")
        assert "--hull" not in short
        assert "--hull H" in full


@pytest.mark.parametrize("command", COMMANDS)
def test_the_examples_are_valid(command: str) -> None:
    for example in COMMANDS[command].examples:
        program, *words = shlex.split(example.replace("\\\n", " "), comments=True)
        assert program == "geounfold"
        if ">" in words:
            words = words[: words.index(">")]
        build_parser(holes="--holes" in words and words[0] == "map").parse_args(words)


def test_an_unknown_option_is_one_line() -> None:
    with pytest.raises(OptionError, match=r"--frobnicate \(see 'geounfold --help'\)"):
        TOP.parse_args(["view", "p.csv", "-o", "p.png", "--frobnicate"])


def test_every_option_that_may_take_a_file_meant_as_points_is_known() -> None:
    open_ended = {
        flag
        for command in COMMANDS.values()
        for action in command._actions
        for flag in action.option_strings
        if action.nargs in ("+", "*", "?")
    }
    assert open_ended == set(GREEDY)
