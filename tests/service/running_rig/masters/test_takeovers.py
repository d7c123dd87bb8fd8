"""Who owns the setpoint during runs and after, and edges write by write."""

from collections.abc import Callable
from dataclasses import replace
from struct import pack

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.control import CalibrationInUse
from gateway.control.settings import SelfTestSettings
from gateway.modbus import Peer
from gateway.modbus.pdu import is_exception, read_write_request, write_registers_request
from gateway.modbus.server import answer
from gateway.profiles import load_calibration
from gateway.registers.words import ControlBit, State
from tests.control.bench import settings
from tests.fieldbus.by_hand import framed
from tests.fieldbus.conftest import Stand, put
from tests.service.running_rig.runs.test_runs_and_masters import LEASE_S, leased, locally
from tests.service.running_rig.simulated_rig import (
    CALIBRATE,
    ENABLE,
    OTHER,
    OWNER,
    RESET,
    SELF_TEST,
    TAKE,
    TARE,
    SmallRig,
)

HOLDERS: dict[str, Callable[[], SmallRig]] = {
    "off": SmallRig,
    "prepared": lambda: _written(SmallRig(), 1, 500),
    "ready": lambda: _written(SmallRig(), 0, ENABLE),
    "holding": lambda: leased().holding(),
    "fault": lambda: leased().faulted(),
    "calibrating": lambda: SmallRig().calibrating(),
    "calibrating here": lambda: locally(SmallRig()),
}


def _written(rig: SmallRig, *words: int) -> SmallRig:
    rig.write(*words)
    return rig.run(0.1)


@pytest.mark.parametrize("name", HOLDERS)
def test_bit_3_of_another_master_takes_over_alike_in_every_state(name: str) -> None:
    rig = HOLDERS[name]()
    stood = (rig.state, rig.word("control_word"), rig.word("force_setpoint"))
    rig.bank.write_bits(3, [True], OTHER)
    assert rig.bank.owner == OTHER.host
    state, word, setpoint = stood
    assert (rig.state, rig.word("control_word")) == (state, word)
    assert rig.word("force_setpoint") == (setpoint if state is State.HOLDING else 0)
    for words in ((4, 71), (4, 72), (0, *rig.block(rig.word("control_word"), beat=73))):
        rig.write(*words, peer=OTHER)
        rig.run(0.1)
        assert rig.bank.owner == OTHER.host, "its own heartbeat never ends it"
    if rig.state is not State.CALIBRATING:
        for words in ((6, 10), (2, 300), (1, 0)):
            rig.write(*words, peer=OTHER)
            assert rig.bank.owner == OTHER.host
    refused = rig.answer(2, 100)
    assert refused is not None
    assert (refused.code, refused.reason) == (6, RefusalReason.NOT_OWNER)
    rig.bank.write_bits(3, [True], OWNER)
    assert rig.bank.owner == OWNER.host


def _by_words(*words: int) -> Callable[[SmallRig], None]:
    return lambda rig: rig.write(0, *words, peer=OTHER)


def _by_float(address: int, data: bytes) -> Callable[[SmallRig], None]:
    return lambda rig: rig.bank.write_registers(address, data, OTHER)


def _ask(rig: SmallRig, pdu: bytes) -> None:
    assert not is_exception(answer(pdu, rig.bank, OTHER))


_NINE = pack(">f", float(ENABLE | TAKE))
TAKEOVERS: dict[str, Callable[[SmallRig], None]] = {
    "FC06": _by_words(ENABLE | TAKE),
    "float ABCD": _by_float(200, _NINE),
    "float CDAB": _by_float(300, _NINE[2:] + _NINE[:2]),
    "coils": lambda rig: rig.bank.write_bits(0, [True, False, False, True], OTHER),
    "FC22": lambda rig: rig.bank.mask_write(0, 0xFFF6, ENABLE | TAKE, OTHER),
    "FC23": lambda rig: _ask(rig, read_write_request(100, 4, 0, pack(">H", ENABLE | TAKE))),
}


@pytest.mark.parametrize("by", TAKEOVERS)
@pytest.mark.parametrize("left", [(1, 3000), (5, 4000)], ids=["force", "voltage"])
def test_an_enable_of_who_takes_over_presses_nothing_that_another_has_left(by: str, left: tuple[int, int]) -> None:
    rig = SmallRig()
    rig.write(*left)
    rig.run(0.1)
    TAKEOVERS[by](rig)
    rig.run(1.0)
    rig.write(3, int(left[0] == 5), peer=OTHER)
    rig.run(1.0)
    assert (rig.state, rig.word("force_setpoint"), rig.word("voltage_setpoint")) == (State.READY, 0, 0)
    assert max(voltage_v for _, voltage_v, _ in rig.trace) == 0.0


def test_a_setpoint_that_the_takeover_itself_brings_counts_and_one_that_waits_for_contact_is_cleared() -> None:
    rig = SmallRig()
    rig.write(1, 3000)
    rig.write(0, ENABLE | TAKE, 500, peer=OTHER)
    assert rig.until(State.HOLDING).word("force_accepted") == 500
    rig.plant.contact = False
    waiting = rig.until(State.READY)
    waiting.write(0, ENABLE | TAKE)
    assert (rig.state, rig.word("force_setpoint"), rig.bank.owner) == (State.READY, 0, OWNER.host)
    rig.plant.contact = True
    assert rig.run(2.0).plant.force_n < 0.5


def test_who_takes_over_may_reset_a_fault_beside_a_setpoint_that_another_has_left() -> None:
    rig = SmallRig().faulted()
    rig.write(1, 3000)
    assert rig.answer(0, RESET) is not None
    rig.write(0, RESET | TAKE, peer=OTHER)
    assert (rig.state, rig.word("force_setpoint"), rig.bank.owner) == (State.OFF, 0, OTHER.host)


def test_a_takeover_of_what_a_calibration_has_lowered_keeps_nothing_of_what_was_asked_for() -> None:
    rig = SmallRig()
    rig.write(1, 3000)
    rig.bank.set_active_model(replace(load_calibration("demo"), number=17, force_limits_n=(1.0, 8.0)))
    rig.write(0, TAKE, peer=OTHER)
    assert (rig.word("force_setpoint"), rig.bank.command.force_requested_n) == (0, 0.0)


def test_a_takeover_in_the_write_that_disables_holds_too() -> None:
    rig = SmallRig().holding()
    rig.write(0, TAKE, peer=OTHER)
    rig.run(0.5)
    assert (rig.state, rig.bank.owner) == (State.OFF, OTHER.host)


def test_a_takeover_ends_with_disable() -> None:
    rig = SmallRig().holding()
    rig.bank.write_bits(3, [True], OWNER)
    rig.write(0, 0)
    assert rig.bank.owner is None


def test_a_takeover_ends_with_the_lease_and_with_no_other_fault() -> None:
    rig = leased().holding()
    rig.bank.write_bits(3, [True], OWNER)
    rig.is_cell_silent = True
    rig.until(State.FAULT)
    assert rig.bank.owner == OWNER.host
    rig.is_cell_silent = False
    rig.run(0.5).write(0, RESET, 0, 0, 0, 4711)
    rig.run(1.0).holding()
    rig.beats = False
    rig.until(State.FAULT)
    assert rig.bank.owner is None


def test_a_takeover_outlives_the_end_of_its_own_run() -> None:
    rig = SmallRig()
    rig.write(0, TAKE | CALIBRATE)
    rig.run(2.5).write(0, 0)
    rig.until(State.OFF)
    assert rig.bank.owner == OWNER.host


@pytest.mark.parametrize(("runs", "asks"), [(SELF_TEST, CALIBRATE), (CALIBRATE, SELF_TEST)])
def test_a_guest_that_asks_for_another_run_is_refused_and_ends_none(runs: int, asks: int) -> None:
    """It was answered that it had begun, and had ended the self-test of another master."""
    rig = SmallRig(replace(settings(), self_test=SelfTestSettings())).calibrating(runs)
    for words in ((0, asks), (0, asks, 0, 0, 0, 7)):
        refused = rig.answer(*words, peer=OTHER)
        assert refused and refused.reason is RefusalReason.NOT_OWNER
        assert rig.run(0.1).state is State.CALIBRATING
    rig.write(0, 0, peer=OTHER)
    rig.until(State.OFF)


def test_an_edge_bit_acts_each_time_it_is_written() -> None:
    rig = SmallRig()
    for _ in range(3):
        rig.write(0, TARE)
    assert sum(sentence.startswith("tare") for sentence in rig.log) == 3
    rig.write(4, 1)
    assert sum(sentence.startswith("tare") for sentence in rig.log) == 3


def test_a_reset_with_a_new_heartbeat_counts_in_the_very_moment_of_the_fault() -> None:
    rig = leased().holding()
    rig.is_cell_silent = True
    rig.until(State.FAULT)
    rig.write(0, RESET, 0, 0, 0, 4711)
    assert rig.state is State.OFF


@pytest.mark.parametrize("is_behind", [True, False])
def test_heartbeats_that_have_waited_in_a_pile_renew_no_lease(is_behind: bool) -> None:
    """Of a master that asks more than is answered they may come seconds behind its end."""
    rig = leased().holding()
    rig.beats = False
    for _ in range(8):
        rig.beat += 1
        rig.write(4, rig.beat, peer=replace(OWNER, is_behind=is_behind))
        rig.run(0.1)
    assert rig.state is (State.FAULT if is_behind else State.HOLDING)
    assert any("wait behind its other requests" in line for line in rig.log) is is_behind


def test_a_master_that_hangs_behind_a_pile_of_its_own_heartbeats_keeps_no_force() -> None:
    """A thousand of them, of which two hundred a second are taken: five seconds of a lease of 0.35 s."""
    rig, stand = leased(), Stand(requests_per_s=200.0)
    rig.holding().beats = False
    stand.shared.bank = rig.bank  # type: ignore[assignment]
    connection, far = stand.connect(OWNER.host)
    stream = b"".join(framed(write_registers_request(4, pack(">H", beat))) for beat in range(1000, 2000))
    held_s = 0.0
    while rig.state is State.HOLDING and held_s < 4.0:
        stream = stream[put(connection, far, stream) :]
        rig.run(0.01)
        stand.clock.advance(0.01)
        held_s += 0.01
    assert rig.state is State.FAULT
    assert 0.25 <= held_s < 0.25 + LEASE_S + 0.2
    assert len(stream) > 5000, "most of them have never been read"


@pytest.mark.parametrize("word", [ENABLE, RESET, TARE, CALIBRATE])
def test_nothing_begins_by_a_command_that_has_waited_in_a_pile_and_a_stop_is_obeyed(word: int) -> None:
    behind, rig = replace(OWNER, is_behind=True), SmallRig()
    refused = rig.answer(0, word, peer=behind)
    assert refused is not None and refused.reason is RefusalReason.NOT_READY
    assert "wait for each answer" in refused.sentence
    assert rig.answer(0, word) is None
    rig = SmallRig().holding()
    rig.write(0, 0, peer=behind)
    assert rig.until(State.OFF, 0.1)


def test_nobody_takes_over_by_a_command_that_has_waited_in_a_pile() -> None:
    """A master that had hung took the setpoint from the one that had come after it, and whose force fell with its lease."""
    rig = leased().holding()
    refused = rig.answer(0, ControlBit.ENABLE | ControlBit.TAKE_OWNERSHIP, 500, peer=Peer("10.0.0.9", is_behind=True))
    assert refused is not None and refused.reason is RefusalReason.NOT_READY
    rig.run(2.0 * LEASE_S)
    assert rig.state is State.HOLDING and rig.bank.owner == OWNER.host
    assert rig.answer(0, ControlBit.ENABLE | ControlBit.TAKE_OWNERSHIP, 500, 0, 0, 9, peer=Peer("10.0.0.9")) is None
    assert rig.bank.owner == "10.0.0.9"


def test_a_force_that_is_still_leaving_cannot_become_the_zero() -> None:
    rig = SmallRig().holding(30.0)
    rig.write(0, 0)
    refused = rig.answer(0, TARE)
    assert refused is not None
    assert "on their way to 0" in refused.sentence
    rig.run(1.5).write(0, TARE)
    assert abs(rig.controller.zero_n) < 1.0


def test_control_answers_for_this_moment_and_not_for_the_last_step() -> None:
    """The last step saw a fresh sample; meanwhile it has grown old, and no step has told."""
    rig = SmallRig()
    assert rig.word("status_word") & 2
    rig.ticks += 20
    refused = rig.answer(0, ENABLE, 1200)
    assert refused is not None
    assert (refused.code, refused.reason) == (0x0B, RefusalReason.CELL_SILENT)


def test_a_calibration_with_a_smaller_limit_lowers_the_setpoint_in_the_registers() -> None:
    rig = SmallRig().holding(20.0)
    less = replace(load_calibration("demo"), number=17, force_limits_n=(1.0, 8.0))
    said = rig.bank.set_active_model(less)
    rig.controller.use(CalibrationInUse(less.model(), 17))
    assert said == "W314 force_setpoint lowered from 20.00 N to 8.00 N: calibration 17 allows no more"
    for _ in range(2):
        rig.run(0.1)
        assert (rig.word("force_setpoint"), rig.word("force_requested")) == (800, 2000)
        assert rig.bank.read_registers(202, 2) == pack(">f", 8.0)
        rig.write(4, 5)
    rig.run(2.0)
    assert (rig.state, rig.word("force_accepted")) == (State.HOLDING, 800)
    rig.write(1, 500)
    assert (rig.word("force_setpoint"), rig.word("force_requested")) == (500, 500)
    assert rig.bank.set_active_model(less) == ""
