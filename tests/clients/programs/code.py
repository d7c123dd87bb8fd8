"""Makes Python functions of what tests/clients/programs/syntax/ has parsed, once for each place of a text: a program is run
thousands of times, by many machines, and what a name or an operator is does not change between them.

An expression becomes a function of machine and frame that returns its value, a statement one that returns nothing.
"""

import operator
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any

from tests.clients.programs.kept import KEEPERS
from tests.clients.programs.syntax.parser import Node

if TYPE_CHECKING:
    from tests.clients.programs.machine import Frame, Machine

Code = Callable[["Machine", "Frame"], Any]
Keeper = Callable[["Machine", "Frame", Any, str], None]
"""Assigns a value; the last argument is URScript's `local` or `global`, in capitals."""
MOST_STEPS = 400_000
"""Statements of one call from outside: more is an endless loop."""
OPERATIONS: dict[str, Callable[[Any, Any], Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "DIV": lambda a, b: int(a) // int(b),
    "MOD": lambda a, b: int(a) % int(b),
    "AND": operator.and_,
    "OR": operator.or_,
    "XOR": operator.xor,
    "=": operator.eq,
    "==": operator.eq,
    "<>": operator.ne,
    "!=": operator.ne,
    "<": operator.lt,
    ">": operator.gt,
    "<=": operator.le,
    ">=": operator.ge,
}
made: dict[tuple[int, bool], tuple[Any, Any]] = {}
"""What each place has become, by its identity, which stays: the place is kept beside it."""
keepers: dict[tuple[int, bool], tuple[Node, Keeper]] = {}


class Returned(Exception):  # noqa: N818
    def __init__(self, value: Any) -> None:
        self.value = value


class RapidError(Exception):
    """An error number of RAPID, for the ERROR handler of a routine or of its callers."""


@cache
def folded(name: str) -> str:
    return name.lstrip("#").strip('"').upper()


def key_of(name: str, fold: bool) -> str:
    """Return the name as the language compares it."""
    return folded(name) if fold else name


def code_of(place: Any, fold: bool) -> Any:
    """Return the function of an expression, or that of a list of statements."""
    known = made.get((id(place), fold))
    if known is None:
        maker = body_code if isinstance(place, list) else VALUES[place[0]]
        known = made[id(place), fold] = place, maker(place, fold)
    return known[1]


# -- expressions


def constant_code(node: Node, fold: bool) -> Code:
    constant = node[1]
    return lambda _machine, _frame: constant


def name_code(node: Node, fold: bool) -> Code:
    key = key_of(node[1], fold)

    def name(machine: "Machine", frame: "Frame") -> Any:
        variables = frame.variables
        return variables[key] if key in variables else machine.look_up(key, node)

    return name


def binary_code(node: Node, fold: bool) -> Code:
    act, left, right = OPERATIONS[node[1]], code_of(node[2], fold), code_of(node[3], fold)
    if node[1] not in ("AND", "OR"):
        return lambda machine, frame: act(left(machine, frame), right(machine, frame))
    goes_on = node[1] == "AND"

    def short(machine: "Machine", frame: "Frame") -> Any:
        first = left(machine, frame)
        if first is True or first is False:
            return right(machine, frame) if first is goes_on else first
        return act(first, right(machine, frame))

    return short


def list_code(node: Node, fold: bool) -> Code:
    items = [code_of(each, fold) for each in node[1]]
    return lambda machine, frame: [item(machine, frame) for item in items]


def index_code(node: Node, fold: bool) -> Code:
    holder, index = code_of(node[1], fold), code_of(node[2][0], fold)
    return lambda machine, frame: holder(machine, frame)[machine.place(index(machine, frame))]


def field_code(node: Node, fold: bool) -> Code:
    holder, name = code_of(node[1], fold), node[2]
    return lambda machine, frame: machine.member(holder(machine, frame), name)


def bit_code(node: Node, fold: bool) -> Code:
    word, number = code_of(node[1], fold), node[3]
    if node[2] == "X":
        return lambda machine, frame: bool(word(machine, frame) >> number & 1)
    return lambda machine, frame: word(machine, frame) >> 16 * number & 0xFFFF


def unary_code(node: Node, fold: bool) -> Code:
    inside = code_of(node[2], fold)
    if node[1] == "-":
        return lambda machine, frame: -inside(machine, frame)

    def invert(machine: "Machine", frame: "Frame") -> Any:
        value = inside(machine, frame)
        return not value if isinstance(value, bool) else ~value

    return invert


@dataclass(frozen=True)
class Given:
    """Arguments of a call, in their order or by name."""

    positional: list[Code]
    named: dict[str, Code] = field(default_factory=dict)

    @property
    def count(self) -> int:
        return len(self.positional) + len(self.named)


def call_code(node: Node, fold: bool) -> Code:
    """A routine of the program, an instance of a block, or what the controller brings along."""
    target, arguments = node[1], node[2]
    named = {each[1]: code_of(each[2], fold) for each in arguments if each[0] == "named"}
    if target[0] != "name":
        holder = code_of(target, fold)
        return lambda machine, frame: holder(machine, frame).call(values_of(named, machine, frame))
    key = key_of(target[1], fold)
    given = Given(
        [code_of(each, fold) for each in arguments if each[0] != "named"],
        {key_of(name, fold): code for name, code in named.items()},
    )

    def call(machine: "Machine", frame: "Frame") -> Any:
        routine = machine.routines.get(key)
        if routine is None or routine.kind == "FUNCTION_BLOCK":
            instance = frame.variables.get(key, machine.global_names.get(key))
            if hasattr(instance, "call"):
                return instance.call(values_of(named, machine, frame))
        if routine is not None:
            return machine.call_routine(routine, given, frame)
        if key in machine.library:
            return machine.library[key](machine, arguments, frame)
        raise NameError(f"{target[1]} is neither a routine nor known to the controller")

    return call


def values_of(named: dict[str, Code], machine: "Machine", frame: "Frame") -> dict[str, Any]:
    return {name: code(machine, frame) for name, code in named.items()}


# -- statements


def body_code(body: list[Node], fold: bool) -> Code:
    steps = [(statement, STATEMENTS[statement[0]](statement, fold)) for statement in body]

    def run(machine: "Machine", frame: "Frame") -> None:
        for statement, code in steps:
            machine.steps += 1
            if machine.steps > MOST_STEPS:
                raise RecursionError("an endless loop")
            if machine.switch is not None and not machine.is_critical:
                machine.switch(statement)
            code(machine, frame)

    return run


def block_code(node: Node, fold: bool) -> Code:
    return code_of(node[1], fold)


def critical_code(node: Node, fold: bool) -> Code:
    """URScript: no other thread runs in here."""

    def begin_or_end(machine: "Machine", _frame: "Frame") -> None:
        machine.is_critical = node[1]

    return begin_or_end


def keeper_code(target: Node, fold: bool) -> Keeper:
    """Return the function that assigns to a place."""
    known = keepers.get((id(target), fold))
    if known is None:
        known = keepers[id(target), fold] = target, TARGETS[target[0]](target, fold)
    return known[1]


def variable_keeper(target: Node, fold: bool) -> Keeper:
    key = key_of(target[1], fold)
    return lambda machine, frame, value, scope: machine.keep_variable(key, target, value, frame, scope)


def item_keeper(target: Node, fold: bool) -> Keeper:
    holder, index = code_of(target[1], fold), code_of(target[2][0], fold)

    def keep(machine: "Machine", frame: "Frame", value: Any, _scope: str) -> None:
        items, place = holder(machine, frame), machine.place(index(machine, frame))
        if machine.is_typed:
            machine.keep_type(str(target[1]), items[place], value)
        items[place] = machine.store(KEEPERS["WORD"] if machine.has_words and type(value) is int else None, value)

    return keep


def field_keeper(target: Node, fold: bool) -> Keeper:
    holder, key = code_of(target[1], fold), key_of(target[2], fold)

    def keep(machine: "Machine", frame: "Frame", value: Any, _scope: str) -> None:
        members = holder(machine, frame)
        if not isinstance(members, dict):  # a static of a block of the controller's own
            members.set_static(target[2], value)
        else:
            members[target[2] if machine.is_union(members) else key] = machine.store(None, value)

    return keep


def assign_code(node: Node, fold: bool) -> Code:
    value, keep, scope = code_of(node[2], fold), keeper_code(node[1], fold), node[3] if len(node) > 3 else ""

    def assign(machine: "Machine", frame: "Frame") -> None:
        found = value(machine, frame)
        if machine.is_sliced and machine.switch is not None and not machine.is_critical:
            machine.switch(node)
        keep(machine, frame, found, scope)

    return assign


def if_code(node: Node, fold: bool) -> Code:
    branches = [(code_of(condition, fold), code_of(body, fold), condition) for condition, body in node[1]]
    otherwise = code_of(node[2], fold)

    def choose(machine: "Machine", frame: "Frame") -> None:
        for decide, body, condition in branches:
            decided = decide(machine, frame)
            assert decided is True or decided is False, condition
            if decided:
                body(machine, frame)
                return
        otherwise(machine, frame)

    return choose


def case_code(node: Node, fold: bool) -> Code:
    value, otherwise = code_of(node[1], fold), code_of(node[3], fold)
    branches = [([code_of(label, fold) for label in labels], code_of(body, fold)) for labels, body in node[2]]

    def choose(machine: "Machine", frame: "Frame") -> None:
        found = value(machine, frame)
        for labels, body in branches:
            if any(label(machine, frame) == found for label in labels):
                body(machine, frame)
                return
        otherwise(machine, frame)

    return choose


def for_code(node: Node, fold: bool) -> Code:
    first, last, body = (code_of(each, fold) for each in node[2:5])
    keep, key = keeper_code(node[1], fold), key_of(node[1][1], fold)

    def repeat(machine: "Machine", frame: "Frame") -> None:
        begin, end = int(first(machine, frame)), int(last(machine, frame))
        implicit = machine.library.get("implicit_for")
        for k in range(begin, end + 1):
            keep(machine, frame, k, "LOCAL" if implicit else "")
            body(machine, frame)
        if implicit:
            frame.variables.pop(key, None)

    return repeat


def while_code(node: Node, fold: bool) -> Code:
    condition, body = code_of(node[1], fold), code_of(node[2], fold)

    def repeat(machine: "Machine", frame: "Frame") -> None:
        while condition(machine, frame):
            body(machine, frame)

    return repeat


def return_code(node: Node, fold: bool) -> Code:
    value = constant_code(("value", None), fold) if node[1] is None else code_of(node[1], fold)

    def end(machine: "Machine", frame: "Frame") -> None:
        raise Returned(value(machine, frame))

    return end


def raise_code(node: Node, fold: bool) -> Code:
    def end(_machine: "Machine", _frame: "Frame") -> None:
        raise RapidError(node[1][1])

    return end


VALUES: dict[str, Callable[[Node, bool], Code]] = {
    "value": constant_code,
    "name": name_code,
    "binary": binary_code,
    "list": list_code,
    "index": index_code,
    "field": field_code,
    "bit": bit_code,
    "unary": unary_code,
    "call": call_code,
}
STATEMENTS: dict[str, Callable[[Node, bool], Code]] = {
    "block": block_code,
    "critical": critical_code,
    "assign": assign_code,
    "if": if_code,
    "case": case_code,
    "for": for_code,
    "while": while_code,
    "return": return_code,
    "raise": raise_code,
    "call": call_code,
}
TARGETS: dict[str, Callable[[Node, bool], Keeper]] = {
    "name": variable_keeper,
    "index": item_keeper,
    "field": field_keeper,
}
