"""Parser of the parts of Structured Text and of SCL that the generated clients use.

Grammars: Siemens "STEP 7 Programming Guideline"/SCL; IEC 61131-3 (3rd edition) part 7.3.
"""

from typing import Any, ClassVar

from tests.clients.programs.syntax.parser import Node, Parser, Routine, Unit
from tests.clients.programs.syntax.tokens import Token


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
