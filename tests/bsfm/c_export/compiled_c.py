"""The generated C as a shared library, called with the names of its float32 model."""

import ctypes
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gateway.bsfm.c_export.code import c_source
from tests.bsfm.c_export.made_up_calibrations import CASES

STRICT = (
    "-std=c99 -Wall -Wextra -Werror -pedantic -Wconversion -Wdouble-promotion -Wfloat-equal -Wshadow "
    "-Wstrict-prototypes -Wmissing-prototypes -Wcast-qual -Wundef"
).split()
EXACT = "-ffp-contract=off"


def state_of(stops: int) -> type[ctypes.Structure]:
    """The caller-owned struct; memory is the blend where there are no stops."""
    memory = ctypes.c_float * max(1, stops)

    class State(ctypes.Structure):
        _fields_ = (("force_n", ctypes.c_float), ("memory", memory), ("voltage_v", ctypes.c_float))

    return State


@dataclass
class Library:
    """The compiled C with the model's function names; each call gives (value, status)."""

    loaded: ctypes.CDLL
    prefix: str
    stops: int

    def each(self, function: str, rows: Iterable[tuple[float, ...]], *first: object) -> list[tuple[float, int]]:
        answers, result = [], ctypes.c_float()
        call = self.loaded[f"{self.prefix}_{function}"]
        for row in rows:
            code = call(*first, *map(ctypes.c_float, row), ctypes.byref(result))
            answers.append((result.value, code))
        return answers

    def reset(self) -> Any:
        state = state_of(self.stops)()
        self.loaded[f"{self.prefix}_reset"](ctypes.byref(state))
        return state

    def command(self, state: Any, forces_n: Iterable[float]) -> list[tuple[float, int]]:
        return self.each("command", ((force_n,) for force_n in forces_n), ctypes.byref(state))

    def share(self, state: Any) -> float:
        call = self.loaded[f"{self.prefix}_share"]
        call.restype = ctypes.c_float
        return float(call(ctypes.byref(state)))

    def blend(self, blend: float, delta_n: float) -> float:
        call = self.loaded[f"{self.prefix}_blend"]
        call.restype = ctypes.c_float
        return float(call(ctypes.c_float(blend), ctypes.c_float(delta_n)))


def compile_c(directory: Path, name: str, level: str) -> Library:
    for file, text in c_source(CASES[name]).items():
        (directory / file).write_text(text, encoding="ascii")
    prefix = file.removesuffix(".c")
    command = ["gcc", *STRICT, level, EXACT, "-shared", "-fPIC", "-o", "code.so", f"{prefix}.c", "-lm"]
    done = subprocess.run(command, cwd=directory, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return Library(ctypes.CDLL(str(directory / "code.so")), prefix, len(CASES[name].slip_radii_v))
