"""Runs what tests/clients/programs/syntax.py has parsed: values of a width, lists that are copied, routines, function blocks.

What a controller brings along (sockets, MB_CLIENT, timers, conversions) comes in as `library`: a name -> a Python function that
gets the machine, the arguments as expressions and as values. A name that nobody has declared is a NameError: so a run of every
routine is also the check that everything is declared.
"""

import copy
import struct
from collections.abc import Callable
from functools import cache
from typing import Any

from tests.clients.programs.syntax import Node, Routine, Unit

WIDTHS = {"WORD": 16, "UINT": 16, "BYTE": 8, "USINT": 8, "DWORD": 32, "UDINT": 32}
SIGNED = {"INT": 16, "DINT": 32}
MOST_STEPS = 400_000
"""Statements of one call from outside: more is an endless loop."""


@cache
def folded(name: str) -> str:
    return name.lstrip("#").strip('"').upper()


class Returned(Exception):  # noqa: N818
    def __init__(self, value: Any) -> None:
        self.value = value


class RapidError(Exception):
    """An error number of RAPID, for the ERROR handler of a routine or of its callers."""


class TaskStopped(Exception):  # noqa: N818
    """RAPID: an error within an ERROR handler goes to the system's error handler, which stops the task."""


LARGEST_NUM = 8_388_608
"""RAPID: whole numbers are exact in num up to here (data type num)."""


class Block:
    """An instance of a function block that was interpreted, with its variables."""

    def __init__(self, machine: "Machine", routine: Routine) -> None:
        self.machine, self.routine = machine, routine
        entries = routine.variables.items()
        self.fields = {machine.key(name): machine.fresh(kind, initial) for name, (kind, initial, _) in entries}
        self.frame = Frame(machine, routine, self.fields)

    def call(self, given: dict[str, Any]) -> None:
        for name, _, section in self.routine.parameters:
            if name in given:
                self.fields[self.machine.key(name)] = given[name]  # a structure stays the caller's own: VAR_IN_OUT
            elif section == "VAR_IN_OUT":
                raise TypeError(f"{self.routine.name}: {name} is missing")
        self.machine.run_body(self.routine, self.frame)


class Union(dict[str, Any]):
    """REAL and DWORD on the same four bytes."""

    def __setitem__(self, name: str, value: Any) -> None:
        data = struct.pack(">f" if name == "fValue" else ">I", value)
        super().__setitem__("fValue", struct.unpack(">f", data)[0])
        super().__setitem__("nBits", struct.unpack(">I", data)[0])


class Frame:
    """One call: its variables, and their types."""

    def __init__(self, machine: "Machine", routine: Routine | None, variables: dict[str, Any]) -> None:
        self.routine, self.variables = routine, variables
        entries = routine.variables if routine else {}
        self.types = {machine.key(name): entry[0] for name, entry in entries.items()}
        self.constants = {machine.key(name) for name, entry in entries.items() if "CONST" in entry[2]}


class Machine:
    """global_names: variables of the module, program or data blocks."""

    def __init__(self, unit: Unit, library: dict[str, Callable[..., Any]], *, fold: bool = True) -> None:
        self.unit, self.library, self.fold = unit, library, fold
        self.routines = {self.key(name): routine for name, routine in unit.routines.items()}
        self.declared = {self.key(name): entry for name, entry in unit.variables.items()}
        self.types = {self.key(name): members for name, members in unit.types.items()}
        self.global_names: dict[str, Any] = {}
        self.blocks: dict[str, Callable[[], Any]] = {}
        self.steps = 0
        self.is_critical = False
        self.switch: Callable[[Node], object] = lambda _statement: None
        """Called wherever another task or thread may run, with the statement that comes next."""
        self.called: set[str] = set()

    def key(self, name: str) -> str:
        """Return the name as the language compares it."""
        return folded(name) if self.fold else name

    def begin(self) -> None:
        """Give the module's variables their first values."""
        for name, (kind, initial, _) in self.unit.variables.items():
            self.global_names[self.key(name)] = self.fresh(kind, initial)
        self.frame = Frame(self, None, {})
        self.run(self.unit.body, self.frame)

    # -- values

    def fresh(self, kind: Any, initial: Node | None = None) -> Any:
        """Return the first value of a variable of this type."""
        if initial is not None:
            return self.store(kind, self.value(initial, Frame(self, None, {})))
        if isinstance(kind, tuple):
            first, last = kind[1], kind[2]
            if isinstance(last, tuple):
                last = self.value(last, Frame(self, None, {}))
            return [self.fresh(kind[3]) for _ in range(int(last) - int(first) + 1)]
        name = self.key(str(kind))
        if name in self.types:
            members = {self.key(member): self.fresh(*entry) for member, entry in self.types[name].items()}
            if name in {self.key(each) for each in self.unit.unions}:
                return Union({"fValue": 0.0, "nBits": 0})
            return members
        if name in self.blocks:
            return self.blocks[name]()
        if name in self.routines and self.routines[name].kind == "FUNCTION_BLOCK":
            return Block(self, self.routines[name])
        return {"BOOL": False, "REAL": 0.0, "NUM": 0, "DNUM": 0, "STRING": "", "TIME": 0.0}.get(name, 0)

    def store(self, kind: Any, value: Any) -> Any:
        """Return what a variable of this type holds after an assignment."""
        if value is True or value is False:
            return value
        if isinstance(value, (list, dict)) and not isinstance(value, Union):
            return copy.deepcopy(value)
        name = self.key(str(kind)) if not isinstance(kind, tuple) else ""
        if name in WIDTHS:
            return int(value) & ((1 << WIDTHS[name]) - 1)
        if name in SIGNED and not -(1 << SIGNED[name] - 1) <= value < 1 << SIGNED[name] - 1:
            raise OverflowError(f"{value} in {kind}")
        if name == "NUM" and isinstance(value, int) and abs(value) > LARGEST_NUM:
            raise OverflowError(f"{value} is not exact in num")
        if name in ("REAL", "NUM") and isinstance(value, float):
            return struct.unpack(">f", struct.pack(">f", value))[0]
        if name == "STRING" and len(value) > 80:
            raise OverflowError(f"{value!r} is longer than 80 characters")
        return value

    def value(self, node: Node, frame: Frame) -> Any:
        kind = node[0]
        if kind == "value":
            return node[1]
        if kind == "name":
            name = folded(node[1]) if self.fold else node[1]
            return frame.variables[name] if name in frame.variables else self.look_up(node, frame)
        if kind == "binary":
            return self.binary(node[1], node[2], node[3], frame)
        if kind == "list":
            return [self.value(each, frame) for each in node[1]]
        if kind == "index":
            return self.value(node[1], frame)[self.place(node, frame)]
        if kind == "field":
            return self.member(self.value(node[1], frame), node[2])
        if kind == "bit":
            word = self.value(node[1], frame)
            return bool(word >> node[3] & 1) if node[2] == "X" else word >> 16 * node[3] & 0xFFFF
        if kind == "unary":
            inside = self.value(node[2], frame)
            if node[1] == "-":
                return -inside
            return not inside if isinstance(inside, bool) else ~inside
        return self.call(node, frame)

    def binary(self, operator: str, left_node: Node, right_node: Node, frame: Frame) -> Any:
        left = self.value(left_node, frame)
        if isinstance(left, bool) and operator in ("AND", "OR") and not isinstance(self.library.get("strict"), bool):
            return self.value(right_node, frame) if left == (operator == "AND") else left
        right = self.value(right_node, frame)
        return OPERATIONS[operator](left, right)

    def place(self, node: Node, frame: Frame) -> int:
        index = self.value(node[2][0], frame)
        first = self.library.get("first_index", 0)
        if index != int(index) or index < first:  # type: ignore[operator]
            raise IndexError(f"index {index}")
        return int(index) - first  # type: ignore[operator]

    def member(self, holder: Any, name: str) -> Any:
        if isinstance(holder, Union):
            return holder[name]
        if isinstance(holder, dict):
            return holder[self.key(name)]
        if isinstance(holder, Block):
            return holder.fields[self.key(name)]
        return getattr(holder, name)

    def look_up(self, node: Node, frame: Frame) -> Any:
        name = self.key(node[1])
        if name in frame.variables:
            return frame.variables[name]
        if name in self.global_names:
            return self.global_names[name]
        if name in self.library and not callable(self.library[name]):
            return self.library[name]
        raise NameError(f"line {node[2]}: {node[1]} is not declared")

    # -- statements

    def run(self, body: list[Node], frame: Frame) -> None:
        for statement in body:
            self.steps += 1
            if self.steps > MOST_STEPS:
                raise RecursionError("an endless loop")
            if not self.is_critical:
                self.switch(statement)
            getattr(self, f"run_{statement[0]}")(statement, frame)

    def run_critical(self, node: Node, _frame: Frame) -> None:
        """URScript: no other thread runs in here."""
        self.is_critical = node[1]

    def run_block(self, node: Node, frame: Frame) -> None:
        self.run(node[1], frame)

    def run_assign(self, node: Node, frame: Frame) -> None:
        value = self.value(node[2], frame)
        if self.library.get("sliced") and not self.is_critical:
            self.switch(node)
        self.assign(node[1], value, frame, node[3] if len(node) > 3 else "")

    def assign(self, target: Node, value: Any, frame: Frame, scope: str = "") -> None:
        if target[0] == "index":
            holder, place = self.value(target[1], frame), self.place(target, frame)
            kind = "WORD" if self.library.get("words") else ""
            if self.library.get("typed"):
                self.keep_type(str(target[1]), holder[place], value)
            holder[place] = self.store(kind if isinstance(value, int) and not isinstance(value, bool) else "", value)
            return
        if target[0] == "field":
            holder = self.value(target[1], frame)
            if not isinstance(holder, dict):  # a static of a block of the controller's own
                holder.set_static(target[2], value)
                return
            holder[target[2] if isinstance(holder, Union) else self.key(target[2])] = self.store("", value)
            return
        name = self.key(target[1])
        if self.library.get("typed"):
            known = {} if scope == "LOCAL" else frame.variables if name in frame.variables else self.global_names
            self.keep_type(target[1], known.get(name, value), value)
        if name in frame.variables and scope != "GLOBAL":
            if name in frame.constants:
                raise TypeError(f"{name} is a constant")
            frame.variables[name] = self.store(frame.types.get(name, ""), value)
        elif scope == "LOCAL":
            frame.variables[name] = self.store("", value)
        elif scope == "GLOBAL" or name in self.global_names:
            declared = self.declared.get(name)
            if declared and declared[2] == "CONST":
                raise TypeError(f"{target[1]} is a constant")
            self.global_names[name] = self.store(declared[0] if declared else "", value)
        else:
            raise NameError(f"line {target[2]}: {target[1]} is not declared")

    def keep_type(self, name: str, before: Any, value: Any) -> None:
        """URScript: "The type of a variable is deduced from the first assignment of the variable" (script manual, 1.3)."""
        if type(before) is not type(value):
            raise TypeError(f"{name} is {type(before).__name__}, not {type(value).__name__}")

    def run_if(self, node: Node, frame: Frame) -> None:
        for condition, body in node[1]:
            decided = self.value(condition, frame)
            assert isinstance(decided, bool), condition
            if decided:
                self.run(body, frame)
                return
        self.run(node[2], frame)

    def run_case(self, node: Node, frame: Frame) -> None:
        value = self.value(node[1], frame)
        for labels, body in node[2]:
            if any(self.value(label, frame) == value for label in labels):
                self.run(body, frame)
                return
        self.run(node[3], frame)

    def run_for(self, node: Node, frame: Frame) -> None:
        first, last = (int(self.value(each, frame)) for each in node[2:4])
        implicit = self.library.get("implicit_for")
        for k in range(first, last + 1):
            self.assign(node[1], k, frame, "LOCAL" if implicit else "")
            self.run(node[4], frame)
        if implicit:
            frame.variables.pop(self.key(node[1][1]), None)

    def run_while(self, node: Node, frame: Frame) -> None:
        while self.value(node[1], frame):
            self.run(node[2], frame)

    def run_return(self, node: Node, frame: Frame) -> None:
        raise Returned(None if node[1] is None else self.value(node[1], frame))

    def run_raise(self, node: Node, frame: Frame) -> None:
        raise RapidError(node[1][1])

    def run_call(self, node: Node, frame: Frame) -> None:
        self.call(node, frame)

    # -- calls

    def call(self, node: Node, frame: Frame) -> Any:
        target, arguments = node[1], node[2]
        holder = self.instance(target, frame)
        if holder is not None:
            given = {each[1]: self.value(each[2], frame) for each in arguments}
            holder.call(given)
            return None
        name = self.key(target[1])
        if name in self.routines:
            return self.call_routine(self.routines[name], arguments, frame)
        if name in self.library:
            return self.library[name](self, arguments, frame)
        raise NameError(f"{target[1]} is neither a routine nor known to the controller")

    def instance(self, target: Node, frame: Frame) -> Any:
        if target[0] != "name":
            return self.value(target, frame)
        name = self.key(target[1])
        if name in self.routines and self.routines[name].kind != "FUNCTION_BLOCK":
            return None
        try:
            found = self.look_up(target, frame)
        except NameError:
            return None
        return found if hasattr(found, "call") else None

    def call_routine(self, routine: Routine, arguments: list[Node], frame: Frame) -> Any:
        variables: dict[str, Any] = {}
        positional = [each for each in arguments if each[0] != "named"]
        named = {self.key(each[1]): each[2] for each in arguments if each[0] == "named"}
        if len(arguments) != len(routine.parameters):
            raise TypeError(f"{routine.name}: {len(arguments)} arguments, {len(routine.parameters)} are wanted")
        for k, (name, kind, _) in enumerate(routine.parameters):
            given = named[self.key(name)] if named else positional[k]
            variables[self.key(name)] = self.store(kind, self.value(given, frame))
        for name, (kind, initial, _) in routine.variables.items():
            if self.key(name) not in variables:
                variables[self.key(name)] = self.fresh(kind, initial)
        if routine.kind == "FUNCTION":
            variables[self.key(routine.name)] = self.fresh(routine.result)
        inner = Frame(self, routine, variables)
        try:
            self.run_body(routine, inner)
        except Returned as result:
            return result.value
        return variables.get(self.key(routine.name)) if routine.kind == "FUNCTION" else None

    def run_body(self, routine: Routine, frame: Frame) -> None:
        self.called.add(routine.name)
        try:
            self.run(routine.body, frame)
        except RapidError as error:
            if not routine.handler:
                raise
            self.global_names["ERRNO"] = str(error)
            try:
                self.run(routine.handler, frame)
            except RapidError as second:
                raise TaskStopped(f"{second} in the ERROR handler of {routine.name}") from None
        except Returned:
            if routine.kind == "FUNCTION_BLOCK":
                return
            raise

    def start(self, name: str, *arguments: Any) -> Any:
        """Call a routine from outside."""
        self.steps = 0
        nodes = [("value", each) for each in arguments]
        return self.call(("call", ("name", name, 0), nodes), Frame(self, None, {}))


OPERATIONS: dict[str, Callable[[Any, Any], Any]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "DIV": lambda a, b: int(a) // int(b),
    "MOD": lambda a, b: int(a) % int(b),
    "AND": lambda a, b: a & b,
    "OR": lambda a, b: a | b,
    "XOR": lambda a, b: a ^ b,
    "=": lambda a, b: a == b,
    "==": lambda a, b: a == b,
    "<>": lambda a, b: a != b,
    "!=": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
    "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b,
}
