"""A bank as a rig has it, and masters that talk to it in words and floats."""

import struct
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from gateway.modbus import Peer, Role
from gateway.registers import BankRules, Command, Refusal, RegisterBank, RegisterMap
from gateway.registers.map.map_reader import read_map

MAP_FILE = Path(__file__).parents[2] / "profiles" / "registers" / "force-v1.yaml"


class Master:
    """One host; `accepted` and `refused` are what the bank told about everybody's writes."""

    def __init__(self, bank: RegisterBank, host: str, role: Role = Role.SETPOINT, name: str = "") -> None:
        self.bank = bank
        self.peer = Peer(host, 40000, name, role)

    def write(self, address: int, *words: int) -> None:
        self.bank.write_registers(
            address, struct.pack(f">{len(words)}H", *(word & 0xFFFF for word in words)), self.peer
        )

    def write_float(self, address: int, *values: float) -> None:
        self.bank.write_registers(address, struct.pack(f">{len(values)}f", *values), self.peer)

    def write_float_cdab(self, address: int, value: float) -> None:
        data = struct.pack(">f", value)
        self.bank.write_registers(address, data[2:] + data[:2], self.peer)

    def refusal(self, act: Callable[..., None], *arguments: object) -> Refusal:
        """The refusal that an act must meet; nothing but the last-refusal registers may change by it."""
        before, command, owner = memory(self.bank), self.bank.command, self.bank.owner
        with pytest.raises(Refusal) as caught:
            act(*arguments)
        assert memory(self.bank) == before
        assert (self.bank.command, self.bank.owner) == (command, owner)
        assert "None" not in caught.value.sentence
        return caught.value

    def word(self, address: int) -> int:
        return int.from_bytes(self.bank.read_registers(address, 1), "big")

    def float(self, address: int) -> float:
        return float(struct.unpack(">f", self.bank.read_registers(address, 2))[0])


def memory(bank: RegisterBank) -> list[bytes]:
    """Every readable word but the last-refusal registers."""
    ranges = [(0, 16), (100, 18), (122, 10), (200, 68), (276, 20), (300, 68), (376, 20), (400, 32)]
    ranges += [(1000, 100), (1100, 100), (1500, 100), (1600, 100)]
    return [bank.read_registers(*place) for place in ranges]


@pytest.fixture(scope="session")
def document() -> dict:
    return yaml.safe_load(MAP_FILE.read_text())


@pytest.fixture(scope="session")
def register_map(document: dict) -> RegisterMap:
    return read_map(document)


@pytest.fixture
def make_bank(register_map: RegisterMap) -> Callable[..., RegisterBank]:
    def make(**rules: object) -> RegisterBank:
        given = {"rig_name": "demo", "force_max_n": 60.0} | rules
        return RegisterBank(register_map, BankRules(**given), now=lambda: 7.0)

    return make


@pytest.fixture
def bank(make_bank: Callable[..., RegisterBank]) -> RegisterBank:
    return make_bank()


@pytest.fixture
def commands(bank: RegisterBank) -> list[Command]:
    """What control is handed."""
    handed: list[Command] = []
    bank.on_command = handed.append
    return handed


@pytest.fixture
def master(bank: RegisterBank) -> Master:
    return Master(bank, "10.0.0.1")


@pytest.fixture
def other(bank: RegisterBank) -> Master:
    return Master(bank, "10.0.0.2")


@pytest.fixture
def master_of() -> Callable[..., Master]:
    return Master
