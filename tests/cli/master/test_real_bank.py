"""The client verbs against the real register bank: what a newcomer gets wrong is answered with the code that explains it."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from gateway.bsfm import Response
from gateway.codes.refusals import RefusalReason
from gateway.profiles import load_calibration, load_register_map
from gateway.registers import BankRules, RegisterBank, RegisterMap
from gateway.registers.command import Status
from gateway.registers.words import ControlBit, State
from gateway.registers.writes.proposed_write import EdgeRefusal

PROFILES = Path(__file__).parents[3] / "profiles"


@pytest.fixture
def bank(register_map: RegisterMap) -> RegisterBank:
    return RegisterBank(register_map, BankRules(rig_name="demo", force_max_n=60.0), now=lambda: 0.0)


@pytest.fixture
def gateway(bank: RegisterBank, serve) -> str:
    address: str = serve(bank).address
    return address


def test_a_force_is_commanded_and_read_back(bank: RegisterBank, gateway: str, call) -> None:
    answer = call("write", "force_setpoint=12", "control_word=enable", "--gateway", gateway)
    assert answer.exit_code == 0, answer.output
    assert (bank.command.force_setpoint_n, bank.command.number) == (12.0, 1)
    bank.publish(Status(state=State.HOLDING, force_measured_n=11.97))
    facts = json.loads(
        call("read", "state", "force_measured", "force_measured@float_cdab", "--json", "--gateway", gateway).output
    )
    assert facts["state"]["text"] == "holding"
    assert facts["force_measured"]["value"] == 11.97
    assert facts["force_measured@float_cdab"]["value"] == pytest.approx(11.97)


FORCE = "force_setpoint, address: 1, type: int16, scale: 0.01, unit: N, access: RW, min: 0, max: 327.67"


@pytest.mark.parametrize(
    ("old", "new", "counts"),
    [
        (FORCE, FORCE.replace("0.01", "0.1"), 120),
        ("{name: map_hash, address: 412", "{name: map_hash, address: 430", 1200),
    ],
)
def test_a_gateway_with_a_map_of_its_own_is_not_commanded_by_another(
    old: str, new: str, counts: int, serve, call, tmp_path: Path
) -> None:
    """12 N by force-v1 are 1200 counts, and by a map of tenths 120 N."""
    (tmp_path / "own.yaml").write_text((PROFILES / "registers" / "force-v1.yaml").read_text().replace(old, new))
    own = load_register_map(tmp_path / "own.yaml")
    bank = RegisterBank(own, BankRules(rig_name="own", force_max_n=200.0), now=lambda: 0.0)
    address = serve(bank).address
    for words in (("write", "force_setpoint=12", "control_word=1"), ("hold", "12", "--for", "10ms")):
        refused = call(*words, "--gateway", address)
        assert refused.exit_code == 1 and "E186 " in refused.stderr and "--map FILE" in refused.stderr
    assert bank.command.number == 0, "nothing was written"
    taken = call("write", "force_setpoint=12", "control_word=1", "--gateway", address, "--map", tmp_path / "own.yaml")
    assert taken.exit_code == 0 and bank.command.force_setpoint_n == 12.0
    assert bank.read_registers(1, 1) == counts.to_bytes(2, "big")
    assert call("write", "control_word=0", "--gateway", address).exit_code == 0
    assert not bank.command.control_word, "a stop is never kept back"


WHAT_READS_OR_BEGINS = (
    ("read", "force_measured"), ("monitor", "--once"), ("self-test",), ("calibrate", "--yes"),
    ("upload", PROFILES / "calibrations" / "demo.yaml"),
)  # fmt: skip


@pytest.mark.parametrize("words", WHAT_READS_OR_BEGINS, ids=lambda words: words[0])
def test_nothing_is_read_and_nothing_begun_by_another_map_than_the_gateway_s(
    words: tuple[str, ...], serve, call, tmp_path: Path
) -> None:
    """By a map of tenths 12 N stood there as 1.20 N, without a word."""
    measured = "{name: force_measured, address: 102, type: int16, scale: 0.01"
    text = (PROFILES / "registers" / "force-v1.yaml").read_text()
    (tmp_path / "own.yaml").write_text(text.replace(measured, measured.replace("0.01", "0.1")))
    own = load_register_map(tmp_path / "own.yaml")
    bank = RegisterBank(own, BankRules(rig_name="own", force_max_n=200.0), now=lambda: 0.0)
    bank.publish(Status(force_measured_n=12.0))
    address = serve(bank).address
    refused = call(*words, "--gateway", address)
    assert refused.exit_code == 1 and "E186 " in refused.stderr and "--map FILE" in refused.stderr
    assert "1.20" not in refused.stdout and bank.command.number == 0
    named = call(*words, "--gateway", address, "--map", tmp_path / "own.yaml")
    assert "E186" not in named.stderr
    assert "12.0" in named.stdout or words[0] not in ("read", "monitor")


def test_a_negative_force_is_not_beyond_a_limit_that_nobody_can_tell(
    bank: RegisterBank, gateway: str, call, monkeypatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    bank.set_active_model(load_calibration("demo"))
    answer = call("write", "force_setpoint=-1", "--gateway", gateway)
    assert answer.exit_code == 1
    assert answer.stderr.startswith("W204 force_setpoint = -1.00 N: allowed 0 .. 65.23 N by the calibration in use;")


def test_shares_weights_and_short_times_are_shown_with_their_digits(bank: RegisterBank, gateway: str, call) -> None:
    demo = load_calibration("demo")
    bank.set_active_model(replace(demo, response=Response(dead_time_s=0.0803, lag_s=0.1)))
    names = ("slip_share_2@active", "rising_w_1@active", "dead_time@active", "slip_stops@active")
    facts = json.loads(call("read", *names, "--json", "--gateway", gateway).output)
    assert [facts[name]["text"] for name in names] == [
        f"{demo.slip_shares[2]:.6g}",
        f"{demo.rising_weights[1]:.6g}",
        "0.0803 s",
        "7",
    ]


@pytest.mark.parametrize(
    ("assignments", "code"),
    [
        (["force_setpoint=65"], "W204"),
        (["force_setpoint=65", "control_word=1"], "W204"),
        (["force_setpoint@float_abcd=nan"], "W207"),
        (["force_setpoint@float_abcd=2.3419e-41"], "W201"),
        (["control_word=valve_pull"], "W217"),
    ],
)
def test_what_a_newcomer_gets_wrong_has_its_code(
    assignments: list[str], code: str, bank: RegisterBank, gateway: str, call
) -> None:
    answer = call("write", *assignments, "--gateway", gateway)
    assert answer.exit_code == 1
    assert answer.stderr.startswith(f"{code} "), answer.stderr
    assert bank.command.number == 0


@pytest.mark.parametrize(
    ("block", "code"),
    [
        (RefusalReason.FAULT_LATCHED, "W212"),
        (RefusalReason.CELL_SILENT, "W215"),
        (RefusalReason.OUTPUT_FAULT, "W214"),
        (RefusalReason.NOT_READY, "W213"),
        (RefusalReason.HEARTBEAT_STALE, "W302"),
        (RefusalReason.TARE_REFUSED, "W303"),
        (RefusalReason.CALIBRATION_REFUSED, "W305"),
        (RefusalReason.CALIBRATING, "W310"),
    ],
)
def test_an_enable_that_is_refused_says_why(block: RefusalReason, code: str, bank, gateway: str, call) -> None:
    bank.on_asked = lambda requests: EdgeRefusal(block, ControlBit.ENABLE, "enable refused: as control says")
    answer = call("write", "control_word=enable", "--gateway", gateway)
    assert answer.exit_code == 1
    assert answer.stderr.startswith(f"{code} "), answer.stderr


def test_what_a_self_test_keeps_busy_is_not_told_as_a_calibration(bank, gateway: str, call) -> None:
    bank.on_asked = lambda requests: EdgeRefusal(RefusalReason.CALIBRATING, ControlBit(0), "a self-test has the output")
    said = call("write", "control_word=enable", "--gateway", gateway).stderr
    assert said.startswith("W310 busy: a run has the output: exception 06") and "a calibration" not in said


def test_every_register_of_the_map_can_be_read_by_its_name(register_map: RegisterMap, gateway: str, call) -> None:
    names = [f"{register.name}@{register.block}" for register in register_map.registers]
    answer = call("read", *names, "--json", "--gateway", gateway)
    assert answer.exit_code == 0, answer.output
    facts = json.loads(answer.output)
    assert len(facts) == len(names)
    assert facts["proof_word@proof"]["value"] == 0x1234
    assert facts["proof_float_cdab@proof"]["value"] == 1234.5
