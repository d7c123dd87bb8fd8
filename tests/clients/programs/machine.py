"""Runs what tests/clients/programs/syntax/ has parsed: values of a width, lists that are copied, routines, function blocks.

What a controller brings along (sockets, MB_CLIENT, timers, conversions) comes in as `library`: a name -> a Python function that
gets the machine, the arguments as expressions and as values. A name that nobody has declared is a NameError: so a run of every
routine is also the check that everything is declared.
"""

import copy
import struct
from collections.abc import Callable
from functools import partial
from typing import Any

from tests.clients.programs.code import RapidError, code_of, key_of
from tests.clients.programs.kept import FIRST_VALUES, KEEPERS, Keeps
from tests.clients.programs.syntax.parser import Node, Routine, Unit


class TaskStopped(Exception):  # noqa: N818
    """RAPID: an error within an ERROR handler goes to the system's error handler, which stops the task."""


class Block:
    """An instance of a function block that was interpreted, with its variables."""

    def __init__(self, machine: "Machine", routine: Routine) -> None:
        self.machine, self.routine = machine, routine
        entries = routine.variables.items()
        self.fields = {machine.key(name): machine.fresh(kind, initial) for name, (kind, initial, _) in entries}
        self.frame = Frame(self.fields, machine.declared_by(routine))
        self.passing = [(machine.key(name), kind) for name, (kind, _, section) in entries if section == "VAR_TEMP"]

    def call(self, given: dict[str, Any]) -> None:
        for name, kind in self.passing:  # nothing of it lasts until the next call
            self.fields[name] = self.machine.fresh(kind)
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
    """One call: its variables, and what each of them keeps of a value. assigned: the same of those to which anything may be
    assigned that they can keep."""

    __slots__ = ("assigned", "constants", "keepers", "variables")

    def __init__(self, variables: dict[str, Any], declared: "Declared | None" = None) -> None:
        self.variables = variables
        self.keepers = declared.keepers if declared else {}
        self.assigned = declared.assigned if declared else {}
        self.constants = declared.constants if declared else frozenset()


class Declared:
    """What a routine declares, as one machine needs it for each call."""

    def __init__(self, machine: "Machine", routine: Routine) -> None:
        key, entries = machine.key, routine.variables.items()
        self.keepers = {key(name): machine.keeper_of(kind) for name, (kind, _, _) in entries}
        self.constants = frozenset(key(name) for name, (_, _, section) in entries if "CONST" in section)
        free = {} if machine.is_typed else self.keepers
        self.assigned = {name: keep for name, keep in free.items() if name not in self.constants}
        self.parameters = [(key(name), machine.keeper_of(kind)) for name, kind, _ in routine.parameters]
        given = {name for name, _ in self.parameters}
        local = [(key(name), kind, initial) for name, (kind, initial, _) in entries if key(name) not in given]
        self.result = key(routine.name) if routine.kind == "FUNCTION" else None
        if self.result:
            local.append((self.result, routine.result, None))
        self.made = [each for each in local if each[2] is not None or not machine.is_plain(each[1])]
        self.plain = {
            name: machine.fresh(kind) for name, kind, initial in local if initial is None and machine.is_plain(kind)
        }


def call_in_order(act: Callable[..., Any], /, **named: Any) -> Any:
    return act(*named.values())


class Machine:
    """global_names: variables of the module, program or data blocks."""

    def __init__(self, unit: Unit, library: dict[str, Callable[..., Any]], *, fold: bool = True) -> None:
        self.unit, self.library, self.fold = unit, library, fold
        self.routines = {self.key(name): routine for name, routine in unit.routines.items()}
        plain = {key: each.act for key, each in library.items() if hasattr(each, "act")}
        alone = [key for key, each in self.routines.items() if each.kind != "FUNCTION_BLOCK"]  # which an instance calls
        routines = {key: partial(self.call_routine, self.routines[key]) for key in alone}
        self.takes: dict[str, Callable[..., Any]] = plain | routines
        self.takes_named = {key: partial(call_in_order, act) for key, act in plain.items()} | routines
        """What is called with the values of its arguments alone, in their order or by their names."""
        self.declared = {self.key(name): entry for name, entry in unit.variables.items()}
        self.global_keepers = {name: self.keeper_of(kind) for name, (kind, _, _) in self.declared.items()}
        self.types = {self.key(name): members for name, members in unit.types.items()}
        self.global_names: dict[str, Any] = {}
        self.blocks: dict[str, Callable[[], Any]] = {}
        self.known: dict[str, Declared] = {}
        self.first_index = int(library.get("first_index", 0))  # type: ignore[call-overload]
        self.is_typed, self.is_sliced, self.has_words = (
            bool(library.get(name)) for name in ("typed", "sliced", "words")
        )
        self.steps = 0
        self.is_critical = False
        self.switch: Callable[[Node], object] | None = None
        """Called wherever another task or thread may run, with the statement that comes next; set between calls."""
        self.called: set[str] = set()

    def key(self, name: str) -> str:
        """Return the name as the language compares it."""
        return key_of(name, self.fold)

    def begin(self) -> None:
        """Give the module's variables their first values."""
        for name, (kind, initial, _) in self.unit.variables.items():
            self.global_names[self.key(name)] = self.fresh(kind, initial)
        self.frame = Frame({})
        code_of(self.unit.body, self.fold)(self, self.frame)

    # -- values

    def fresh(self, kind: Any, initial: Node | None = None) -> Any:
        """Return the first value of a variable of this type."""
        if initial is not None:
            return self.store(self.keeper_of(kind), self.value(initial, Frame({})))
        if isinstance(kind, tuple):
            first, last = kind[1], kind[2]
            if isinstance(last, tuple):
                last = self.value(last, Frame({}))
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
        return FIRST_VALUES.get(name, 0)

    def is_plain(self, kind: Any) -> bool:
        """Decide whether a variable of this type holds one number, text or truth value."""
        name = None if isinstance(kind, tuple) else self.key(str(kind))
        return name is not None and name not in self.types and name not in self.blocks and name not in self.routines

    def declared_by(self, routine: Routine) -> Declared:
        if (found := self.known.get(routine.name)) is None:
            found = self.known[routine.name] = Declared(self, routine)
        return found

    def keeper_of(self, kind: Any) -> Keeps | None:
        """Return what makes of a value what a variable of this type keeps of it; None where that is the value."""
        return None if isinstance(kind, tuple) else KEEPERS.get(self.key(str(kind)))

    @staticmethod
    def store(keep: Keeps | None, value: Any) -> Any:
        """Return what a variable holds after an assignment. keep: as `keeper_of` returns it."""
        kind = type(value)
        if kind is bool:
            return value
        if kind is list or kind is dict:
            return copy.deepcopy(value)
        return keep(value) if keep else value

    def value(self, node: Node, frame: Frame) -> Any:
        return code_of(node, self.fold)(self, frame)

    def values(self, arguments: list[Node], frame: Frame) -> list[Any]:
        """Return a call's arguments in their order, the named ones too."""
        return code_of(arguments, self.fold, "given")(self, frame)  # type: ignore[no-any-return]

    def place(self, index: Any) -> int:
        if type(index) is int and index >= self.first_index:
            return index - self.first_index
        if index != int(index) or index < self.first_index:
            raise IndexError(f"index {index}")
        return int(index) - self.first_index

    def member(self, holder: Any, name: str) -> Any:
        return self.member_of(holder, name, self.key(name))

    @staticmethod
    def member_of(holder: Any, name: str, key: str) -> Any:
        """key: the name as the language compares it."""
        if type(holder) is dict:
            return holder[key]
        if isinstance(holder, Union):
            return holder[name]
        return holder.fields[key] if isinstance(holder, Block) else getattr(holder, name)

    def look_up(self, name: str, node: Node) -> Any:
        """Return what no variable of the routine or of the module is, but known to the controller."""
        if name in self.library and not callable(self.library[name]):
            return self.library[name]
        raise NameError(f"line {node[2]}: {node[1]} is not declared")

    # -- statements

    def assign(self, target: Node, value: Any, frame: Frame) -> None:
        """Assign to a place that a routine of the controller was given."""
        code_of(target, self.fold, "assigned")(self, frame, value)

    def keep_variable(self, name: str, node: Node, value: Any, frame: Frame, scope: str) -> None:
        """Assign to a variable. name: as the language compares it."""
        variables = frame.variables
        if self.is_typed:
            known = {} if scope == "LOCAL" else variables if name in variables else self.global_names
            self.keep_type(node[1], known.get(name, value), value)
        if name in variables and scope != "GLOBAL":
            if name in frame.constants:
                raise TypeError(f"{name} is a constant")
            variables[name] = self.store(frame.keepers.get(name), value)
        elif scope == "LOCAL":
            variables[name] = self.store(None, value)
        elif scope == "GLOBAL" or name in self.global_names:
            declared = self.declared.get(name)
            if declared and declared[2] == "CONST":
                raise TypeError(f"{node[1]} is a constant")
            self.global_names[name] = self.store(self.global_keepers.get(name), value)
        else:
            raise NameError(f"line {node[2]}: {node[1]} is not declared")

    def keep_item(self, items: Any, place: int, value: Any, target: Node) -> None:
        if self.is_typed:
            self.keep_type(str(target[1]), items[place], value)
        items[place] = self.store(KEEPERS["WORD"] if self.has_words and type(value) is int else None, value)

    def keep_field(self, members: Any, name: str, key: str, value: Any) -> None:
        """key: the name as the language compares it."""
        if not isinstance(members, dict):  # a static of a block of the controller's own
            members.set_static(name, value)
        else:
            members[name if isinstance(members, Union) else key] = self.store(None, value)

    def keep_type(self, name: str, before: Any, value: Any) -> None:
        """URScript: "The type of a variable is deduced from the first assignment of the variable" (script manual, 1.3)."""
        if type(before) is not type(value):
            raise TypeError(f"{name} is {type(before).__name__}, not {type(value).__name__}")

    # -- calls

    def instance(self, key: str, variables: dict[str, Any]) -> Any:
        """Return a block that is called by its variable's name, else None."""
        found = variables.get(key, self.global_names.get(key))
        return found if hasattr(found, "call") else None

    def use(self, key: str, arguments: list[Node], frame: Frame) -> Any:
        """Call what the controller brings along."""
        if key not in self.library:
            raise NameError(f"{key} is neither a routine nor known to the controller")
        return self.library[key](self, arguments, frame)

    def call_routine(self, routine: Routine, /, *arguments: Any, **named: Any) -> Any:
        """Call it with arguments in their order, or by name."""
        given: Any = named or arguments
        if len(given) != len(routine.parameters):
            raise TypeError(f"{routine.name}: {len(given)} arguments, {len(routine.parameters)} are wanted")
        declared = self.declared_by(routine)
        variables = dict(declared.plain)
        for k, (name, keep) in enumerate(declared.parameters):
            variables[name] = self.store(keep, named[name] if named else arguments[k])
        for name, kind, initial in declared.made:
            variables[name] = self.fresh(kind, initial)
        returned = self.run_body(routine, Frame(variables, declared))
        if returned:
            return returned[0]
        return variables.get(declared.result) if declared.result else None

    def run_body(self, routine: Routine, frame: Frame) -> tuple[Any] | None:
        """Return what a RETURN has given, None at the body's end."""
        self.called.add(routine.name)
        use = "" if self.switch is None else "watched"
        try:
            return code_of(routine.body, self.fold, use)(self, frame)  # type: ignore[no-any-return]
        except RapidError as error:
            if not routine.handler:
                raise
            self.global_names["ERRNO"] = str(error)
            try:
                return code_of(routine.handler, self.fold, use)(self, frame)  # type: ignore[no-any-return]
            except RapidError as second:
                raise TaskStopped(f"{second} in the ERROR handler of {routine.name}") from None

    def start(self, name: str, *arguments: Any) -> Any:
        """Call a routine from outside."""
        self.steps = 0
        return self.call_routine(self.routines[self.key(name)], *arguments)
