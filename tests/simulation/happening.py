"""What one event does to the gateway, its masters, its wires and its machine."""

from typing import TYPE_CHECKING

from tests.simulation.draws.event import Event
from tests.simulation.kernel.cables import CABLES
from tests.simulation.kernel.edges import SimulatedDisk
from tests.simulation.kernel.spoiled import Spoil
from tests.simulation.masters.bus_master import BUSES
from tests.simulation.masters.spelling import ENABLE
from tests.simulation.masters.tcp_master import PULL, RUNS, TAKE, Master

if TYPE_CHECKING:
    from tests.simulation.schedule import Simulation

DISKS = {
    "disk_free": "",
    "disk_full": "full",
    "disk_broken": "broken",
    "disk_read_only": "read-only",
    "disk_stumbles": "once",
}
COMMANDS = {"hold": ENABLE, "hold_on": ENABLE, "take": ENABLE | TAKE, "pull": ENABLE | PULL}


def happen(simulation: "Simulation", event: Event) -> None:
    if event.whom in simulation.masters:
        if event.what == "hold_on":
            simulation.held_force.expect(event.numbers[0], simulation.clock.now_s)
        _command(simulation.masters[event.whom], event)
    elif event.whom in simulation.integrators:
        getattr(simulation.integrators[event.whom], event.what)(*event.numbers)
    elif event.whom == "person":
        simulation.person.say(event.data)
    elif event.whom == "world" and event.what == "sim":
        if simulation.service.is_serving:
            simulation.around.set_as_asked(event.data, simulation.person.say)
    elif event.whom == "world":
        simulation.around.set_fault(event.what, on=bool(event.numbers[0]))
    elif event.whom == "crowd":
        simulation.crowd.connect(*map(int, event.numbers))
    elif event.whom == "machine":
        _shake(simulation, event)
    else:
        _touch_line(simulation, event)


def _command(master: Master, event: Event) -> None:
    if event.what == "drive":
        master.hold(0.0, way=event.way, voltage_v=event.numbers[0])
    elif event.what in COMMANDS:
        control = COMMANDS[event.what]
        if "valve" in CABLES and round(100 * event.numbers[0]) % 2:
            control ^= PULL  # where it can be pulled, half of all commands do
        master.hold(event.numbers[0], control, event.way)
    elif event.what in RUNS:
        master.run(event.what)
    elif event.what == "ask":
        master.ask(event.data, *map(int, event.numbers))
    elif event.data:
        getattr(master, event.what)(event.data)
    else:
        getattr(master, event.what)(*event.numbers)


def _shake(simulation: "Simulation", event: Event) -> None:
    if event.what == "kill":
        simulation.service.kill_control()
    elif event.what in ("kill_guardian", "power_cut"):
        _kill_guardian(simulation, is_power_cut=event.what == "power_cut")
    elif event.what == "terminate":
        simulation.service.terminate()
    elif event.what in ("stop", "freeze") and simulation.service.is_guarded:
        if event.what == "freeze":
            _freeze(simulation, event.numbers[0])
        simulation.service.stop_control(event.numbers[0])
        simulation.observer.history.awoken.append(simulation.clock.now_s + event.numbers[0])
        simulation.observer.history.frozen.append(simulation.clock.now_s - simulation.period_s)
        if event.numbers[0] > simulation.observer.bounds.stall_s:
            simulation._lose_control()
    elif event.what == "stop_guardian":
        _stop_guardian(simulation, event.numbers[0])
    elif event.what == "no_process":
        simulation.service.refuse_processes(event.numbers[0])
    elif event.what == "clock_jump":
        simulation.clock.jump_s += event.numbers[1]
    elif event.what == "disk_hung":
        SimulatedDisk.is_hung = True
    elif event.what in DISKS:
        SimulatedDisk.fails = DISKS[event.what]
        SimulatedDisk.go_on()


def _freeze(simulation: "Simulation", duration_s: float) -> None:
    """Whoever comes back from a standstill must not go on as if nothing had been."""
    _stop_guardian(simulation, duration_s)
    if duration_s > simulation.observer.bounds.stall_s + 2.0 * simulation.period_s:
        thaws_s = simulation.clock.now_s + duration_s
        simulation.outside.call_at(thaws_s, simulation.observer.note_disabled, thaws_s)


def _stop_guardian(simulation: "Simulation", duration_s: float) -> None:
    """Nobody looks after a control that is gone or stands still until it goes on: two faults at a time."""
    simulation.service.stop_guardian(duration_s)
    if simulation.observer.control_lost_s is not None:
        simulation.observer.control_lost_s = max(simulation.observer.control_lost_s, simulation.service.thaws_s)


def _kill_guardian(simulation: "Simulation", *, is_power_cut: bool) -> None:
    """Control learns of it at once, and ends with the safe voltage. Where it stands still itself that is two faults at a
    time, for which the device has its watchdog, as for a power cut under pressure."""
    if is_power_cut:
        is_rest = simulation.observer.is_safe and CABLES["output"].through_s <= simulation.clock.now_s
        if simulation.service.is_serving and is_rest:
            simulation.service.cut_power()
    elif simulation.service.is_serving:
        simulation.service.kill_guardian()
        simulation.observer.history.cuts.append(simulation.clock.now_s)
        simulation.observer.note_disabled(simulation.clock.now_s)


def _touch_line(simulation: "Simulation", event: Event) -> None:
    if event.whom not in CABLES:
        return  # a rig without a valve
    if event.what == "pull":
        simulation.around.pull(event.whom)
        if event.whom in BUSES:  # what it has asked may have been done, and its answer is lost
            simulation.masters[BUSES[event.whom]].lose()
    elif event.what == "push":
        simulation.around.push(event.whom)
    elif event.what == "deaf":
        simulation.around.deafen(on=bool(event.numbers[0]))
    elif event.what == "say":
        CABLES[event.whom].say(event.data)
    elif event.what == "power":
        simulation.around.lose_power(*event.numbers)
    elif event.what == "pace":
        simulation.around.cell_pace = event.numbers[0]
    elif event.what == "unit":
        CABLES[event.whom].reworded = (b"kg", event.data)
    else:
        count, number = event.numbers
        CABLES[event.whom].spoil(Spoil(event.what, int(count), number, event.data))
