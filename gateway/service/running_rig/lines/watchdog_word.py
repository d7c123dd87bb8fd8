"""What registers and notes say of the two watchdogs below control: the guardian, and the output device's own."""

from gateway.control.inputs import LineStatus
from gateway.control.supervision.fault_detection import line_words
from gateway.profiles import Rig
from gateway.registers.words import WatchdogBit
from gateway.service.running_rig.lines.output_line import OutputExchange
from gateway.service.running_rig.lines.rig_ports import RigPorts


def watchdog_word(rig: Rig, ports: RigPorts, line: OutputExchange) -> int:
    """Return the register `watchdogs`."""
    word = WatchdogBit.GUARDIAN_WATCHES if ports.is_guarded else WatchdogBit(0)
    checks = line.checks
    if not checks.has_watchdog:
        return int(word | (WatchdogBit.DEVICE_HAS_NONE if rig.accept_no_device_watchdog else WatchdogBit(0)))
    if checks.is_tripped:
        word |= WatchdogBit.DEVICE_TRIPPED
    return int(word | (WatchdogBit.DEVICE_ARMED if checks.is_armed else WatchdogBit(0)))


def device_fault_note(line: OutputExchange) -> str:
    """Return what the start says of a device that is not what it should be, or whose watchdog keeps it."""
    fault = line.checks.fault
    return f"{fault.code} {line_words(LineStatus(fault=fault, said=line.checks.said))}"
