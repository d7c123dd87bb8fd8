"""How far the float32 code is from the double model, measured at export, and the record that the C tests itself with.

The self-test compares with the double model instead of bits of the float32 model: a compiler that fuses multiply and
add is no fault. Its tolerance is four times what the float32 model was measured to be off, so that it scales with the
calibration.
"""

from dataclasses import dataclass
from math import floor, log10

from gateway.bsfm.branches import Branches
from gateway.bsfm.c_export.float32_model import Float32, Float32Model
from gateway.bsfm.c_export.tables import Tables, round_to_float32
from gateway.bsfm.model import Bsfm, Calibration

POINTS = 17
GRID = 128  # a multiple of POINTS - 1, so that the points of the table are measured too
WORST_SHARE = 1.0e-3  # of the range: beyond it float32 does not describe the calibration
MARGIN = 4.0


@dataclass(frozen=True, slots=True)
class SelfTest:
    """What the generated C checks of itself. points: (V, N rising, N falling); reversals: (N commanded, V); errors as
    measured, tolerances as allowed.
    """

    points: tuple[tuple[float, float, float], ...]
    reversals: tuple[tuple[float, float], ...]
    error_n: float
    error_v: float
    tolerance_n: float
    tolerance_v: float


def self_test_of(calibration: Calibration, tables: Tables) -> SelfTest:
    """Return the test points of a calibration with the errors of float32 on them. ValueError if float32 cannot follow it."""
    branches, single = calibration.model().branches, Float32Model(tables)
    grid = tuple(_point(branches, tables, i / GRID) for i in range(GRID + 1))
    reversals = tuple(_replay(Bsfm(branches, calibration.reversal), tables))
    error_n = max(_force_error_n(single, point) for point in grid)
    error_v = max(*(_voltage_error_v(single, point) for point in grid), _reversal_error_v(single, reversals))
    low_n, high_n = tables.reached_n
    if not (error_n <= WORST_SHARE * (high_n - low_n) and error_v <= WORST_SHARE * tables.x_span_v):
        raise ValueError(
            f"float32 cannot follow this calibration: off by {error_n:.2g} N and {error_v:.2g} V; "
            "a branch is too flat or its weights are too far apart"
        )
    return SelfTest(
        points=grid[:: GRID // (POINTS - 1)],
        reversals=reversals,
        error_n=error_n,
        error_v=error_v,
        tolerance_n=_tolerance(error_n, max(abs(low_n), abs(high_n))),
        tolerance_v=_tolerance(error_v, max(abs(tables.x0_v), abs(tables.x1_v))),
    )


def _point(branches: Branches, tables: Tables, share: float) -> tuple[float, float, float]:
    voltage_v = tables.x1_v if share == 1.0 else round_to_float32(tables.x0_v + tables.x_span_v * share)
    return (
        voltage_v,
        round_to_float32(branches.rising.value(voltage_v)),
        round_to_float32(branches.falling.value(voltage_v)),
    )


def _force_error_n(single: Float32Model, point: tuple[float, float, float]) -> float:
    voltage_v, rising_n, falling_n = point
    forces = single.rising_force(Float32(voltage_v))[0], single.falling_force(Float32(voltage_v))[0]
    return max(abs(float(forces[0]) - rising_n), abs(float(forces[1]) - falling_n))


def _voltage_error_v(single: Float32Model, point: tuple[float, float, float]) -> float:
    voltage_v, rising_n, falling_n = point
    voltages = single.rising_voltage(Float32(rising_n))[0], single.falling_voltage(Float32(falling_n))[0]
    return max(abs(float(voltages[0]) - voltage_v), abs(float(voltages[1]) - voltage_v))


def _reversal_error_v(single: Float32Model, reversals: tuple[tuple[float, float], ...]) -> float:
    state = single.reset()
    return max(abs(float(single.command(state, Float32(n))[0]) - v) for n, v in reversals)


def _replay(model: Bsfm, tables: Tables) -> list[tuple[float, float]]:
    """What the double model answers to a rise, partial reversals, loops within loops, a full fall and a repetition."""
    last_n, memory = tables.reached_n[0], model.reversal.start()
    record = []
    for force_n in map(round_to_float32, _commands_n(tables)):
        memory = model.memory_after(memory, last_n, force_n)
        last_n = force_n
        record.append((force_n, round_to_float32(model.voltage_v(force_n, model.branch_share(memory))[0])))
    return record


def _commands_n(tables: Tables) -> tuple[float, ...]:
    low_n, high_n = tables.shared_n
    range_n = high_n - low_n
    step = 0.05 if tables.radii_v else min(tables.blend_span_n / 4 / range_n, 0.2)
    shares = (0.3, 0.7, 0.7 - step, 0.7 - 2 * step, 0.7 - step, 0.55, 0.64, 0.6, 0.66, 0.1, 0.9, 0.4, 0.4)
    return tuple(low_n + share * range_n for share in shares)


def _tolerance(error: float, size: float) -> float:
    """One digit, rounded up; four roundings of the largest number at least."""
    allowance = max(MARGIN * error, size * 2.0**-22)
    digit = 10.0 ** floor(log10(allowance))
    return digit * (floor(allowance / digit) + 1)
