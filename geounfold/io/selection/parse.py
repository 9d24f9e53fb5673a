"""The grammar of an expression that chooses rows; nothing of it is evaluated as code.

expression = both { "or" both }
both       = one { "and" one }
one        = "not" one | "(" expression ")" | comparison
comparison = column sign value | value sign column
           | column ["not"] "in" "(" value { "," value } ")" | column "is" ["not"] "missing"
sign       = "=" | "==" | "!=" | "<>" | "<" | "<=" | ">" | ">="
"""

from __future__ import annotations

from geounfold.errors import OptionError
from geounfold.io.selection.conditions import (
    Both,
    Condition,
    Either,
    Equal,
    Missing,
    Not,
    OneOf,
    Order,
    OtherColumn,
    Value,
)
from geounfold.io.selection.tokens import Kind, Token, tokens_of

_EQUAL, _UNEQUAL, _ORDER = ("=", "=="), ("!=", "<>"), ("<", "<=", ">", ">=")
_MIRRORED = {"<": ">", "<=": ">=", ">": "<", ">=": "<="}
_KEYWORDS = ("and", "or", "not", "in", "is")
_DEEPEST = 60  # brackets and nots inside each other; far below Python's own limit


def parse(text: str) -> Condition:
    """Return the condition that an expression states.

    Raises
    ------
    OptionError
        The expression is not well-formed; the message names the place.
    """
    parser = _Parser(text)
    found = parser.expression()
    parser.end()
    return found


class _Parser:
    """Reads tokens from left to right."""

    def __init__(self, text: str) -> None:
        self._text, self._tokens, self._at, self._depth = text, tokens_of(text), 0, 0
        if len(self._tokens) == 1:
            raise OptionError("where: the expression is empty; write one such as ROCK=ORE")

    def expression(self) -> Condition:
        found = [self._both()]
        while self._take_word("or"):
            found.append(self._both())
        return found[0] if len(found) == 1 else Either(tuple(found))

    def end(self) -> None:
        if self._now.kind is not Kind.END:
            raise self._wrong("and, or, or the end")

    @property
    def _now(self) -> Token:
        return self._tokens[self._at]

    def _both(self) -> Condition:
        found = [self._one()]
        while self._take_word("and"):
            found.append(self._one())
        return found[0] if len(found) == 1 else Both(tuple(found))

    def _one(self) -> Condition:
        self._depth += 1
        if self._depth > _DEEPEST:
            raise OptionError(f"where: more than {_DEEPEST} brackets inside each other")
        found: Condition
        if self._take_word("not"):
            found = Not(self._one())
        elif self._take_sign("("):
            found = self.expression()
            if not self._take_sign(")"):
                raise self._wrong("a closing bracket")
        else:
            found = self._comparison()
        self._depth -= 1
        return found

    def _comparison(self) -> Condition:
        left = self._operand("a column")
        if self._now.is_word("in", "not"):
            turned = self._take_word("not")
            if not self._take_word("in"):
                raise self._wrong("in")
            among: Condition = OneOf(left.text, self._list())
            return Not(among) if turned else among
        if self._take_word("is"):
            turned = self._take_word("not")
            if not self._take_word("missing"):
                raise self._wrong("missing")
            return Not(Missing(left.text)) if turned else Missing(left.text)
        if not self._now.is_sign(*_EQUAL, *_UNEQUAL, *_ORDER):
            raise self._wrong("a comparison such as = or in")
        sign = self._step().text
        right = self._operand("a value")
        if self._now.kind in (Kind.WORD, Kind.QUOTED) and not self._now.is_word(*_KEYWORDS):
            raise self._wrong("and, or, or the end; text with blanks needs quotes")
        if self._now.is_sign(*_EQUAL, *_UNEQUAL, *_ORDER):
            raise self._wrong("and, or, or the end; join two comparisons by and")
        if left.number is not None and right.number is None and right.kind is not Kind.QUOTED:
            left, right, sign = right, left, _MIRRORED.get(sign, sign)
        return _compared(left.text, sign, right)

    def _operand(self, what: str) -> Token:
        token = self._now
        if token.kind in (Kind.SIGN, Kind.END) or token.is_word(*_KEYWORDS):
            raise self._wrong(what)
        return self._step()

    def _list(self) -> tuple[Value, ...]:
        if not self._take_sign("("):
            raise self._wrong("an opening bracket, as in (A, B)")
        values = [_value(self._operand("a value"))]
        while self._take_sign(","):
            values.append(_value(self._operand("a value")))
        if not self._take_sign(")"):
            raise self._wrong("a comma or a closing bracket; text with blanks needs quotes")
        return tuple(values)

    def _step(self) -> Token:
        token = self._now
        self._at += 1
        return token

    def _take_word(self, word: str) -> bool:
        return self._now.is_word(word) and bool(self._step())

    def _take_sign(self, sign: str) -> bool:
        return self._now.is_sign(sign) and bool(self._step())

    def _wrong(self, wanted: str) -> OptionError:
        return OptionError(f"where '{self._text}': {wanted} is needed, not {self._now}")


def _value(token: Token) -> Value:
    return Value(token.text, token.number, token.kind is Kind.QUOTED)


def _compared(column: str, sign: str, right: Token) -> Condition:
    """Return the condition of one comparison."""
    other = OtherColumn(right.text) if right.kind is Kind.COLUMN else _value(right)
    if sign in _ORDER:
        return Order(column, sign, other)
    equal = Equal(column, other)
    return equal if sign in _EQUAL else Not(equal)
