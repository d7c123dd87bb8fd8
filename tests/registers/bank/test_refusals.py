"""Every refusal: exception code, reason, sentence, and no trace but the last-refusal registers."""

import math

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.registers.image import RegisterImage
from gateway.registers.refusal import Refusal
from gateway.registers.words import ControlBit
from gateway.registers.writes.byte_order_echo import ByteOrderEcho
from gateway.registers.writes.proposed_write import EdgeRefusal

R = RefusalReason
NAN = math.nan

BAD_WORDS = [
    # address, words, code, reason, refusal_address, refusal_value, sentence
    ((1, 6500), 3, R.OUT_OF_RANGE, 1, 65.0, "W204 force_setpoint = 65.00 N, allowed 0 .. 60 N (rig demo)"),
    ((0, 1, -1), 3, R.OUT_OF_RANGE, 1, -0.01, "W204 force_setpoint = -0.01 N, allowed 0 .. 60 N (rig demo)"),
    ((1, 0x8000), 3, R.OUT_OF_RANGE, 1, -327.68, "W204"),
    ((7, 6001), 3, R.OUT_OF_RANGE, 7, 60.01, "W204 precontact_force = 60.01 N"),
    (
        (5, 10001),
        3,
        R.OUT_OF_RANGE,
        5,
        10001.0,
        "W204 voltage_setpoint = 10001 mV, allowed 0 .. 10000 mV (map force-v1)",
    ),
    ((6, 1801), 3, R.OUT_OF_RANGE, 6, 180.1, "W204 tilt_angle = 180.1 deg, allowed -180 .. 180 deg"),
    ((3, 2), 3, R.UNSUPPORTED_BIT, 3, 2.0, "W217 mode = 2, known are 0 force, 1 voltage"),
    ((0, 0x10), 3, R.UNSUPPORTED_BIT, 0, 16.0, "W217 control_word bit 4 (valve_pull): not supported by rig demo"),
    ((0, 0x8001), 3, R.UNSUPPORTED_BIT, 0, 0x8001, "W217 control_word bit 15: not supported by rig demo"),
    ((13, 1), 3, R.RESERVED, 13, 1.0, "W209 address 13 is reserved: 1 was written"),
    ((14, 7), 3, R.RESERVED, 14, 7.0, "W209"),
    ((401, 7), 3, R.RESERVED, 401, 7.0, "W209"),
    ((226, 7), 3, R.RESERVED, 226, 7.0, "W209"),
    ((264, 7), 3, R.RESERVED, 264, 7.0, "W209"),
    ((226, 0, 0, 9), 3, R.RESERVED, 228, 9.0, "W209 address 228 is reserved: 9 was written, only 0 is accepted"),
    ((229, 0, 0, 9), 3, R.RESERVED, 231, 9.0, "W209 address 231 is reserved: 9 was written"),
    ((231, 5), 3, R.RESERVED, 231, 5.0, "W209 address 231 is reserved: 5 was written"),
    ((6, -1801), 3, R.OUT_OF_RANGE, 6, -180.1, "W204 tilt_angle = -180.1 deg, allowed -180 .. 180 deg"),
    ((0, 0x40), 3, R.UNSUPPORTED_BIT, 0, 64.0, "W217 control_word bit 6 (start_self_test): not supported by rig demo"),
    ((0, 0x80), 3, R.UNSUPPORTED_BIT, 0, 128.0, "W217 control_word bit 7: not supported by rig demo"),
    ((100, 0), 2, R.READ_ONLY, 100, NAN, "W205 status_word@status at 100 is read only"),
    ((232, 0, 0), 2, R.READ_ONLY, 232, NAN, "W205 status_word@float_abcd"),
    ((400, 0x1234), 2, R.READ_ONLY, 400, NAN, "W205 proof_word"),
    ((1500, 1), 2, R.READ_ONLY, 1500, NAN, "W205 order@active"),
    ((202, 0x4140), 3, R.HALF_VALUE, 202, NAN, "W206 force_setpoint@float_abcd is the registers 202 and 203"),
    ((203, 0), 3, R.HALF_VALUE, 203, NAN, "W206"),
    ((200, 0, 0, 0x4140), 3, R.HALF_VALUE, 200, NAN, "W206 force_setpoint@float_abcd"),
    ((416, 0x449A), 3, R.HALF_VALUE, 416, NAN, "W206 byte_order_echo"),
    ((416, 0x9A44, 0x0050), 3, R.OUT_OF_RANGE, 416, None, "W204 byte_order_echo"),
    ((416, 0x449A, 0x4000), 3, R.OUT_OF_RANGE, 416, 1234.0, "W204 byte_order_echo = 1234, allowed 1234.5"),
    ((416, 0x7FC0, 0), 3, R.NOT_FINITE, 416, NAN, "W207 byte_order_echo"),
    ((16, 1), 2, R.ADDRESS, 16, NAN, "W203"),
    ((40001, 1), 2, R.ADDRESS, 40001, NAN, "W202"),
    (
        (1000, 3),
        1,
        R.ROLE,
        1000,
        NAN,
        "W211 the role of 10.0.0.1:40000 is setpoint, block staging (1000",
    ),
]


@pytest.mark.parametrize(("words", "code", "reason", "address", "value", "sentence"), BAD_WORDS)
def test_bad_words_are_refused_and_leave_no_trace(master, words, code, reason, address, value, sentence):
    refusal = master.refusal(master.write, *words)
    assert (refusal.code, refusal.reason, refusal.address) == (code, reason, address)
    assert refusal.sentence.startswith(sentence)
    assert (master.word(118), master.word(119)) == (address, reason)
    if value is not None:
        assert master.float(120) == pytest.approx(value, rel=1e-6, nan_ok=True)
        assert master.float(272) == pytest.approx(value, rel=1e-6, nan_ok=True)


BAD_FLOATS = [
    (202, math.nan, R.NOT_FINITE, "W207 force_setpoint = nan"),
    (202, math.inf, R.NOT_FINITE, "W207 force_setpoint = inf"),
    (202, -math.inf, R.NOT_FINITE, "W207"),
    (202, 60.01, R.OUT_OF_RANGE, "W204 force_setpoint = 60.01 N, allowed 0 .. 60 N (rig demo)"),
    (202, 60.000004, R.OUT_OF_RANGE, "W204 force_setpoint = 60.000004 N, allowed 0 .. 60 N (rig demo)"),
    (202, -0.004, R.OUT_OF_RANGE, "W204 force_setpoint = -0.004 N, allowed 0 .. 60 N (rig demo)"),
    (202, -0.5, R.OUT_OF_RANGE, "W204"),
    (202, 1e30, R.OUT_OF_RANGE, "W204 force_setpoint = 1e+30 N"),
    (202, 9e-4, R.TOO_SMALL, "W208 force_setpoint = 0.0009 N"),
    (212, -9e-4, R.TOO_SMALL, "W208 tilt_angle"),
    (208, 1.5, R.OUT_OF_RANGE, "W204 heartbeat = 1.5 is not a whole number"),
    (208, 65536.0, R.OUT_OF_RANGE, "W204 heartbeat"),
    (206, 3.0, R.UNSUPPORTED_BIT, "W217 mode = 3"),
    (200, 33.0, R.UNSUPPORTED_BIT, "W217 control_word bit 5 (start_calibration)"),
]


@pytest.mark.parametrize(("address", "value", "reason", "sentence"), BAD_FLOATS)
def test_bad_floats_are_refused_in_both_word_orders(master, address, value, reason, sentence):
    for write, at in ((master.write_float, address), (master.write_float_cdab, address + 100)):
        refusal = master.refusal(write, at, value)
        assert (refusal.code, refusal.reason, refusal.address) == (3, reason, at)
        assert refusal.sentence.startswith(sentence)
        assert master.float(120) == pytest.approx(value, rel=1e-6, nan_ok=True)


def test_swapped_words_are_recognised_in_both_blocks(master):
    seen = "W201 2.34e-41 N; with the words swapped 12.00 N: your client sends"
    refusal = master.refusal(master.write_float_cdab, 202, 12.0)
    assert (refusal.code, refusal.reason) == (3, R.WORDS_SWAPPED)
    assert refusal.sentence.startswith(f"{seen} CDAB, use block 300 or mbpoll -B")
    assert 0.0 < master.float(120) < 1e-40, "as it was read"
    refusal = master.refusal(master.write_float, 302, 12.0)
    assert refusal.sentence.startswith(f"{seen} ABCD, use block 200")


def test_a_value_out_of_range_whose_swapped_reading_is_in_range_is_called_swapped(master):
    refusal = master.refusal(master.write_float_cdab, 202, 12.34)  # reads 2.4e29 or so
    assert refusal.reason is R.WORDS_SWAPPED
    assert "with the words swapped 12.34 N" in refusal.sentence


def test_swapped_control_word_is_recognised(master):
    assert master.refusal(master.write_float_cdab, 200, 1.0).reason is R.WORDS_SWAPPED


def test_the_first_bad_value_refuses_the_whole_write(master):
    master.write(0, 1, 1200)
    refusal = master.refusal(master.write, 0, 1, 1300, 20, 0, 9, 20000, 0, 500)
    assert refusal.address == 5


@pytest.mark.parametrize(
    ("reason", "code", "label"),
    [
        (R.FAULT_LATCHED, 4, "W212"),
        (R.OUTPUT_FAULT, 4, "W214"),
        (R.CELL_SILENT, 0x0B, "W215"),
        (R.NOT_READY, 6, "W213"),
        (R.HEARTBEAT_STALE, 3, "W302"),
        (R.NOTHING_TO_RESET, 4, "W312"),
        (R.TARE_REFUSED, 4, "W303"),
        (R.CALIBRATION_REFUSED, 4, "W305"),
        (R.CALIBRATING, 6, "W310"),
        (R.FITTING, 6, "W311"),
        (R.STOPPING, 6, "W315"),
    ],
)
def test_what_control_says_no_to_is_the_answer_to_the_write(bank, master, reason, code, label):
    bank.on_asked = lambda asked: EdgeRefusal(
        reason, ControlBit.ENABLE, f"{asked.command.force_setpoint_n:g} N refused"
    )
    for write, words in ((master.write, (0, 1, 1200)), (master.write, (0, 1)), (master.write_float, (200, 1.0))):
        refusal = master.refusal(write, *words)
        assert (refusal.code, refusal.reason, refusal.value) == (code, reason, 1.0)
        assert refusal.address == (200 if write == master.write_float else 0)
        assert refusal.sentence == f"{label} {'12' if len(words) == 3 else '0'} N refused"
    assert master.refusal(bank.write_bits, 0, [True], master.peer).reason is reason
    assert master.refusal(bank.mask_write, 0, 0xFFFE, 1, master.peer).reason is reason


def test_what_a_standing_bit_forbids_is_told_of_the_register_that_was_written(bank, master):
    """A pull that stands, and a setpoint that it does not reach: the setpoint is refused, and its register is named."""
    bank.on_asked = lambda asked: EdgeRefusal(R.PULL_RANGE, ControlBit.VALVE_PULL, "pulling reaches 12 N")
    for write, words, address in (
        (master.write, (1, 1300), 1),
        (master.write, (1, 1300, 20), 1),
        (master.write_float, (202, 13.0), 202),
        (master.write_float_cdab, (302, 13.0), 302),
    ):
        refusal = master.refusal(write, *words)
        assert (refusal.reason, refusal.address, refusal.value) == (R.PULL_RANGE, address, 13.0)
    assert master.refusal(master.write, 0, 1, 1300).address == 0


def test_control_is_asked_before_anything_is_stored_and_told_what_would_change(bank, master, commands):
    asked = []
    bank.on_asked = lambda one: asked.append((one.command, one.changes(), len(commands)))
    master.write(0, 1, 1200, 300, 0, 9)
    master.write(0, 1, 1200, 300, 0, 10)
    master.write(6, 100)
    assert [command for command, _, _ in asked] == commands
    assert [changes for _, changes, _ in asked] == [("force_setpoint", "force_ramp"), (), ("tilt_angle",)]
    assert [seen for _, _, seen in asked] == [0, 1, 2], "before the command goes out"


def test_a_rig_may_demand_the_byte_order_proof_of_each_host(make_bank, master_of):
    bank = make_bank(require_byte_order_echo=True)
    one, two = master_of(bank, "10.0.0.1"), master_of(bank, "10.0.0.2")
    refusal = one.refusal(one.write, 0, 1, 1200)
    assert (refusal.code, refusal.reason, refusal.value) == (6, R.BYTE_ORDER_UNPROVEN, 1.0)
    one.write_float(416, 1234.5)
    assert two.refusal(two.write, 0, 1).reason is R.BYTE_ORDER_UNPROVEN
    one.write(0, 1, 1200)
    assert bank.refusals == 2


def test_proofs_of_many_hosts_are_forgotten_oldest_first(make_bank, master_of):
    bank = make_bank(require_byte_order_echo=True)
    masters = [master_of(bank, f"10.0.1.{k}") for k in range(65)]
    for one in masters:
        one.write_float(416, 1234.5)
    assert masters[0].refusal(masters[0].write, 0, 1).reason is R.BYTE_ORDER_UNPROVEN
    masters[1].write_float(416, 1234.5)  # once more: the latest now
    masters[0].write_float(416, 1234.5)
    assert masters[2].refusal(masters[2].write, 0, 1).reason is R.BYTE_ORDER_UNPROVEN
    masters[1].write(0, 1)


def test_who_has_enabled_needs_no_new_proof_for_what_it_writes_then(make_bank, master_of):
    """Its own may be the oldest of many by then, and a tare in the cycle of its writes would be refused, and its lease end."""
    bank = make_bank(require_byte_order_echo=True)
    one = master_of(bank, "10.0.0.1")
    one.write_float(416, 1234.5)
    one.write(0, 1, 1200)
    for k in range(64):
        master_of(bank, f"10.0.1.{k}").write_float(416, 1234.5)
    one.write(0, int(ControlBit.ENABLE | ControlBit.TARE), 1100)
    assert bank.command.force_setpoint_n == 11.0
    one.write(0, 0)
    assert one.refusal(one.write, 0, 1).reason is R.BYTE_ORDER_UNPROVEN


def test_the_echo_reads_back_as_written_in_either_order(bank, master):
    told = []
    bank.on_accepted = lambda sentence, peer: told.append((sentence, peer))
    master.write_float_cdab(416, 1234.5)
    assert bank.read_registers(416, 2) == bytes.fromhex("5000449A")
    master.write_float(416, 1234.5)
    assert bank.read_registers(416, 2) == bytes.fromhex("449A5000")
    sentences = "byte_order_echo CDAB: use block 300", "byte_order_echo ABCD: use block 200"
    assert told == [(sentence, master.peer) for sentence in sentences]


def test_reserved_words_right_before_the_echo_prove_nothing(register_map):
    """In a map of one's own: in ours the words before it are read only."""
    echo = ByteOrderEcho(register_map.find("byte_order_echo"), RegisterImage(register_map))
    assert echo.write(414, bytes(4), "10.0.0.1") is None
    assert not echo.is_proven_by("10.0.0.1")
    for address, data in ((414, "00010000 449A5000"), (416, "449A5000 00000001")):
        with pytest.raises(Refusal):
            echo.write(address, bytes.fromhex(data), "10.0.0.1")
    assert not echo.is_proven_by("10.0.0.1"), "beside a reserved word that is not 0 it proves nothing either"
    assert echo.write(414, bytes(4) + bytes.fromhex("449A5000"), "10.0.0.1") == "abcd"


def test_the_rig_may_narrow_the_voltage_but_zero_stays(make_bank, master_of):
    bank = make_bank(voltage_min_v=0.5, voltage_max_v=8.0)
    master = master_of(bank, "10.0.0.1")
    assert master.refusal(master.write, 5, 8001).sentence.endswith("allowed 0 and 500 .. 8000 mV (rig demo)")
    assert master.refusal(master.write, 5, 499).reason is R.OUT_OF_RANGE
    master.write(5, 8000)
    master.write(5, 0)
    assert bank.command.voltage_setpoint_v == 0.0


def test_a_limit_that_float32_rounds_away_is_still_reached(make_bank, master_of):
    bank = make_bank(force_max_n=60.1)  # float32(60.1) is 60.0999985, float32(0.1) would be above
    master = master_of(bank, "10.0.0.1")
    master.write(1, 6010)
    assert bank.command.force_setpoint_n == pytest.approx(60.1)
    master.write(1, 0)
    master.write_float(202, 60.1)
    assert bank.command.force_setpoint_n == pytest.approx(60.1)
    narrow = make_bank(force_max_n=40.2)  # float32(40.2) is above 40.2
    master_of(narrow, "10.0.0.1").write_float(202, 40.2)
    assert narrow.command.force_setpoint_n == pytest.approx(40.2)


def test_every_refusal_is_told_with_its_peer(bank, master):
    told = []
    bank.on_refusal = lambda refusal, peer: told.append((refusal.reason, peer))
    master.refusal(master.write, 1, 6500)
    master.refusal(bank.mask_write, 100, 0, 0, master.peer)
    assert told == [(R.OUT_OF_RANGE, master.peer), (R.READ_ONLY, master.peer)]


def test_reserved_words_accept_zero(bank, master):
    before = bank.command
    for address in (14, 226, 227, 264, 401, 1646, 1651):
        master.write(address, 0)
    master.write(13, 0, 0, 0)
    assert bank.command.force_setpoint_n == before.force_setpoint_n
