"""Makes Python functions of what tests/clients/programs/syntax/ has parsed, once for each place of a text: a program is run
thousands of times, by many machines, and what a name or an operator is does not change between them.

A place is written as Python's own text, which is compiled: an expression becomes a function of machine and frame that returns
its value, a list of statements one that returns None at its end, and what a RETURN gives in a tuple.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from itertools import count
from typing import TYPE_CHECKING, Any

from tests.clients.programs.syntax.parser import Node

if TYPE_CHECKING:
    from tests.clients.programs.machine import Frame, Machine

Code = Callable[["Machine", "Frame"], Any]
MOST_STEPS = 400_000
"""Statements of one call from outside: more is an endless loop."""
OPERATIONS = {
    "/": "{} / {}",
    "DIV": "int({}) // int({})",
    "MOD": "int({}) % int({})",
    "XOR": "{} ^ {}",
    "=": "{} == {}",
    "<>": "{} != {}",
    **{word: f"{{}} {word} {{}}" for word in ("+", "-", "*", "==", "!=", "<", ">", "<=", ">=")},
}
STOPPING = {"AND": ("False", "&"), "OR": ("True", "|")}
"""What of a left side ends it, and what is done with both else."""
LOCALS = {
    "v": "frame.variables",
    "g": "machine.global_names",
    "assigned": "frame.assigned",
    "takes": "machine.takes.get",
    "takes_named": "machine.takes_named.get",
    "look_up": "machine.look_up",
    "first": "machine.first_index",
    "place": "machine.place",
    "member_of": "machine.member_of",
    "keep": "machine.keep_variable",
    "store": "machine.store",
}
"""Names that a function's text uses, if it does, and what they are."""
made: dict[tuple[int, bool, str], tuple[Any, Any]] = {}
"""What each place has become, by its identity, which stays: the place is kept beside it."""


class RapidError(Exception):
    """An error number of RAPID, for the ERROR handler of a routine or of its callers."""


@cache
def folded(name: str) -> str:
    return name.lstrip("#").strip('"').upper()


def key_of(name: str, fold: bool) -> str:
    """Return the name as the language compares it."""
    return folded(name) if fold else name


def code_of(place: Any, fold: bool, use: str = "") -> Any:
    """Return the function of an expression, or that of a list of statements. use: "watched" for one that calls machine.switch
    wherever another task may run, "assigned" for one that gives a third argument to the place, "given" for one that returns
    a call's arguments in their order."""
    known = made.get((id(place), fold, use))
    if known is None:
        known = made[id(place), fold, use] = place, Writer(fold, use).code(place)
    return known[1]


def invert(value: Any) -> Any:
    return not value if isinstance(value, bool) else ~value


def endless() -> None:
    raise RecursionError("an endless loop")


def no_truth(condition: Node) -> None:
    raise AssertionError(condition)


class Writer:
    """Writes one function."""

    def __init__(self, fold: bool, use: str) -> None:
        self.fold, self.use = fold, use
        self.lines: list[str] = []
        self.depth = 1
        self.numbers = count()
        self.names: dict[str, Any] = {
            "invert": invert,
            "endless": endless,
            "no_truth": no_truth,
            "RapidError": RapidError,
        }
        self.used: set[str] = set()

    def code(self, place: Any) -> Code:
        if self.use == "assigned":
            self.keep(place, "value", "''")
        elif self.use == "given":
            plain = (each[2] if each[0] == "named" else each for each in place)
            self.line(f"return [{', '.join(map(self.value, plain))}]")
        elif isinstance(place, list):
            self.body(place)
        else:
            self.line(f"return {self.value(place)}")
        first = [f"    {name} = {LOCALS[name]}" for name in LOCALS if name in self.used]
        text = "\n".join(["def code(machine, frame, value=None):", *first, *self.lines])
        exec(compile(text, "<program>", "exec"), self.names)
        return self.names["code"]  # type: ignore[no-any-return]

    def line(self, text: str) -> None:
        self.lines.append("    " * self.depth + text)

    @contextmanager
    def below(self, text: str) -> Iterator[None]:
        """Write this line, and the block's lines under it."""
        self.line(text)
        self.depth += 1
        yield
        self.depth -= 1

    def local(self, name: str) -> str:
        self.used.add(name)
        return name

    def new(self) -> str:
        return f"t{next(self.numbers)}"

    def kept(self, thing: Any) -> str:
        """Return the name by which the text reaches a thing."""
        name = f"n{next(self.numbers)}"
        self.names[name] = thing
        return name

    def key(self, name: str) -> str:
        return repr(key_of(name, self.fold))

    # -- expressions

    def value(self, node: Node) -> str:
        return str(getattr(self, f"{node[0]}_value")(node))

    def value_value(self, node: Node) -> str:
        return f"({node[1]!r})" if isinstance(node[1], (bool, int, float, str)) else self.kept(node[1])

    def name_value(self, node: Node) -> str:
        key, own, common = self.key(node[1]), self.local("v"), self.local("g")
        other = f"{self.local('look_up')}({key}, {self.kept(node)})"
        return f"({own}[{key}] if {key} in {own} else {common}[{key}] if {key} in {common} else {other})"

    def binary_value(self, node: Node) -> str:
        left, right = self.value(node[2]), self.value(node[3])
        if node[1] not in STOPPING:
            return f"({OPERATIONS[node[1]].format(left, right)})"
        first, (end, act) = self.new(), STOPPING[node[1]]
        return f"({first} if ({first} := {left}) is {end} else {first} {act} {right})"

    def list_value(self, node: Node) -> str:
        return f"[{', '.join(map(self.value, node[1]))}]"

    def index_value(self, node: Node) -> str:
        return f"{self.value(node[1])}[{self.place(node[2][0])}]"

    def place(self, index: Node) -> str:
        """Return the place in a list, which `machine.place` judges where it may be none."""
        first, found = self.local("first"), self.new()
        if index[0] == "value" and type(index[1]) is int and index[1] > 0:
            return f"{index[1]} - {first}"
        is_one = f"type({found} := {self.value(index)}) is int and {found} >= {first}"
        return f"{found} - {first} if {is_one} else {self.local('place')}({found})"

    def field_value(self, node: Node) -> str:
        """Most are of a structure."""
        holder, key = self.new(), self.key(node[2])
        other = f"{self.local('member_of')}({holder}, {node[2]!r}, {key})"
        return f"({holder}[{key}] if type({holder} := {self.value(node[1])}) is dict else {other})"

    def bit_value(self, node: Node) -> str:
        word, number = self.value(node[1]), node[3]
        return f"bool({word} >> {number} & 1)" if node[2] == "X" else f"({word} >> {16 * number} & 0xFFFF)"

    def unary_value(self, node: Node) -> str:
        inside = self.value(node[2])
        return f"(-{inside})" if node[1] == "-" else f"invert({inside})"

    def call_value(self, node: Node) -> str:
        """A routine of the program, an instance of a block, or what the controller brings along."""
        target, arguments = node[1], node[2]
        plain = [self.value(each) for each in arguments if each[0] != "named"]
        named = [(each[1], self.value(each[2])) for each in arguments if each[0] == "named"]
        words = f"{{{', '.join(f'{name!r}: {value}' for name, value in named)}}}"
        if target[0] != "name":
            return f"{self.value(target)}.call({words})"
        key, known = self.key(target[1]), self.new()
        folded_words = f"**{{{', '.join(f'{self.key(name)}: {value}' for name, value in named)}}}"
        given, takes = (folded_words, "takes_named") if named else (", ".join(plain), "takes")
        text = "" if named and plain else f"{known}({given}) if ({known} := {self.local(takes)}({key})) else "
        if not plain:
            text += f"{known}.call({words}) if ({known} := machine.instance({key}, {self.local('v')})) else "
        return f"({text}machine.use({key}, {self.kept(arguments)}, frame))"

    # -- statements

    def body(self, body: list[Node]) -> None:
        if not body:
            self.line("pass")
            return
        self.line(f"machine.steps += {len(body)}")
        with self.below(f"if machine.steps > {MOST_STEPS}:"):
            self.line("endless()")
        for statement in body:
            self.may_switch(statement)
            getattr(self, f"write_{statement[0]}")(statement)

    def may_switch(self, node: Node, condition: str = "") -> None:
        if self.use == "watched":
            with self.below(f"if {condition}not machine.is_critical:"):
                self.line(f"machine.switch({self.kept(node)})")

    def write_call(self, node: Node) -> None:
        self.line(self.value(node))

    def write_block(self, node: Node) -> None:
        self.body(node[1])

    def write_critical(self, node: Node) -> None:
        """URScript: no other thread runs in here. One that is left open stops the robot's other threads for ever."""
        self.line(f"assert machine.is_critical != {node[1]}; machine.is_critical = {node[1]}")

    def write_assign(self, node: Node) -> None:
        found, scope = self.new(), node[3] if len(node) > 3 else ""
        self.line(f"{found} = {self.value(node[2])}")
        self.may_switch(node, "machine.is_sliced and ")
        self.keep(node[1], found, repr(scope))

    def keep(self, target: Node, value: str, scope: str) -> None:
        """Assign to a place. scope: the text of URScript's `local` or `global`, in capitals."""
        if target[0] == "name":
            key, assigned = self.key(target[1]), self.local("assigned")
            at_length = f"{self.local('keep')}({key}, {self.kept(target)}, {value}, frame, {scope})"
            kept = f"{value} if type({value}) is bool else {self.local('store')}({assigned}[{key}], {value})"
            with self.below(f"if {key} in {assigned}:" if scope == "''" else "if False:"):
                self.line(f"{self.local('v')}[{key}] = {kept}")
            self.line(f"else: {at_length}")
        elif target[0] == "index":
            items, index = self.value(target[1]), self.place(target[2][0])
            self.line(f"machine.keep_item({items}, {index}, {value}, {self.kept(target)})")
        else:
            holder, name = self.value(target[1]), target[2]
            self.line(f"machine.keep_field({holder}, {name!r}, {self.key(name)}, {value})")

    def write_if(self, node: Node) -> None:
        word = "if"
        for condition, body in node[1]:
            decided = self.new()
            with self.below(f"{word} ({decided} := {self.value(condition)}) is True:"):
                self.body(body)
            is_wrong = f"({decided} is not False and no_truth({self.kept(condition)}))"
            word = f"elif {is_wrong} or"
        with self.below("else:"):
            self.line(is_wrong)
            self.body(node[2])

    def write_case(self, node: Node) -> None:
        found = self.new()
        self.line(f"{found} = {self.value(node[1])}")
        word = "if"
        for labels, body in node[2]:
            is_one = " or ".join(f"{self.value(label)} == {found}" for label in labels)
            with self.below(f"{word} {is_one}:"):
                self.body(body)
            word = "elif"
        with self.below("else:"):
            self.body(node[3])

    def write_for(self, node: Node) -> None:
        number, implicit = self.new(), self.new()
        self.line(f"{implicit} = machine.library.get('implicit_for')")
        with self.below(f"for {number} in range(int({self.value(node[2])}), int({self.value(node[3])}) + 1):"):
            self.keep(node[1], number, f"'LOCAL' if {implicit} else ''")
            self.body(node[4])
        with self.below(f"if {implicit}:"):
            self.line(f"{self.local('v')}.pop({self.key(node[1][1])}, None)")

    def write_while(self, node: Node) -> None:
        with self.below(f"while {self.value(node[1])}:"):
            self.body(node[2])

    def write_return(self, node: Node) -> None:
        self.line(f"return ({'None' if node[1] is None else self.value(node[1])},)")

    def write_raise(self, node: Node) -> None:
        self.line(f"raise RapidError({node[1][1]!r})")
