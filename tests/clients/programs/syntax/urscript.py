"""Parser of the part of URScript that the generated clients use. Grammar: "The URScript Programming Language"."""

from typing import ClassVar

from tests.clients.programs.syntax.parser import Node, Parser, Routine, Unit


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
