"""The runs of the demo rig on the twin: ladder, minor loops, and the steps behind them."""

from collections.abc import Iterable

import numpy as np

from gateway.bsfm.ladder.measured_ladder import Ladder, ladder_plan
from gateway.bsfm.ladder.settled_points import find_settled_points
from gateway.bsfm.model import Bsfm, Response
from gateway.bsfm.response.identification import measure_response
from gateway.bsfm.response.step_responses import RecordedRun
from gateway.bsfm.slip.slip_fit import Walk
from gateway.control.runs.ladder_stairs import RESPONSE_SHARES
from gateway.devices import output_host
from gateway.devices.messages import SetVoltage
from gateway.profiles import load_rig
from gateway.twin import Plant, Twin
from gateway.twin.experiment import Dwell, staircase

RIG = "demo"
STEP_HELD_S, SAMPLE_S, REST_STAIRS = 1.5, 0.01, 21
TOP_V, STEP_V, GROUPS = 8.0, 0.1, 5
READ_ONCE, READ_WELL = Dwell(readings=1), Dwell(readings=5)
TURNS_V = (0.0, 7.0, 2.0, 5.0, 3.0, 4.5, 1.0, 6.0, 3.5, 5.5, 0.5, 2.5, 1.5, 3.0)  # partial reversals of all sizes
OTHER_TURNS_V = (0.0, 6.5, 3.5, 5.0, 1.5, 4.0, 2.5, 7.5, 5.5, 6.5)  # for the validation


def conditioned_twin(plant: Plant, seed: int) -> Twin:
    """Return a twin whose friction remembers a full cycle, as in every group of a ladder but the first."""
    twin = Twin(plant, seed)
    for voltage_v in (TOP_V, 0.0):
        twin.command(voltage_v)
        twin.advance(1.5)
    return twin


def run_ladder(plant: Plant, seed: int, groups: int) -> Ladder:
    """Climb the ladder on the twin, one reading a stair."""
    plan = ladder_plan(TOP_V, STEP_V, groups)
    force_n = staircase(conditioned_twin(plant, seed), plan.voltage_v, READ_ONCE)
    return Ladder(np.array(plan.voltage_v), force_n, np.array(plan.direction), np.array(plan.group))


def stairs_between(turns_v: Iterable[float], step_v: float = 0.25) -> list[float]:
    """Return even stairs from turn to turn."""
    stairs: list[float] = []
    for turn_v in turns_v:
        start_v = stairs[-1] if stairs else turn_v
        count = max(1, round(abs(turn_v - start_v) / step_v))
        stairs += [start_v + (turn_v - start_v) * (i + 1) / count for i in range(count)]
    return stairs


def run_minor_loops(plant: Plant, seed: int, turns_v: Iterable[float]) -> Walk:
    """Walk through partial reversals."""
    voltages_v = stairs_between(turns_v)
    return Walk(np.array(voltages_v), staircase(conditioned_twin(plant, seed), voltages_v, READ_WELL))


def measure_noise_n(plant: Plant, seed: int) -> float:
    """Return the standard deviation of a reading while the command rests, N, as the stairs of a ladder run show it: read
    every 10 ms, from the share of a dwell that has settled."""
    twin, rows = conditioned_twin(plant, seed), []
    for share in np.linspace(0.0, 1.0, REST_STAIRS).tolist():
        twin.command(share * TOP_V)
        for _ in range(round(STEP_HELD_S / SAMPLE_S)):
            rows.append((SAMPLE_S * len(rows), share * TOP_V, float(twin.read())))
            twin.advance(SAMPLE_S)
    return find_settled_points(*(np.array(column) for column in zip(*rows, strict=True))).noise_n


def run_steps(plant: Plant, seed: int, model: Bsfm) -> Response:
    """Measure the response from the steps that a calibration run ends with, read every 10 ms. A command acts when its last
    byte is through the wire at the demo rig's speed.
    """
    line = load_rig(RIG).output
    wire_s = 10.0 * len(output_host(line.device).request(SetVoltage(TOP_V))) / line.baud
    twin, rows = conditioned_twin(plant, seed), []
    for share in (0.0, *RESPONSE_SHARES * 2):
        for k in range(round(STEP_HELD_S / SAMPLE_S)):
            rows.append((SAMPLE_S * len(rows), share * TOP_V, float(twin.read())))
            if k == 0:
                twin.advance(wire_s)
                twin.command(share * TOP_V)
            twin.advance(SAMPLE_S - wire_s if k == 0 else SAMPLE_S)
    time_s, command_v, force_n = (np.array(column) for column in zip(*rows, strict=True))
    measured = measure_response(RecordedRun(time_s, command_v, force_n), model)
    if measured.response is None:
        raise SystemExit(measured.description)
    return measured.response
