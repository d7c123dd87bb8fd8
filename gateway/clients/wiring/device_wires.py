"""How the shipped devices are wired: interface, terminals, switches, each with the page that says so.

A fact that no public page was found for is not guessed: the page then says that the device's manual has it.
"""

from dataclasses import dataclass
from typing import Final

RS232: Final = "RS-232"
RS485: Final = "RS-485, two wires"
RS485_4: Final = "RS-485, four wires"
EITHER: Final = "RS-232 or RS-485, as ordered"
CHIP: Final = "USB or the UART of a microcontroller"
UNKNOWN: Final = "not known here (RS-232, RS-485 or a USB plug of its own): see the device's manual"


@dataclass(frozen=True)
class Wires:
    """One device. interface: one of those above; terminals: what is connected to what; switches: DIP switches, jumpers,
    settings; source: where that is said, empty for what is not documented in public."""

    interface: str
    terminals: tuple[str, ...] = ()
    switches: tuple[str, ...] = ()
    source: str = ""


_RS232_RULE: Final = (
    "Adapter's DB9 (male): 2 RxD <- the device's TxD, 3 TxD -> the device's RxD, 5 GND - GND; no handshake lines. Silent both "
    "ways? Exchange 2 and 3."
)
_RS485_PAIR: Final = (
    "A twisted pair, + to + and - to - (D+, DATA+, often B; D-, DATA-, often A), and the reference wire (GND, C). Makers "
    "differ in what they call A and B: silent? Exchange the two."
)
_RS485_ENDS: Final = (
    "120 ohm at both ends of the line and nowhere between; below 10 m it works without. One place gives the idle level (bias), "
    "usually the adapter."
)
_RS485_FOUR: Final = (
    "Two twisted pairs, crossed: the adapter's TA, TB to the device's RA, RB, and its RA, RB to the device's TA, TB; ground "
    "to ground."
)
_CHIP: Final = (
    "Its USB cable; or its UART: TX to the adapter's RX, RX to its TX, GND to GND, at the chip's level (3.3 V or 5 V). RS-232 "
    "levels destroy it."
)
GENERAL: Final[dict[str, tuple[str, ...]]] = {
    RS232: (_RS232_RULE,),
    RS485: (_RS485_PAIR, _RS485_ENDS),
    RS485_4: (_RS485_FOUR,),
    EITHER: (f"RS-232: {_RS232_RULE}", f"RS-485: {_RS485_PAIR}", _RS485_ENDS),
    CHIP: (_CHIP,),
    UNKNOWN: (f"RS-232: {_RS232_RULE}", f"RS-485: {_RS485_PAIR}", _RS485_ENDS),
}
"""What holds for every device with this interface."""

_INIT: Final = (
    "INIT* to GND at power-on (or the INIT switch of newer modules): address 00, 9600 8N1, no checksum, whatever is stored. "
    "Change baud or checksum only in this state; then remove it and power up again."
)
_ADAM: Final = Wires(RS485, ("DATA+, DATA-, GND, +Vs.",), (_INIT,), "ADAM-4000 User's Manual, chapter 2.3, page 2-9")
_ICPDAS: Final = Wires(
    RS485,
    ("DATA+, DATA-, GND, +Vs; the output at VOUT (of the channel), not IOUT.",),
    (_INIT,),
    "I-7021, I-7022, I-7024 User Manual Rev B1.2, chapters 1.4 and 3.7",
)
_AED: Final = Wires(
    RS485_4,
    ("AED9101: TA, TB, RA, RB, GND.",),
    (
        "AED9101D, RS-485 with four wires or RS-422: S1 to S5 left, S6 right.",
        "Bus termination right (ON) at the last AED of the line, and always with RS-422.",
        "Two wires are possible, but then a stream cannot be stopped: four are preferred.",
    ),
    "AED9101D mounting instructions I3563-1.0, chapter 6.3, pages 22 to 24",
)
_BY_NAME: Final[dict[str, Wires]] = {
    "smc-itv-rc": Wires(RS232),
    "stream-st-gs": Wires(
        EITHER, (), ("In the indicator's menu: continuous output, format ST,GS, the baud and frame named here.",)
    ),
    "adam-4024": _ADAM,
    "adam-4016": _ADAM,
    "icpdas-702x": _ICPDAS,
    "icpdas-7024": _ICPDAS,
    "alicat-pc": Wires(
        EITHER,
        (
            "8-pin Mini-DIN, RS-232: 3 is its input (from TxD, DB9 pin 3), 5 its output (to RxD, pin 2), 8 ground (pin 5).",
            "8-pin Mini-DIN, RS-485: 3 is -, 5 is +. 7 is the supply, 8 ground of all; pins 1 to 6 bear no supply.",
        ),
        (),
        "Alicat MC series operating manual, page 14, standard 8-pin Mini-DIN; other connectors: alicat.com/pinout",
    ),
    "waveshare-relay": Wires(
        RS485,
        (
            "A to A, B to B. Relay 1: COM and NO in the supply of the valve's coil; a DC coil needs its free-wheeling diode.",
        ),
        ("Baud and address are set by Modbus commands; 9600 8N1, address 1 as delivered.",),
        "waveshare.com/wiki/Modbus_RTU_Relay",
    ),
    "waveshare-ao8b": Wires(
        RS485,
        ("A to A, B to B. AO1, the first of its eight, against AGND; a supply of 15 V or more for 10 V out.",),
        ("Baud and address are set by Modbus registers; 9600 8N1, address 1 as delivered.",),
        "waveshare.com/wiki/Modbus_RTU_Analog_Output_8CH_(B)",
    ),
    "laumas-tlb": Wires(
        RS485, (), ("In the instrument's menu: protocol Modbus RTU, and the baud, frame and address named here.",)
    ),
    "hbm-aed": _AED,
    "hbm-aed-binary": _AED,
    "hx711-line": Wires(CHIP),
    "mcu-line": Wires(CHIP),
    "mcu-valve": Wires(CHIP),
}


def wires_of(device_name: str, *, is_modbus: bool) -> Wires:
    """Return how a device is wired; for an unknown one what its protocol tells: Modbus RTU is usually RS-485."""
    return _BY_NAME.get(device_name) or Wires(RS485 if is_modbus else UNKNOWN)
