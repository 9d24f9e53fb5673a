"""The words and signs of an expression that chooses rows."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum

from geounfold.errors import OptionError

MOST_CHARACTERS = 10_000
"""Longest expression that is read; one of 40 comparisons has about 1,000 characters."""

_SIGNS = ("==", "!=", "<>", "<=", ">=", "=", "<", ">", "(", ")", ",")
_QUOTES = "'\"`"
_BARE = re.compile(r"[^\s()=!<>,'\"`]+")
_FOREIGN = {"&": "and", "&&": "and", "|": "or", "||": "or", "~": "not", "!": "not", "^": "not"}
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")


class Kind(Enum):
    """Kinds of tokens."""

    SIGN = "sign"
    WORD = "word"
    QUOTED = "quoted text"
    COLUMN = "column in backticks"
    END = "end"


@dataclass(frozen=True)
class Token:
    """A word or a sign.

    Attributes
    ----------
    kind : Kind
    text : str
        Without its quotes.
    place : int
        Its first character, from 1.
    """

    kind: Kind
    text: str
    place: int

    def is_word(self, *words: str) -> bool:
        """Return whether this is one of some bare words, in any letter case."""
        return self.kind is Kind.WORD and self.text.casefold() in words

    def is_sign(self, *signs: str) -> bool:
        """Return whether this is one of some signs."""
        return self.kind is Kind.SIGN and self.text in signs

    @property
    def number(self) -> float | None:
        """The number that a bare word is; None for other tokens."""
        if self.kind is Kind.WORD and _NUMBER.fullmatch(self.text):
            return float(self.text)
        return None

    def __str__(self) -> str:
        if self.kind is Kind.END:
            return "the end"
        return f"'{self.text}' at character {self.place}"


def tokens_of(text: str) -> list[Token]:
    """Return the tokens of an expression, an END behind them.

    Raises
    ------
    OptionError
        A quote is not closed, a sign is unknown, or the text is too long.

    Examples
    --------
    >>> [t.text for t in tokens_of("`ORE ZONE`='A 1'")]
    ['ORE ZONE', '=', 'A 1', '']
    """
    if len(text) > MOST_CHARACTERS:
        raise OptionError(
            f"where: the expression has {len(text)} characters; {MOST_CHARACTERS} are the most"
        )
    found: list[Token] = []
    at = 0
    while at < len(text):
        if text[at].isspace():
            at += 1
            continue
        sign = next((s for s in _SIGNS if text.startswith(s, at)), None)
        if sign is not None:
            found.append(Token(Kind.SIGN, sign, at + 1))
            at += len(sign)
        elif text[at] in _QUOTES:
            inner, end = _quoted(text, at)
            kind = Kind.COLUMN if text[at] == "`" else Kind.QUOTED
            found.append(Token(kind, inner, at + 1))
            at = end
        else:
            bare = _BARE.match(text, at)
            word = text[at] if bare is None else bare.group()
            if word in _FOREIGN:
                raise OptionError(
                    f"where '{text}': write {_FOREIGN[word]}, not {word} (character {at + 1})"
                )
            found.append(Token(Kind.WORD, word, at + 1))
            at += len(word)
    return [*found, Token(Kind.END, "", len(text) + 1)]


def _quoted(text: str, start: int) -> tuple[str, int]:
    """Return the text in quotes, in which a doubled quote is one, and where it ends."""
    sign, at, parts = text[start], start + 1, []
    while True:
        end = text.find(sign, at)
        if end < 0:
            raise OptionError(
                f"where '{text}': the quote {sign} at character {start + 1} is not closed"
            )
        parts.append(text[at:end])
        if not text.startswith(sign, end + 1):
            return sign.join(parts), end + 1
        at = end + 2
