"""What befalls a line, drawn from a seed: its device, its speed, its host, and faults of the wire and of the device."""

from dataclasses import dataclass, replace
from math import inf
from random import Random

from gateway.devices import DeviceProfile, DeviceRole
from gateway.devices.grammar import Grammar
from gateway.profiles import list_shipped
from tests.profile_files import load_device
from tests.simulation.kernel.spoiled import KINDS, Spoil

PROFILES = [load_device(name) for name in list_shipped("device")]
OUTPUTS = [profile for profile in PROFILES if profile.role is DeviceRole.OUTPUT]
CELLS = [profile for profile in PROFILES if profile.role is DeviceRole.LOAD_CELL]
VALVES = [profile for profile in PROFILES if profile.role is DeviceRole.VALVE]

SLOW_BAUDS = 2400, 4800, 9600
LEAD_S, FAULTS_S = 0.6, 2.0
"""Before the first fault, and in which they fall."""
_MOST_MODBUS_S = 0.09
MOST_FAULTS, MOST_IN_A_ROW = 4, 5


@dataclass(frozen=True)
class Fault:
    """at_s: since the scene began; numbers: as its kind needs them."""

    at_s: float
    kind: str
    numbers: tuple[float, ...] = ()
    spoil: Spoil | None = None


@dataclass(frozen=True)
class Line:
    """profile: with the reply time that its speed needs; adapter_s: between two turns of the adapter; delay_s: least and most
    time of the device until its answer; tick_hz: of the loop."""

    profile: DeviceProfile
    baud: int
    adapter_s: float
    delay_s: tuple[float, float]
    tick_hz: float


def draw_line(rng: Random, profile: DeviceProfile, longest_bytes: int) -> Line:
    """longest_bytes: of a question and its answer."""
    baud = rng.choice([*3 * [profile.serial.baud], rng.choice(SLOW_BAUDS)])
    adapter_s = rng.choice([0.0, 0.0, 0.001, 0.016])
    takes_s = profile.serial.at(baud).character_s * longest_bytes + adapter_s
    if profile.is_modbus and takes_s > _MOST_MODBUS_S:  # `check` refuses it
        baud, takes_s = profile.serial.baud, profile.serial.character_s * longest_bytes + adapter_s
    reply_timeout_s = max(profile.reply_timeout_s, min(1.2 * takes_s, 0.1 if profile.is_modbus else inf))
    spare_s = reply_timeout_s - takes_s
    most_s = rng.choice([0.001, 0.1 * spare_s, 0.5 * spare_s, 0.97 * spare_s])
    serial = replace(profile.serial, baud=baud)
    profile = replace(profile, reply_timeout_s=reply_timeout_s, serial=serial)
    return Line(profile, baud, adapter_s, (min(0.0005, most_s), most_s), rng.choice([20.0, 50.0, 100.0, 250.0, 500.0]))


def draw_spoil(rng: Random, profile: DeviceProfile, others: list[bytes], reply_timeout_s: float) -> Spoil:
    """One thing that a burst of answers suffers. others: lines that another question, or device, is answered with."""
    kind = rng.choice(KINDS)
    number = rng.random()
    if kind == "late":
        number = reply_timeout_s * rng.choice([rng.uniform(0.0, 1.3), rng.uniform(0.9, 1.1), rng.uniform(1.0, 6.0)])
    data = b""
    if kind in ("replaced", "followed"):
        junk = bytes(rng.randrange(256) for _ in range(rng.randrange(1, 9)))
        data = rng.choice([*others, profile.terminator_bytes, junk, b"?" + profile.terminator_bytes])
    burst = rng.choice([1, 1, 1, 2, 3, MOST_IN_A_ROW])
    return Spoil(kind, burst, number, data)


def lines_of(profile: DeviceProfile, numbers: list[float]) -> list[bytes]:
    """Whole lines that an output device of this profile could say, of whatever was asked."""
    grammar = Grammar(profile)
    exchanges = [one for one in (profile.set_voltage, profile.read_voltage, profile.read_pressure) if one]
    return [
        grammar.answer_line(exchange, number)
        for exchange in exchanges
        if exchange.answer
        for number in (numbers if exchange is not profile.read_pressure else [50000.0 * one for one in numbers])
    ]


def draw_times(rng: Random) -> list[float]:
    """When faults fall: apart, or within one exchange."""
    count = rng.randrange(1, MOST_FAULTS + 1)
    times, at_s = [], LEAD_S + FAULTS_S * rng.random()
    for _ in range(count):
        times.append(at_s)
        near_s = rng.choice([0.0, 0.003, 0.02, 0.08, 0.3])
        at_s = LEAD_S + FAULTS_S * rng.random() if rng.random() < 0.4 else at_s + near_s * rng.random()
    return sorted(times)
