"""Text of an expression into steps, each of which uses earlier ones; nothing is executed."""

import re
from typing import NamedTuple, NoReturn

from ..errors import ParameterError
from .operations import FUNCTIONS

LONGEST = 2**16
"""Characters of an expression."""

DEPTH = 64
"""Parentheses, powers of powers and signs within each other."""

_TOKEN = re.compile(
    r"(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[^\W\d](?:[\w.]|\[[0-9\s,:]*\])*)"
    r"|(?P<sign>[-+*/^(),])"
)
_GAP = re.compile(r"\s*")
_STRENGTH = {"+": 10, "-": 10, "*": 20, "/": 20, "^": 40}
_UNARY = 30  # -2^2 is -(2^2), -2*3 is (-2)*3
_HINTS = {"**": "write a power as a^b", "=": "an expression only computes, it sets nothing"}


class Step(NamedTuple):
    """A number, a name, or an operation on what earlier steps found.

    `what` is "number", "name" or one of `OPERATIONS`; `column` counts from 1 in the text.
    """

    what: str
    of: tuple[int, ...]
    number: float
    name: str
    column: int


class _Token(NamedTuple):
    kind: str
    text: str
    column: int


def steps(text: str) -> tuple[Step, ...]:
    """The steps of an expression; the last one is its value."""
    if len(text) > LONGEST:
        raise ParameterError(
            f"an expression of {len(text)} characters, expected at most {LONGEST}; split it"
        )
    parser = _Parser(text)
    parser.phrase(0, 0)
    token = parser.token
    if token.kind != "end":
        known = ", ".join(FUNCTIONS)
        hint = f"; functions are {known}" if token.text == "(" else ""
        refuse(text, token.column, f"expected an operator or the end, found {token.text!r}{hint}")
    return tuple(parser.steps)


def refuse(text: str, column: int, reason: str) -> NoReturn:
    """Raise an error about a place in an expression, which is shown around it."""
    start, end = max(column - 31, 0), column + 29
    shown = "..." * (start > 0) + text[start:end] + "..." * (end < len(text))
    raise ParameterError(f"column {column} of {shown!r}: {reason}") from None


class _Parser:
    """Climbs by the strength of operators, and appends a step for each thing it has read."""

    def __init__(self, text: str):
        self.text = text
        self.place = 0
        self.steps: list[Step] = []
        self.token = _Token("", "", 1)
        self._advance()

    def phrase(self, strength: int, depth: int) -> int:
        """Read as far as operators bind more strongly than `strength`; the number of the step."""
        if depth > DEPTH:
            refuse(self.text, self.token.column, f"nested more than {DEPTH} deep; split it")
        left = self._operand(depth)
        while (token := self.token).text in _STRENGTH and _STRENGTH[token.text] > strength:
            self._advance()
            own = _STRENGTH[token.text]
            right = self.phrase(own - 1 if token.text == "^" else own, depth + 1)
            left = self._append(token.text, (left, right), token.column)
        return left

    def _operand(self, depth: int) -> int:
        token = self.token
        self._advance()
        if token.kind == "number":
            value = float(token.text)
            if value == float("inf"):
                refuse(self.text, token.column, f"{token.text} is too large for a number")
            return self._append("number", (), token.column, value)
        if token.kind == "name":
            if self.token.text == "(":
                return self._call(token, depth)
            return self._append("name", (), token.column, name=re.sub(r"\s", "", token.text))
        if token.text == "(":
            inner = self.phrase(0, depth + 1)
            self._expect(")", token)
            return inner
        if token.text in ("+", "-"):
            inner = self.phrase(_UNARY, depth + 1)
            return inner if token.text == "+" else self._append("neg", (inner,), token.column)
        found = "the end" if token.kind == "end" else repr(token.text)
        hint = f"; {_HINTS['**']}" if token.text == "*" else ""
        refuse(
            self.text,
            token.column,
            f"expected a number, a name or a parenthesis, found {found}{hint}",
        )

    def _call(self, name: _Token, depth: int) -> int:
        if name.text not in FUNCTIONS:
            known = ", ".join(FUNCTIONS)
            refuse(self.text, name.column, f"no function {name.text!r}; known are {known}")
        opening = self.token
        self._advance()
        of = [self.phrase(0, depth + 1)]
        while self.token.text == ",":
            self._advance()
            of.append(self.phrase(0, depth + 1))
        self._expect(")", opening)
        least, most = FUNCTIONS[name.text]
        if not least <= len(of) <= most:
            need = "one value" if most == 1 else f"at least {least} values"
            refuse(self.text, name.column, f"{name.text} takes {need}, got {len(of)}")
        return self._append(name.text, tuple(of), name.column)

    def _expect(self, text: str, opening: _Token) -> None:
        if self.token.text != text:
            found = "the end" if self.token.kind == "end" else repr(self.token.text)
            refuse(
                self.text,
                self.token.column,
                f"expected {text!r} for the '(' in column {opening.column}, found {found}",
            )
        self._advance()

    def _append(
        self, what: str, of: tuple[int, ...], column: int, number: float = 0.0, name: str = ""
    ) -> int:
        self.steps.append(Step(what, of, number, name, column))
        return len(self.steps) - 1

    def _advance(self) -> None:
        gap = _GAP.match(self.text, self.place)
        self.place = gap.end() if gap else self.place
        column = self.place + 1
        found = _TOKEN.match(self.text, self.place)
        if found is not None:
            self.token = _Token(found.lastgroup or "", found[0], column)
            self.place = found.end()
        elif self.place == len(self.text):
            self.token = _Token("end", "", column)
        else:
            letter = self.text[self.place]
            hint = f"; {_HINTS[letter]}" if letter in _HINTS else ""
            refuse(self.text, column, f"{letter!r} has no meaning in an expression{hint}")
