"""The generated C: compiled with gcc, compared bit for bit with the float32 model, and kept near the double model.

gcc is a test tool only. Without it the tests that need it skip, and say what was not proved.
"""

import math
import shutil
from collections.abc import Callable, Iterable
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from gateway.bsfm.c_export.float32_model import ROUNDS_MAX, Code, Float32, Float32Model
from gateway.bsfm.c_export.tables import tables_of
from tests.bsfm.c_export.compiled_c import Library, compile_c
from tests.bsfm.c_export.made_up_calibrations import CASES, HARD, ORDINARY, SLIP

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="NO gcc: the generated C was NOT compared")

LEVELS = ("-O0", "-O2")
POINTS = 1000
INF, NAN = math.inf, math.nan


every_case = pytest.mark.parametrize("name", CASES)
every_level = pytest.mark.parametrize("level", LEVELS)


@cache
def model_of(name: str) -> Float32Model:
    return Float32Model(tables_of(CASES[name]))


def inputs(low: float, high: float, seed: int) -> list[float]:
    """float32 values within and a little beyond the range, both ends and their neighbours, and what is no number."""
    rng = np.random.default_rng(seed)
    ends = [np.float32(end) for end in (low, high)]
    beside = [np.nextafter(end, np.float32(way)) for end in ends for way in (-1e9, 1e9)]
    margin = 0.1 * (high - low)
    spread = rng.uniform(low - margin, high + margin, POINTS)
    numbers: list[float] = np.array([*spread, *ends, *beside, NAN, INF, -INF], np.float32).tolist()
    return numbers


def volts(name: str) -> list[float]:
    model = model_of(name)
    return inputs(float(model.x0), float(model.x1), 1)


def newtons(name: str) -> list[float]:
    model = model_of(name)
    halves = [float(model.rising.half), float(model.falling.half)]
    return inputs(float(model.lowest), float(model.highest), 2) + halves


FUNCTIONS: dict[str, Callable[[str], list[float]]] = {
    "rising_force": volts, "falling_force": volts, "rising_voltage": newtons, "falling_voltage": newtons,
}  # fmt: skip


@cache
def expected(name: str, function: str) -> list[tuple[float, Code]]:
    """What the float32 model answers to all inputs of a function: reckoned once, for both levels."""
    answer = getattr(model_of(name), function)
    return [(float(value), code) for value, code in (answer(Float32(x)) for x in FUNCTIONS[function](name))]


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str], Library]:
    @cache
    def build(name: str, level: str) -> Library:
        return compile_c(tmp_path_factory.mktemp(name), name, level)

    return build


def bits(answers: Iterable[tuple[float, int]]) -> list[tuple[int, int]]:
    """Values by their float32 bits (so that -0 and 0 differ) with their status."""
    values, codes = zip(*answers, strict=True)
    return list(zip(np.array(values, np.float32).view(np.uint32).tolist(), map(int, codes), strict=True))


@pytest.mark.sampled
@needs_gcc
@every_level
@every_case
def test_c_and_its_float32_model_agree_to_the_bit(library, name, level):
    for function, arguments in FUNCTIONS.items():
        result = library(name, level).each(function, ((x,) for x in arguments(name)))
        assert bits(result) == bits(expected(name, function)), function


@pytest.mark.sampled
@needs_gcc
@every_level
@every_case
def test_the_blended_functions_agree_to_the_bit(library, name, level):
    model, rng = model_of(name), np.random.default_rng(5)
    blends = np.array([*rng.uniform(-1, 1, 300), 1, -1, 1.01, -1.01, NAN, INF, 0], np.float32).tolist()
    for function, source in (("voltage", newtons), ("force", volts)):
        rows = [*zip(source(name)[-len(blends) :], blends, strict=True), (NAN, 0.0), (INF, 1.0), (-INF, -1.0)]
        wanted = [getattr(model, function)(Float32(x), Float32(blend)) for x, blend in rows]
        assert bits(library(name, level).each(function, rows)) == bits(wanted), function


def wandering_n(name: str) -> list[float]:
    """Commands that walk, chatter, jump, leave the range and are now and then no number."""
    model, rng = model_of(name), np.random.default_rng(9)
    low, high = float(model.lowest), float(model.highest)
    walk = low + (high - low) * (0.5 + 0.6 * np.sin(np.cumsum(rng.uniform(0.0, 0.3, 600))))
    chatter = 0.5 * (low + high) + 0.05 * rng.choice([-1.0, 1.0], 200)
    rest = [NAN, high, high, INF, low, -INF, 1e30, -1e30, high]
    forces: list[float] = np.array([*walk, *chatter, *walk[:5], *rest], np.float32).tolist()
    return forces


@pytest.mark.sampled
@needs_gcc
@every_level
@every_case
def test_commands_with_reversals_agree_to_the_bit(library, name, level):
    model, forces = model_of(name), wandering_n(name)
    memory = model.reset()
    wanted = [model.command(memory, Float32(force_n)) for force_n in forces]
    build = library(name, level)
    state = build.reset()
    assert bits(build.command(state, forces)) == bits(wanted)
    assert (state.force_n, [*state.memory], state.voltage_v) == (memory.force_n, memory.memory, memory.voltage_v)
    assert build.share(state) == model.branch_share(memory)


@pytest.mark.sampled
@pytest.mark.parametrize("name", ORDINARY)
def test_float32_stays_near_the_double_model(name):
    branches = CASES[name].model().branches
    tolerances = {"rising_force": 1e-4, "falling_force": 1e-4, "rising_voltage": 1e-5, "falling_voltage": 1e-5}
    for function, tolerance in tolerances.items():
        branch = getattr(branches, function.split("_")[0])
        for x, (result, code) in zip(FUNCTIONS[function](name), expected(name, function), strict=True):
            if code is not Code.INVALID:
                wanted = branch.value(x) if function.endswith("force") else branch.inverse(x)[0]
                assert abs(result - wanted) < tolerance, (function, x)


@pytest.mark.parametrize("name", HARD)
def test_on_hard_curves_the_error_is_still_that_of_a_force_rounded_to_float32(name):
    """Where the curve is steep or flat one rounding of x or f moves the other far: that is the curve, not the code."""
    branches = CASES[name].model().branches
    for function in ("rising_voltage", "falling_voltage"):
        branch = getattr(branches, function.split("_")[0])
        for x, (result, code) in zip(newtons(name), expected(name, function), strict=True):
            if code is Code.OK:
                steepness = max(branch.slope(branch.inverse(x)[0]), branch.slope(result))
                assert abs(branch.value(result) - x) < 1e-5 + 1e-6 * steepness, x


def test_newton_needs_far_fewer_rounds_than_it_may_take():
    for name in CASES:
        for function in FUNCTIONS:
            expected(name, function)
        assert model_of(name).rounds_max <= ROUNDS_MAX // 3


@pytest.mark.sampled
@needs_gcc
@every_case
def test_what_goes_in_as_volts_comes_back_as_volts(library, name):
    build, model = library(name, "-O2"), model_of(name)
    for branch in ("rising", "falling"):
        curve = getattr(CASES[name].model().branches, branch)
        places = np.linspace(float(model.x0), float(model.x1), 200).astype(np.float32)[1:-1].tolist()
        forces = [force_n for force_n, _ in build.each(f"{branch}_force", ((x,) for x in places))]
        for x, (back, _) in zip(places, build.each(f"{branch}_voltage", ((f,) for f in forces)), strict=True):
            assert abs(back - x) < 3e-6 + 2e-5 / max(curve.slope(x), 0.05)


@needs_gcc
def test_nan_and_infinity_hold_the_last_voltage_and_change_nothing(library):
    build = library("demo", "-O2")
    ((before, _),) = build.command(state := build.reset(), [20.0])
    memory = bytes(state)
    assert build.command(state, [NAN, INF, -INF]) == [(before, Code.INVALID)] * 3
    assert bytes(state) == memory
    assert build.each("rising_voltage", [(NAN,), (INF,)]) == [(0.0, Code.INVALID)] * 2


DAMAGES = ("memory nan", "memory 1.5", "force_n nan", "force_n inf", "force_n -5", "voltage_v nan", "voltage_v 9")


@needs_gcc
@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_state_gives_the_lowest_voltage(library, damage):
    build = library("demo", "-O2")
    build.command(state := build.reset(), [30.0])
    field, value = damage.split()
    if field == "memory":
        state.memory[build.stops - 1] = float(value)
    else:
        setattr(state, field, float(value))
    assert build.command(state, [30.0]) == [(0.0, Code.INVALID)]
    assert build.command(build.reset(), [30.0])[0][1] == Code.OK


@needs_gcc
def test_a_command_beyond_the_range_is_remembered_as_the_end_it_reached(library):
    build = library("demo", "-O2")
    state = build.reset()
    assert build.command(state, [1e30])[0] == (8.0, Code.HIGH)
    build.command(state, [float(model_of("demo").highest)])
    assert build.share(state) == 1.0


@needs_gcc
@pytest.mark.parametrize("name", ["order_2", "demo", "stiffest_stops", "stops_of_order_15"])
def test_chatter_neither_drifts_nor_jumps(library, name):
    """A closed loop of commands ends where it began, as in double, however often it is gone round."""
    build = library(name, "-O2")
    build.command(state := build.reset(), [30.0, 25.0, 28.0, 27.95])
    ((first_v, _),) = build.command(state, [28.0])
    first = build.share(state)
    voltages = [v for v, _ in build.command(state, [27.95, 28.0] * 20_000)]
    assert abs(build.share(state) - first) < 1e-4
    assert abs(voltages[-1] - first_v) < 1e-4
    assert max(voltages) - min(voltages) < 0.05


@needs_gcc
def test_a_delta_that_is_no_number_moves_no_blend(library):
    build = library("order_2", "-O2")
    assert [build.blend(0.25, delta) for delta in (NAN, INF, -INF, 0.0)] == [0.25] * 4
    half_n = ORDINARY["order_2"].blend_span_n / 2
    assert build.blend(0.25, 100.0) == 1.0 and build.blend(-1.0, half_n) == 0.0


def along_n(name: str) -> list[float]:
    """Reversals of all sizes within what both branches reach."""
    low_n, high_n = CASES[name].model().force_range_n
    rng = np.random.default_rng(3)
    turns = low_n + (high_n - low_n) * rng.uniform(0.02, 0.98, 60)
    paths = [np.linspace(a, b, 5)[1:] for a, b in pairwise(turns)]
    forces: list[float] = np.concatenate(paths).astype(np.float32).tolist()
    return forces


@pytest.mark.sampled
@pytest.mark.parametrize("name", [*SLIP, "demo", "order_2", "order_15"])
def test_commands_with_reversals_stay_near_the_double_model(name):
    model, single = CASES[name].model(), model_of(name)
    state, memory = single.reset(), model.reversal.start()
    last_n = float(single.lowest)
    for force_n in along_n(name):
        memory = model.memory_after(memory, last_n, force_n)
        last_n = force_n
        wanted_v, _ = model.voltage_v(force_n, model.branch_share(memory))
        assert abs(float(single.command(state, Float32(force_n))[0]) - wanted_v) < 2e-5


@pytest.mark.sampled
@needs_gcc
@every_case
def test_each_passes_its_own_self_test(library, name):
    build = library(name, "-O0")
    assert build.loaded[f"{build.prefix}_self_test"]() == 0
