"""Parsers of the parts of RAPID, SCL, Structured Text and URScript that the generated clients use.

Small and strict: what is not known here is a SyntaxError with its line. Expressions and statements are tuples, the same for all
four languages, so that one interpreter runs them (machine.py). Grammars: ABB "RAPID Kernel" 3HAC050946, chapter 1
to 6; Siemens "STEP 7 Programming Guideline"/SCL; IEC 61131-3 (3rd edition) part 7.3; "The URScript Programming Language".
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any, ClassVar

Node = tuple[Any, ...]

TOKENS = re.compile(
    r"""(?P<space>[ \t]+)|(?P<newline>\n)|(?P<comment>{comment})
    |(?P<number>(?:16\#[0-9A-F_]+|T\#[0-9]+(?:ms|s|MS|S)|[0-9]+(?:\.[0-9]+)?(?:E[+-]?[0-9]+)?))
    |(?P<string>{string})
    |(?P<name>{name})
    |(?P<op>:=|=>|<>|<=|>=|==|!=|\.\.|\.%[WX][0-9]+|[-+*/%=<>()\[\]{{}},;:.\\])""",
    re.X,
)


@dataclass(frozen=True)
class Token:
    kind: str
    text: str
    line: int


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


def pattern_of(comment: str, string: str, name: str) -> re.Pattern[str]:
    return re.compile(TOKENS.pattern.format(comment=comment, string=string, name=name), re.X | re.S)


def tokenize(text: str, pattern: re.Pattern[str], *, newlines: bool = False) -> list[Token]:
    tokens, place, line = [], 0, 1
    while place < len(text):
        found = pattern.match(text, place)
        if not found:
            raise SyntaxError(f"line {line}: {text[place : place + 30]!r} is no word of this language")
        kind, word = str(found.lastgroup), found.group()
        if kind == "newline" and newlines:
            tokens.append(Token("op", "\n", line))
        elif kind not in ("space", "comment", "newline"):
            tokens.append(Token(kind, word, line))
        line += word.count("\n")
        place = found.end()
    return [*tokens, Token("end", "", line)]


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


class Iec(Parser):
    """Structured Text, and SCL as TIA Portal exports it."""

    BINARY: ClassVar[dict[str, int]] = {
        **dict.fromkeys(["OR"], 10),
        "XOR": 20,
        "AND": 30,
        **dict.fromkeys(["=", "<>"], 40),
        **dict.fromkeys(["<", ">", "<=", ">="], 50),
        **dict.fromkeys(["+", "-"], 60),
        **dict.fromkeys(["*", "/", "MOD"], 70),
    }
    UNARY: ClassVar[dict[str, int]] = {"NOT": 80}
    SECTIONS = ("VAR", "VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT", "VAR_TEMP")

    def is_quoted_name(self, token: Token) -> bool:
        return token.text.startswith('"')

    def name(self) -> str:
        token = self.tokens[self.k]
        if token.kind == "string" and token.text.startswith('"'):
            return self.next().text
        return super().name()

    def source(self) -> Unit:
        while (kind := self.maybe("TYPE", "DATA_BLOCK", "FUNCTION", "FUNCTION_BLOCK")) or self.tokens[
            self.k
        ].kind != "end":
            if kind == "TYPE":
                self.structure()
            elif kind == "DATA_BLOCK":
                self.data_block()
            elif kind:
                self.pou(kind)
            else:
                raise self.fail("TYPE, DATA_BLOCK, FUNCTION or FUNCTION_BLOCK")
        return self.unit

    def attributes(self) -> None:
        if self.word == "{":
            while self.next().text != "}":
                pass
        if self.maybe("VERSION"):
            self.take(":")
            self.next()
        self.maybe("NON_RETAIN")

    def structure(self) -> None:
        name = self.name()
        if self.word == ":":
            self.next()
        self.attributes()
        kind = self.maybe("STRUCT", "UNION")
        if kind == "UNION":
            self.unit.unions.add(name)
        members: dict[str, Any] = {}
        while not self.maybe("END_STRUCT", "END_UNION"):
            member, kind_of, initial = self.declaration()
            members[member] = (kind_of, initial)
        if self.word == ";":
            self.next()
        self.take("END_TYPE")
        self.unit.types[name] = members

    def declaration(self) -> tuple[str, Any, Node | None]:
        name = self.name()
        self.take(":")
        kind = self.type_of()
        initial = None
        if self.word == ":=":
            self.next()
            initial = self.expression()
        self.take(";")
        return name, kind, initial

    def type_of(self) -> Any:
        if self.maybe("ARRAY"):
            self.take("[")
            first = self.next().text
            self.take("..")
            last = self.next().text
            self.take("]")
            self.take("OF")
            return ("array", int(first), int(last), self.type_of())
        name = self.name()
        if self.word == ".":
            self.next()
            name += "." + self.name()
        if self.word in ("(", "["):  # the length of a string
            self.listed(self.next().text)
        return name

    def data_block(self) -> None:
        name = self.name()
        self.attributes()
        if self.maybe("VAR"):
            members = {}
            while not self.maybe("END_VAR"):
                member, kind, initial = self.declaration()
                members[member] = (kind, initial)
            self.unit.types[name] = members
            self.unit.variables[name] = (name, None, "DB")
        else:
            self.unit.variables[name] = (self.name(), None, "DB")
        self.take("BEGIN")
        self.take("END_DATA_BLOCK")

    def pou(self, kind: str) -> None:
        routine = Routine(self.name(), kind)
        if self.word == ":":
            self.next()
            routine.result = str(self.type_of())
        self.attributes()
        while section := self.maybe(*self.SECTIONS):
            section += " CONSTANT" if self.maybe("CONSTANT") else ""
            while not self.maybe("END_VAR"):
                name, kind_of, initial = self.declaration()
                if name.upper() in (known.upper() for known in routine.variables):
                    raise SyntaxError(f"{routine.name}: {name} is declared twice (case does not count)")
                routine.variables[name] = (kind_of, initial, section)
                if section in ("VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT"):
                    routine.parameters.append((name, str(kind_of), section))
        self.maybe("BEGIN")
        routine.body = self.block(f"END_{kind}")
        self.next()
        self.unit.routines[routine.name] = routine

    def argument(self) -> Node:
        after = self.tokens[self.k + 1].text
        if after in (":=", "=>"):
            name = self.name()
            self.next()
            return ("named", name, self.expression(), after)
        return self.expression()

    def end(self, word: str) -> None:
        self.take(word)
        if self.word == ";":
            self.next()

    def statement(self) -> Node:
        line = self.tokens[self.k].line
        if self.maybe("REGION"):
            while self.tokens[self.k].line == line:
                self.next()
            body = self.block("END_REGION")
            self.take("END_REGION")
            return ("block", body)
        if self.maybe("IF"):
            return self.if_statement()
        if self.maybe("CASE"):
            return self.case_statement()
        if self.maybe("FOR"):
            variable = self.postfix(("name", self.name(), line))
            self.take(":=")
            first = self.expression()
            self.take("TO")
            last = self.expression()
            self.take("DO")
            body = self.block("END_FOR")
            self.end("END_FOR")
            return ("for", variable, first, last, body)
        if self.maybe("RETURN"):
            self.take(";")
            return ("return", None)
        target = self.postfix(("name", self.name(), line))
        if self.word == ":=":
            self.next()
            target = ("assign", target, self.expression())
        elif target[0] != "call":
            raise self.fail(":=")
        self.take(";")
        return target

    def if_statement(self) -> Node:
        branches, otherwise = [], []
        while True:
            condition = self.expression()
            self.take("THEN")
            branches.append((condition, self.block("ELSIF", "ELSE", "END_IF")))
            if not self.maybe("ELSIF"):
                break
        if self.maybe("ELSE"):
            otherwise = self.block("END_IF")
        self.end("END_IF")
        return ("if", branches, otherwise)

    def case_statement(self) -> Node:
        value, branches, otherwise = self.expression(), [], []
        self.take("OF")
        while self.key() not in ("ELSE", "END_CASE"):
            label = self.expression()
            self.take(":")
            body = []
            while self.key() not in ("ELSE", "END_CASE") and not self.at_label():
                body.append(self.statement())
            branches.append(([label], body))
        if self.maybe("ELSE"):
            otherwise = self.block("END_CASE")
        self.end("END_CASE")
        return ("case", value, branches, otherwise)

    def at_label(self) -> bool:
        return self.tokens[self.k + 1].text == ":" and self.tokens[self.k].kind in ("number", "name")


class Rapid(Parser):
    BINARY: ClassVar[dict[str, int]] = {
        **dict.fromkeys(["OR", "XOR"], 10),
        "AND": 20,
        **dict.fromkeys(["=", "<>", "<", ">", "<=", ">="], 30),
        **dict.fromkeys(["+", "-"], 40),
        **dict.fromkeys(["*", "/", "DIV", "MOD"], 50),
    }
    UNARY: ClassVar[dict[str, int]] = {"NOT": 15}  # of all that AND joins behind it
    KINDS = ("PROC", "FUNC", "TRAP")

    def expression(self, least: int = 0) -> Node:
        if least and self.word.upper() == "NOT":
            raise self.fail("brackets around NOT behind an operator")
        return super().expression(least)

    def module(self) -> Unit:
        self.take("MODULE")
        self.name()
        while not self.maybe("ENDMODULE"):
            scope = self.maybe("LOCAL")
            if kind := self.maybe("CONST", "VAR", "PERS"):
                if self.unit.routines:
                    raise self.fail("no declaration behind the first routine")
                self.data(kind, self.unit.variables)
            elif kind := self.maybe(*self.KINDS):
                self.routine(kind, scope)
            else:
                raise self.fail("a declaration or a routine")
        return self.unit

    def data(self, storage: str, into: dict[str, tuple[Any, Node | None, str]]) -> None:
        kind, name, initial = self.name(), self.name(), None
        size: Any = kind
        if self.word == "{":
            self.next()
            size = ("array", 1, self.listed("{")[0], kind)
        if self.word == ":=":
            self.next()
            initial = self.expression()
        self.take(";")
        if name.upper() in (known.upper() for known in into):
            raise SyntaxError(f"{name} is declared twice")
        into[name] = (size, initial, storage)

    def routine(self, kind: str, scope: str) -> None:
        result = self.name() if kind == "FUNC" else ""
        routine = Routine(self.name(), kind, result)
        if kind != "TRAP":
            self.take("(")
            while self.word != ")":
                direction = self.maybe("VAR", "PERS", "INOUT") or "IN"
                type_of, name = self.name(), self.name()
                if self.word == "{":
                    self.next()
                    self.take("*")
                    self.take("}")
                routine.parameters.append((name, type_of, direction))
                if self.word != ")":
                    self.take(",")
            self.next()
        while storage := self.maybe("VAR", "CONST", "PERS"):
            self.data(storage, routine.variables)
        routine.body = self.block(f"END{kind}", "ERROR")
        if self.maybe("ERROR"):
            routine.handler = self.block(f"END{kind}")
        self.next()
        self.unit.routines[routine.name] = routine

    def statement(self) -> Node:
        line = self.tokens[self.k].line
        if self.maybe("IF"):
            return self.if_statement()
        if self.maybe("TEST"):
            return self.parse_test()
        if self.maybe("FOR"):
            variable = ("name", self.name(), line)
            self.take("FROM")
            first = self.expression()
            self.take("TO")
            last = self.expression()
            self.take("DO")
            body = self.block("ENDFOR")
            self.take("ENDFOR")
            return ("for", variable, first, last, body)
        if self.maybe("WHILE"):
            condition = self.expression()
            self.take("DO")
            body = self.block("ENDWHILE")
            self.take("ENDWHILE")
            return ("while", condition, body)
        if kind := self.maybe("RETURN", "RAISE"):
            value = None if self.word == ";" else self.expression()
            self.take(";")
            return (kind.lower(), value)
        if self.maybe("CONNECT"):
            interrupt = ("name", self.name(), line)
            self.take("WITH")
            trap = ("name", self.name(), line)
            self.take(";")
            return ("call", ("name", "CONNECT", line), [interrupt, ("value", trap[1])])
        target = self.place(("name", self.name(), line))
        if self.word == ":=":
            self.next()
            target = ("assign", target, self.expression())
        else:
            target = ("call", target, self.arguments())
        self.take(";")
        return target

    def place(self, node: Node) -> Node:
        if self.word == "{":
            self.next()
            return ("index", node, self.listed("{"))
        return node

    def arguments(self) -> list[Node]:
        """Those of a procedure call: commas between them, but none is needed before a switch or an optional one."""
        items: list[Node] = []
        while self.word != ";":
            if self.word == "\\":
                self.next()
                name = self.name()
                value: Node = ("value", True)
                if self.word == ":=":
                    self.next()
                    value = self.expression()
                items.append(("named", name, value, ":="))
            else:
                items.append(self.expression())
            if self.word == ",":
                self.next()
            elif self.word not in (";", "\\"):
                raise self.fail(", or ;")
        return items

    def if_statement(self) -> Node:
        condition = self.expression()
        if self.key() != "THEN":
            return ("if", [(condition, [self.statement()])], [])
        branches, otherwise = [], []
        self.take("THEN")
        branches.append((condition, self.block("ELSEIF", "ELSE", "ENDIF")))
        while self.maybe("ELSEIF"):
            condition = self.expression()
            self.take("THEN")
            branches.append((condition, self.block("ELSEIF", "ELSE", "ENDIF")))
        if self.maybe("ELSE"):
            otherwise = self.block("ENDIF")
        self.take("ENDIF")
        return ("if", branches, otherwise)

    def parse_test(self) -> Node:
        value, branches, otherwise = self.expression(), [], []
        while self.maybe("CASE"):
            labels = [self.expression()]
            while self.word == ",":
                self.next()
                labels.append(self.expression())
            self.take(":")
            branches.append((labels, self.block("CASE", "DEFAULT", "ENDTEST")))
        if self.maybe("DEFAULT"):
            self.take(":")
            otherwise = self.block("ENDTEST")
        self.take("ENDTEST")
        return ("case", value, branches, otherwise)


class UrScript(Parser):
    BINARY: ClassVar[dict[str, int]] = {
        "OR": 10,
        "AND": 20,
        **dict.fromkeys(["==", "!=", "<", ">", "<=", ">="], 30),
        **dict.fromkeys(["+", "-"], 40),
        **dict.fromkeys(["*", "/"], 50),  # no remainder: the script manual has none
    }
    UNARY: ClassVar[dict[str, int]] = {"NOT": 25}
    EQUAL = "=="

    def script(self) -> Unit:
        while self.tokens[self.k].kind != "end":
            if self.word == "\n":
                self.next()
            elif kind := self.maybe("DEF", "THREAD"):
                self.routine(kind)
            else:
                self.unit.body.append(self.statement())
        return self.unit

    def routine(self, kind: str) -> None:
        routine = Routine(self.name(), kind)
        self.take("(")
        while self.word != ")":
            routine.parameters.append((self.name(), "", "IN"))
            if self.word != ")":
                self.take(",")
        self.take(")")
        self.take(":")
        self.take("\n")
        routine.body = self.block("END")
        self.end()
        self.unit.routines[routine.name] = routine

    def end(self) -> None:
        self.take("END")
        if self.tokens[self.k].kind != "end":
            self.take("\n")

    def block(self, *ends: str) -> list[Node]:
        body = []
        while self.key() not in ends:
            if self.word == "\n":
                self.next()
            elif self.tokens[self.k].kind == "end":
                raise self.fail(" or ".join(ends))
            else:
                body.append(self.statement())
        return body

    def statement(self) -> Node:
        line = self.tokens[self.k].line
        if self.maybe("IF"):
            branches, otherwise = [self.branch()], []
            while self.maybe("ELIF"):
                branches.append(self.branch())
            if self.maybe("ELSE"):
                self.take(":")
                otherwise = self.block("END")
            self.end()
            return ("if", branches, otherwise)
        if self.maybe("WHILE"):
            condition, body = self.branch("END")
            self.end()
            return ("while", condition, body)
        if self.maybe("RETURN"):
            value = self.expression()
            self.take("\n")
            return ("return", value)
        if word := self.maybe("ENTER_CRITICAL", "EXIT_CRITICAL"):
            self.take("\n")
            return ("critical", word == "ENTER_CRITICAL")
        scope = self.maybe("LOCAL", "GLOBAL")
        target = self.postfix(("name", self.name(), line))
        if self.word == "=":
            self.next()
            target = ("assign", target, self.expression(), scope)
        elif target[0] != "call" or scope:
            raise self.fail("=")
        if self.tokens[self.k].kind != "end":
            self.take("\n")
        return target

    def branch(self, *ends: str) -> tuple[Node, list[Node]]:
        condition = self.expression()
        self.take(":")
        self.take("\n")
        return condition, self.block(*(ends or ("ELIF", "ELSE", "END")))


WORD = r"[A-Za-z_][A-Za-z0-9_]*"
PATTERNS = {
    "rapid": pattern_of(r"![^\n]*", r'"[^"\n]*"', WORD),
    "scl": pattern_of(r"//[^\n]*", r"""'(?:[^'$\n]|\$.)*'|"[^"\n]*\"""", r"\#?" + WORD),
    "st": pattern_of(r"\(\*.*?\*\)|//[^\n]*", r"'(?:[^'$\n]|\$.)*'", WORD),
    "urscript": pattern_of(r"\#[^\n]*", r'"[^"\n]*"', WORD),
}
START: dict[str, Callable[[list[Token]], Unit]] = {
    "rapid": lambda tokens: Rapid(tokens).module(),
    "scl": lambda tokens: Iec(tokens).source(),
    "st": lambda tokens: Iec(tokens).source(),
    "urscript": lambda tokens: UrScript(tokens).script(),
}


@cache
def parse(text: str, language: str) -> Unit:
    return START[language](tokenize(text, PATTERNS[language], newlines=language == "urscript"))
