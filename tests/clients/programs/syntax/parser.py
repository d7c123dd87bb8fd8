"""What the parsers of the four languages share: expressions, lists of statements, and what comes of a text.

Expressions and statements are tuples, the same for all languages, so that one interpreter runs them (machine.py).
"""

import re
from dataclasses import dataclass, field
from typing import Any, ClassVar

from tests.clients.programs.syntax.tokens import Token

Node = tuple[Any, ...]


@dataclass
class Routine:
    """A procedure, function, trap, thread or function block. variables: name -> (type, initial value or None, class)."""

    name: str
    kind: str
    result: str = ""
    parameters: list[tuple[str, str, str]] = field(default_factory=list)  # name, type, direction
    variables: dict[str, tuple[Any, Node | None, str]] = field(default_factory=dict)
    body: list[Node] = field(default_factory=list)
    handler: list[Node] = field(default_factory=list)


@dataclass
class Unit:
    """A whole source. types: name -> {member: (type, initial)}."""

    routines: dict[str, Routine] = field(default_factory=dict)
    variables: dict[str, tuple[Any, Node | None, str]] = field(default_factory=dict)
    types: dict[str, dict[str, Any]] = field(default_factory=dict)
    unions: set[str] = field(default_factory=set)
    body: list[Node] = field(default_factory=list)


class Parser:
    """Words one after the other, and expressions by precedence."""

    BINARY: ClassVar[dict[str, int]] = {}
    UNARY: ClassVar[dict[str, int]] = {}
    EQUAL = "="

    def __init__(self, tokens: list[Token]) -> None:
        self.tokens, self.k = tokens, 0
        self.unit = Unit()

    @property
    def word(self) -> str:
        return self.tokens[self.k].text

    def key(self) -> str:
        return self.word.upper()

    def fail(self, wanted: str) -> SyntaxError:
        return SyntaxError(f"line {self.tokens[self.k].line}: {self.word!r}, wanted {wanted}")

    def next(self) -> Token:
        self.k += 1
        return self.tokens[self.k - 1]

    def take(self, word: str) -> Token:
        if self.key() != word.upper():
            raise self.fail(word)
        return self.next()

    def maybe(self, *words: str) -> str:
        if self.key() in words and self.tokens[self.k].kind != "string":
            return self.next().text.upper()
        return ""

    def name(self) -> str:
        if self.tokens[self.k].kind != "name":
            raise self.fail("a name")
        return self.next().text

    def block(self, *ends: str) -> list[Node]:
        body = []
        while self.key() not in ends:
            if self.tokens[self.k].kind == "end":
                raise self.fail(" or ".join(ends))
            body.append(self.statement())
        return body

    def statement(self) -> Node:
        raise NotImplementedError

    def expression(self, least: int = 0) -> Node:
        left = self.prefix()
        while (power := self.BINARY.get(self.key(), 0)) > least and self.tokens[self.k].kind != "string":
            operator = self.next().text.upper()
            left = ("binary", operator, left, self.expression(power))
        return left

    def prefix(self) -> Node:
        token = self.tokens[self.k]
        if token.text == "-":
            self.next()
            return ("unary", "-", self.expression(90))
        if token.text.upper() == "NOT":
            self.next()
            return ("unary", "NOT", self.expression(self.UNARY["NOT"]))
        if token.kind == "number":
            return ("value", number(self.next().text))
        if token.kind == "string" and not self.is_quoted_name(token):
            return ("value", self.next().text[1:-1])
        if token.text == "(":
            self.next()
            inside = self.expression()
            self.take(")")
            return self.postfix(inside)
        if token.text in ("[", "{"):
            return ("list", self.listed(self.next().text))
        if token.text.upper() in ("TRUE", "FALSE"):
            return ("value", self.next().text.upper() == "TRUE")
        return self.postfix(("name", self.name(), token.line))

    def is_quoted_name(self, token: Token) -> bool:
        return False

    def listed(self, opening: str) -> list[Node]:
        closing = {"[": "]", "(": ")", "{": "}"}[opening]
        items: list[Node] = []
        while self.word != closing:
            items.append(self.argument())
            if self.word != closing:
                self.take(",")
        self.take(closing)
        return items

    def argument(self) -> Node:
        return self.expression()

    def postfix(self, node: Node) -> Node:
        while True:
            if self.word in ("[", "{"):
                opening = self.next().text
                node = ("index", node, self.listed(opening))
            elif self.word == "(" and node[0] in ("name", "field"):
                self.next()
                node = ("call", node, self.listed("("))
            elif self.word == ".":
                self.next()
                token = self.next()
                node = ("bit", node, "X", int(token.text)) if token.kind == "number" else ("field", node, token.text)
            elif self.word.startswith(".%"):
                text = self.next().text
                node = ("bit", node, text[2], int(text[3:]))
            else:
                return node


def number(text: str) -> float | int:
    if text.startswith("16#"):
        return int(text[3:].replace("_", ""), 16)
    if text.startswith("T#"):
        return float(text[2:].upper().rstrip("MS")) * (0.001 if text.upper().endswith("MS") else 1.0)
    return float(text) if re.search(r"[.E]", text) else int(text)
