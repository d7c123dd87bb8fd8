"""What registers and notes say of the two watchdogs below control: the guardian, and the output device's own."""

from collections.abc import Callable
from typing import Final

from gateway.control.inputs import LineStatus
from gateway.control.supervision.fault_detection import line_words
from gateway.profiles import Rig
from gateway.registers.words import WatchdogBit
from gateway.service.running_rig.lines.cell_identity import CellIdentity
from gateway.service.running_rig.lines.device_checks import DeviceChecks
from gateway.service.running_rig.lines.output_line import OutputExchange
from gateway.service.running_rig.lines.rig_ports import RigPorts

# plain integers, for it is asked at every tick
_GUARDIAN_WATCHES, _DEVICE_ARMED = int(WatchdogBit.GUARDIAN_WATCHES), int(WatchdogBit.DEVICE_ARMED)
_FORGOTTEN: Final = (
    "W249 the output device said that its watchdog is off or has another time: it had no power, or somebody set it"
)
_UNARMED: Final = "W251 the output device's watchdog does not arm, and the rig accepts that"
_DEVICE_HAS_NONE, _DEVICE_TRIPPED = int(WatchdogBit.DEVICE_HAS_NONE), int(WatchdogBit.DEVICE_TRIPPED)


def watchdog_word(rig: Rig, ports: RigPorts, line: OutputExchange) -> int:
    """Return the register `watchdogs`."""
    word = _GUARDIAN_WATCHES if ports.is_guarded else 0
    checks = line.checks
    if not checks.has_watchdog:
        return word | (_DEVICE_HAS_NONE if rig.accept_no_device_watchdog else 0)
    if checks.is_tripped:
        word |= _DEVICE_TRIPPED
    return word | (_DEVICE_ARMED if checks.is_armed else 0)


class WatchdogRegister:
    """Keeps the register `watchdogs`, and tells where the device had forgotten its arming, or does not arm where the rig
    accepts that. show: writes the register."""

    def __init__(self, line: OutputExchange, show: Callable[[int], None], log: Callable[[str, str], None]) -> None:
        self._checks, self._show, self._log = line.checks, show, log
        self._shown, self._told = -1, 0
        self._is_unarmed_told = False

    def follow(self, word: int) -> None:
        """Show the word where it has changed; at each tick."""
        if word != self._shown:
            self._shown = word
            self._show(word)
        if self._checks.times_forgotten != self._told:
            self._told = self._checks.times_forgotten
            self._log("device", f"{_FORGOTTEN}; it is being armed again")
        if self._checks.unarmed and not self._is_unarmed_told:
            self._log("device", f"{_UNARMED}: {self._checks.unarmed}")
        # a port that is opened again asks anew: told again only once it has been armed
        self._is_unarmed_told = (self._is_unarmed_told or bool(self._checks.unarmed)) and not self._checks.is_armed


def device_fault_note(checks: DeviceChecks | CellIdentity) -> str:
    """Return what the start says of a device that is not what it should be, or whose watchdog keeps it."""
    return f"{checks.fault.code} {line_words(LineStatus(fault=checks.fault, said=checks.said))}"
