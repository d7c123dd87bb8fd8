"""Parser of the part of RAPID that the generated clients use. Grammar: ABB "RAPID Kernel" 3HAC050946, chapter 1 to 6."""

from typing import Any, ClassVar

from tests.clients.programs.syntax.parser import Node, Parser, Routine, Unit


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
