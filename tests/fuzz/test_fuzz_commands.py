"""Any upload and any JSON: what is refused leaves the active set, the registers and the master as they were."""

import json
import struct
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from gateway.modbus import ModbusError
from gateway.profiles import load_register_map
from gateway.registers import Refusal
from gateway.registers.upload.coefficients import HEAD_BYTES, CoefficientSet
from gateway.registers.words import CommitStatus, UploadReason
from gateway.telemetry.mqtt.register_commands import RegisterCommands
from tests.calibrations.coefficients import calibration, requests_of, staged
from tests.calibrations.upload_bench import COMMIT as DO_COMMIT
from tests.calibrations.upload_bench import DRY_RUN, PEER, Bench
from tests.fuzz.conftest import Examples
from tests.fuzz.damage import damaged, held_bytes

MAP = load_register_map("force-v1")
COMMIT = 1145


def test_no_upload_puts_half_a_set_to_use(tmp_path: Path, examples: Callable[..., Examples]) -> None:
    """Sets that were damaged, cut, stretched and staged in any order: what is in use stays, until one is committed whole."""
    count, chance = examples("staging writes")
    bench = Bench(tmp_path, MAP)
    active = bench.active_block
    good = [staged(CoefficientSet.of_calibration(calibration(k, number=k))) for k in (3, 5, 8)]
    seen = Counter[tuple[int, int, int]]()
    while count > 0:
        words = damaged(chance.choice(good), chance) if chance.random() < 0.8 else chance.randbytes(290)
        for address, part in requests_of(words[: len(words) // 2 * 2], chance.choice((1, 7, 60, 123))):
            count -= 1
            try:
                bench.bank.write_registers(address + chance.choice((0, 0, 0, 0, 0, 0, 0, 1)), part, PEER)
            except ModbusError as refusal:
                assert isinstance(refusal, Refusal) and refusal.code in (2, 3, 4, 6)
        action = chance.choice((0, *(DO_COMMIT, DRY_RUN) * 3, 4, 9, 65535))
        held = bench.bank.read_registers(1000, 100) + bench.bank.read_registers(1100, 100)
        if action == DO_COMMIT and any(held[:HEAD_BYTES] == one[:HEAD_BYTES] for one in good):
            action = DRY_RUN  # it may be whole
        try:
            bench.write(COMMIT, action)
        except Refusal as refusal:
            assert refusal.code in (3, 6)
        bench.run()
        seen[(action, *bench.outcome[::2])] += 1
        assert bench.active_block == active and bench.used == []
    for action in (DO_COMMIT, DRY_RUN):
        assert seen[action, CommitStatus.FAILED, UploadReason.CRC] > 5, seen
    assert held_bytes(bench.bank) < 80_000


class Link:
    """Control's socket: takes whatever is a request of its kind."""

    def __init__(self) -> None:
        self.asked: list[bytes] = []

    async def ask(self, request: dict[str, object]) -> dict[str, object]:
        assert set(request) - {"until_s"} == {"do", "via", "unit", "pdu"}
        pdu = bytes.fromhex(str(request["pdu"]))
        self.asked.append(pdu)
        return {"ok": True, "pdu": "10" if pdu[0] == 16 else bytes((3, 2 * pdu[4], *bytes(2 * pdu[4]))).hex()}


NAMES = (
    "force_setpoint",
    "control_word",
    "force_setpoint@float_abcd",
    "heartbeat",
    "state",
    "tilt_angle",
    "nonsense",
    "",
    "@",
)
VALUES = (0, 1, 12.5, -3, 65535, 65536, 1e9, 1e300, -1e-30, 10**400, True, None, "1", [], {}, [1], 327.67, -180)
TEXTS = (
    b"",
    b"[]",
    b"{}",
    b"null",
    b'{"a":NaN}',
    b'{"force_setpoint":Infinity}',
    b"[" * 9000,
    b'{"a":' * 3000,
    b"\xff\xfe",
    b"9" * 5000,
)


def run(coroutine: object) -> object:
    """The answer of a coroutine that waits for nothing."""
    with pytest.raises(StopIteration) as ended:
        coroutine.send(None)
    return ended.value.value


def test_no_command_by_mqtt_ends_its_listener(examples: Callable[..., Examples]) -> None:
    count, chance = examples("MQTT commands")
    link = Link()
    commands, taken = RegisterCommands(MAP, link, 1), 0
    for _ in range(count):
        link.asked.clear()
        given = {chance.choice(NAMES): chance.choice(VALUES) for _ in range(chance.randint(1, 3))}
        payload, way = json.dumps(given).encode(), chance.random()
        if way < 0.4:
            payload = damaged(payload, chance)
        elif way < 0.45:
            payload = chance.choice(TEXTS)
        answer = run(commands.carry_out(payload))
        assert json.loads(json.dumps(answer)) == answer
        assert answer["ok"] or (isinstance(answer["error"], str) and answer["error"])
        assert len(link.asked) <= 2 * len(answer["written"])
        reached = set[int]()
        for pdu in link.asked:
            if len(pdu) == 5:  # what lies between the registers of one write
                function, address, words = struct.unpack(">BHH", pdu)
                assert function == 3 and 1 < words <= 16 - address
                continue
            function, address, words, size = struct.unpack(">BHHB", pdu[:6])
            assert function == 16 and size == 2 * words == len(pdu) - 6 and address < 1700
            reached.update(range(address, address + words))
        assert all(MAP.find(name).address in reached for name in answer["written"])
        taken += answer["ok"]
    assert 0.02 < taken / count < 0.8
