"""After each schedule everything is healed; one reset later the force must be in its band within 2 s (I13)."""

from typing import TYPE_CHECKING

from tests.simulation.draws.events import FAULTS, VALVE_FAULTS
from tests.simulation.kernel.cables import CABLES
from tests.simulation.kernel.edges import SimulatedDisk
from tests.simulation.masters.spelling import write_one_pdu

if TYPE_CHECKING:
    from tests.simulation.schedule import Simulation

HELD_N = 12.0
HEAL_S, SWITCH_S = 2.0, 0.3
"""SWITCH_S: for which a valve that goes to the other side keeps the force waiting."""
IN_BAND_N = 1.0
RATE_S, LEAST_RATE = 0.6, 0.45
"""For so long the devices' answers are counted, and of so many as at first there must be so many at least: a cell that is
asked at its own rate waits for a tick where its answer comes just before it is due, half of the time then (seed 226620)."""
ANSWER_S = 0.02
LOOKING_S = 3.0
"""What is plugged in is looked for, and a guardian started again, every 2 s at the most."""
FIRST_WORDS_S = 3.5
"""So long a start waits for the first words of a device that obeys nothing until a person resets; then it serves."""
MOST_OFF_N = 0.5
"""By how much a healthy cell may read another force at rest than at first, until the zero is taken anew."""
TARES, TARE_S, LIFT_S, LOOKED_AT = 5, 0.3, 1.3, 21
"""Two readings that differ too much refuse it as long as both are looked at, 20 at once: of a slow cell that is longer."""


def heal(simulation: "Simulation") -> None:
    """Repair everything, reset, hold a force, and note where it does not come."""
    _repair(simulation)
    simulation._run_for(LOOKING_S)
    until_s = simulation.clock.now_s + LOOKING_S + FIRST_WORDS_S  # it may have been stopped amid a start
    while not simulation.service.is_serving and simulation.clock.now_s < until_s:
        simulation._run_for(0.1)
    healer = simulation.masters["healer"]
    healer.reset(take=True)
    simulation._run_for(0.1)
    for _ in range(TARES):
        if _is_zero_off(simulation):  # somebody has tared while the cell was broken; noise may refuse one of these
            _tare(simulation)
    healer.hold(HELD_N)
    if simulation.observer.history.has_valve:
        simulation._run_for(SWITCH_S)
    simulation._run_for(HEAL_S - RATE_S)
    rates = count_answers(simulation)
    for line, count in simulation.rates.items():
        if rates[line] < LEAST_RATE * count:
            words = f"I13: {line} answers {rates[line]} times in {RATE_S:g} s, {count} times at first"
            simulation.observer.broken.append(words)
    error_n = simulation._read_force_n() - HELD_N
    if not abs(error_n) <= IN_BAND_N:
        words = f"{error_n:+.2f} N off {HEAL_S:g} s after healing; {list(simulation.log.lines)[-4:]}"
        simulation.observer.broken.append(f"I13: {words}")


def _tare(simulation: "Simulation") -> None:
    """Where the safe voltage presses, the tool is lifted for it."""
    is_lifted = simulation.observer.bounds.safe_v > 0.0
    lift_s = max(LIFT_S, LOOKED_AT * (simulation.around.cell_s or 0.0))
    if is_lifted:
        simulation.around.set_fault("no-contact", on=True)
        simulation._run_for(lift_s)
    simulation.masters["healer"].tare()
    simulation._run_for(TARE_S)
    if is_lifted:
        simulation.around.set_fault("no-contact", on=False)
        simulation._run_for(lift_s)


def count_answers(simulation: "Simulation") -> dict[str, int]:
    """Return how many answers each device gives in the next RATE_S."""
    before = {line: cable.answers for line, cable in CABLES.items()}
    simulation._run_for(RATE_S)
    return {line: CABLES[line].answers - count for line, count in before.items()}


def _repair(simulation: "Simulation") -> None:
    for name in (*FAULTS, *VALVE_FAULTS):
        simulation.around.set_fault(name, on=False)
    simulation.around.simulate({"do": "sim", "clear_all": True})
    simulation.around.cell_pace = 1.0
    CABLES["load_cell"].reworded = (b"", b"")
    simulation.around.deafen(on=False)
    for line, cable in CABLES.items():
        simulation.around.push(line)
        cable.spoil()
    SimulatedDisk.fails = ""
    SimulatedDisk.go_on()
    simulation.service.refuse_processes(0.0)
    simulation.crowd.leave()
    for master in simulation.masters.values():
        master.fall_silent()
        master.disconnect()
    simulation.masters["healer"].ask(write_one_pdu(0, 0))  # a run that somebody at the machine looks at ends by this


def _is_zero_off(simulation: "Simulation") -> bool:
    rest_n = simulation.rest_n
    return rest_n is not None and abs(simulation._read_force_n() - rest_n) > MOST_OFF_N
