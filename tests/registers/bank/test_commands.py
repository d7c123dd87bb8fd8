"""Accepted writes: one snapshot each, three faces of it, edge bits that act each time, and the ways to stop."""

import math
import struct
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.codes.refusals import RefusalReason
from gateway.modbus import Peer
from gateway.registers import BankRules, Command, RegisterBank
from gateway.registers.command import NO_BEAT
from gateway.registers.refusal import Refusal
from gateway.registers.words import ControlBit, Mode
from tests.calibrations.coefficients import calibration

OWNER_IP = 116


def test_enable_and_setpoint_in_one_write_are_one_command(master, commands):
    master.write(0, 1, 1200)
    (command,) = commands
    assert command == Command(
        control_word=ControlBit.ENABLE,
        force_setpoint_n=12.0,
        number=1,
        received_s=7.0,
        peer="10.0.0.1",
        channel=NO_BEAT,
    )


def test_a_whole_block_is_one_snapshot_in_si_units(master, commands):
    master.write(0, 1, 1234, 205, 1, 9, 2500, -900, 150, 300, 600, 77, 50, 200)
    (command,) = commands
    assert command.mode is Mode.VOLTAGE
    assert (command.force_setpoint_n, command.force_ramp_n_per_s, command.heartbeat) == (12.34, 20.5, 9)
    assert (command.voltage_setpoint_v, command.precontact_force_n, command.contact_ramp_s) == (2.5, 1.5, 0.3)
    assert command.tilt_angle_rad == pytest.approx(-math.pi / 2)
    assert (command.payload_kg, command.command_sequence) == (0.6, 77)
    assert (command.in_band_tolerance_n, command.in_band_time_s) == (0.5, 0.2)


def test_the_three_faces_show_the_same_command(bank, master):
    master.write(0, 1, 1250, 205)
    assert (master.float(200), master.float(202), master.float(204)) == (1.0, 12.5, 20.5)
    assert bank.read_registers(302, 2) == bytes.fromhex("0000 4148")
    master.write_float_cdab(302, 20.25)
    assert (master.word(1), master.float(202)) == (2025, 20.25)
    master.write_float(202, 30.0)
    assert (master.word(1), bank.read_registers(302, 2)) == (3000, bytes.fromhex("0000 41F0"))


def test_a_float_keeps_the_digits_that_int16_cannot_show(bank, master):
    master.write_float(202, 12.3456)
    master.write(4, 1)
    assert bank.command.force_setpoint_n == pytest.approx(12.3456, abs=1e-6)
    assert master.word(1) == 1235


def test_a_float_block_is_one_snapshot_too(master, commands):
    master.write_float(200, 1.0, 12.0, 100.0)
    (command,) = commands
    assert (command.control_word, command.force_setpoint_n, command.force_ramp_n_per_s) == (1, 12.0, 100.0)


def test_reserved_words_at_the_end_of_a_float_write_may_be_cut(master, commands):
    master.write(224, *struct.unpack(">2H", struct.pack(">f", 200.0)), 0)
    assert commands[-1].in_band_time_s == 0.2
    master.write(227, 0, 0)
    assert master.refusal(master.write, 227, 0, 5).address == 228


@given(raw=st.integers(-1800, 1800), block=st.sampled_from([212, 312]))
def test_int16_and_float_mean_the_same(register_map, raw, block):
    bank = RegisterBank(register_map, BankRules(rig_name="demo", force_max_n=60.0), now=lambda: 0.0)
    peer = Peer("10.0.0.1")
    bank.write_registers(6, struct.pack(">h", raw), peer)
    by_word, shown = bank.command.tilt_angle_rad, bank.read_registers(block, 2)
    bank.write_registers(6, b"\0\0", peer)
    bank.write_registers(block, shown, peer)
    assert bank.read_registers(6, 1) == struct.pack(">h", raw)
    assert bank.read_registers(block, 2) == shown
    assert bank.command.tilt_angle_rad == pytest.approx(by_word, rel=1e-6, abs=1e-12)


def test_edge_bits_act_each_time_they_are_written(master, commands):
    for _ in range(2):
        master.write(0, ControlBit.ENABLE | ControlBit.TARE)
        assert master.word(0) == ControlBit.ENABLE
        assert master.float(200) == 1.0
    assert [command.control_word for command in commands] == [ControlBit.ENABLE | ControlBit.TARE] * 2
    assert [command.number for command in commands] == [1, 2]
    master.write(4, 1)
    assert commands[-1].control_word == ControlBit.ENABLE


def test_clearing_enable_clears_word_and_setpoints(bank, master, commands):
    master.write(0, 1, 1200, 0, 1, 0, 3000)
    master.write(0, 0)
    assert (commands[-1].control_word, commands[-1].force_setpoint_n, commands[-1].voltage_setpoint_v) == (0, 0.0, 0.0)
    assert bank.read_registers(0, 6) == bytes.fromhex("0000 0000 0000 0001 0000 0000")
    assert (master.float(200), master.float(202), master.float(210)) == (0.0, 0.0, 0.0)


def test_a_setpoint_sent_along_with_a_disable_is_dropped(bank, master):
    master.write(0, 1, 1200)
    master.write(0, 0, 1200)
    assert (master.word(1), bank.command.force_setpoint_n) == (0, 0.0)
    master.write(0, 0, 1200)  # disabled already: this prepares
    assert master.word(1) == 1200


def test_clear_command_is_controls_own_and_not_a_new_command(bank, master, commands):
    master.write(0, 1, 1200, 50)
    bank.clear_command()
    assert (bank.command.control_word, bank.command.force_setpoint_n, bank.command.number) == (0, 0.0, 1)
    assert bank.command.force_ramp_n_per_s == 5.0
    assert (master.word(0), master.word(1), master.word(2), master.float(202)) == (0, 0, 50, 0.0)
    assert len(commands) == 1
    bank.clear_command()


def test_what_control_clears_waits_for_no_enable_to_come(bank, master, commands):
    """A voltage or a force of before a fault would be out with the next enable alone."""
    master.write(0, 1, 1200, 50, 1, 7, 2500)
    bank.clear_command()
    assert (bank.command.voltage_setpoint_v, master.word(5)) == (0.0, 0)
    assert (bank.owner, bank.read_registers(OWNER_IP, 2)) == (None, bytes(4))
    master.write(0, 1)
    assert (commands[-1].control_word, commands[-1].force_setpoint_n, commands[-1].voltage_setpoint_v) == (1, 0.0, 0.0)


def test_control_may_clear_inside_its_own_call(bank, master):
    bank.on_command = lambda command: bank.clear_command()
    master.write(0, 1, 1200)
    assert (master.word(0), master.word(1), bank.command.control_word) == (0, 0, 0)


def test_coils_are_read_changed_and_written(bank, master, commands):
    master.write(1, 1200)
    bank.write_bits(0, [True], master.peer)
    assert (commands[-1].control_word, commands[-1].force_setpoint_n) == (1, 12.0)
    bank.write_bits(1, [False, True, False], master.peer)
    assert commands[-1].control_word == ControlBit.ENABLE | ControlBit.TARE
    assert master.word(0) == 1
    bank.write_bits(0, [False] * 16, master.peer)
    assert commands[-1].control_word == 0


def test_coils_meet_the_same_refusals_as_registers(bank, master):
    assert master.refusal(bank.write_bits, 4, [True], master.peer).reason is RefusalReason.UNSUPPORTED_BIT
    for coil in (100, 103):
        refusal = master.refusal(bank.write_bits, coil, [False], master.peer)
        assert (refusal.reason, refusal.address) == (RefusalReason.READ_ONLY, coil), "the coil, and no register"
    assert master.refusal(bank.write_bits, 15, [False, False], master.peer).reason is RefusalReason.ADDRESS
    assert master.refusal(bank.write_bits, 40001, [False], master.peer).code == 2


def test_a_mask_write_goes_through_the_same_checks(bank, master, commands):
    master.write(1, 0x0101)
    bank.mask_write(1, 0x00FF, 0x0200, master.peer)
    assert master.word(1) == 0x0201
    assert commands[-1].force_setpoint_n == 5.13
    bank.mask_write(1, 0xFFF0, 0x4444, master.peer)  # bits of the word that the and-mask keeps are not the or-mask's
    assert master.word(1) == 0x0204
    assert master.refusal(bank.mask_write, 1, 0, 0x7000, master.peer).reason is RefusalReason.OUT_OF_RANGE
    assert master.refusal(bank.mask_write, 202, 0, 1, master.peer).reason is RefusalReason.HALF_VALUE
    assert master.refusal(bank.mask_write, 500, 0, 1, master.peer).reason is RefusalReason.ADDRESS
    bank.mask_write(0, 0xFFFE, 0x0001, master.peer)
    assert commands[-1].control_word == ControlBit.ENABLE


def test_last_writers_are_kept_by_name(bank, master):
    master.write(0, 1, 1200)
    master.write_float_cdab(308, 5.0)
    assert bank.last_writer == dict.fromkeys(("control_word", "force_setpoint", "heartbeat"), (master.peer, 7.0))


def test_people_are_told_what_changed_and_not_of_heartbeats(bank, master):
    told = []
    bank.on_accepted = lambda sentence, peer: told.append(sentence)
    master.write(0, 1, 1200)
    master.write(4, 1, 0)
    master.write(0, 5, 1300)
    master.write(0, 0)
    assert told == [
        "control_word 0 -> 1, force_setpoint 0.00 N -> 12.00 N, owner nobody -> 10.0.0.1",
        "force_setpoint 12.00 N -> 13.00 N, tare",
        "control_word 1 -> 0, force_setpoint 13.00 N -> 0.00 N, owner 10.0.0.1 -> nobody",
    ]


def test_the_command_is_handed_on_before_anybody_is_told(bank, master):
    order = []
    bank.on_accepted = lambda sentence, peer: order.append("told")
    bank.on_command = lambda command: order.append("commanded")
    master.write(1, 100)
    assert order == ["commanded", "told"]


def test_values_at_their_limits_are_taken(make_bank, master_of):
    master = master_of(make_bank(setpoint_min_n=2.0), "10.0.0.1")
    for address, word in ((1, 6000), (1, 200), (6, -1800), (6, 1800), (2, 32767), (5, 10000), (7, 6000), (3, 1)):
        master.write(address, word)
        assert master.word(address) == word & 0xFFFF
    assert "allowed 0 and 2 .. 60 N" in master.refusal(master.write, 1, 199).sentence


def test_an_enumeration_is_told_by_its_name(bank, master):
    told = []
    bank.on_accepted = lambda sentence, peer: told.append(sentence)
    master.write(3, 1)
    assert told == ["mode 0 (force) -> 1 (voltage)"]


@pytest.mark.parametrize(("bit", "name"), [(32, "start_calibration"), (64, "start_self_test")])
def test_a_bit_that_was_held_beyond_its_run_begins_none_until_it_was_0(make_bank, master_of, bit, name):
    """Held by its owner's cyclic writes; neither a write beside the control word, nor another coil of it, nor another master's
    lets it go."""
    bank = make_bank(supported_bits=ControlBit(127))
    master, other = master_of(bank, "10.0.0.1"), master_of(bank, "10.0.0.2")
    master.write(0, bit)
    master.write(0, bit)
    bank.clear_command()  # the run is over
    master.write(4, 99)
    other.write(4, 7)
    bank.write_bits(4, [False], master.peer)
    refusal = master.refusal(master.write, 0, bit)
    assert (refusal.code, refusal.reason, refusal.value) == (4, RefusalReason.CALIBRATION_HELD, bit)
    assert refusal.sentence.endswith(f"{name} was kept at 1 beyond the end of its run: write it as 0 once, then as 1")
    master.write(0, 0)
    master.write(0, bit)
    assert master.word(0) == bit


def test_a_setpoint_lowered_twice_is_told_as_it_was_asked_for_first(make_bank, master_of):
    bank = make_bank()
    master = master_of(bank, "10.0.0.1")
    master.write(0, 1, 5000)
    for high_n, left in ((40.0, 4000), (30.0, 3000)):
        sentence = bank.set_active_model(calibration(force_limits_n=(0.0, high_n)))
        assert f"to {left / 100:.2f} N" in sentence and master.word(1) == left
        assert bank.command.force_requested_n == 50.0
    master.write(4, 8)  # a heartbeat changes nothing of what was asked for
    assert (bank.command.force_setpoint_n, bank.command.force_requested_n) == (30.0, 50.0)
    master.write(1, 1000)
    master.write(4, 9)
    assert (bank.command.force_setpoint_n, bank.command.force_requested_n) == (10.0, 10.0)


def test_words_that_were_taken_once_are_judged_anew_by_other_limits(bank, master):
    """A master that writes in cycles sends the same words again and again; what they mean is remembered."""
    master.write(0, 1, 5000)
    bank.set_active_model(calibration(force_limits_n=(0.0, 40.0)))
    assert master.refusal(master.write, 0, 1, 5000).reason is RefusalReason.OUT_OF_RANGE


def test_the_same_words_at_another_address_are_another_value(bank, master):
    master.write(4, 1200)
    master.write(1, 1200)
    assert (bank.command.heartbeat, bank.command.force_setpoint_n) == (1200, 12.0)
    master.write(4, 9999)
    assert master.refusal(master.write, 1, 9999).reason is RefusalReason.OUT_OF_RANGE


def test_what_was_asked_for_before_control_cleared_is_no_request_any_more(bank, master):
    master.write(0, 1, 5000)
    bank.set_active_model(calibration(force_limits_n=(0.0, 40.0)))
    bank.clear_command()
    master.write(4, 8)
    assert bank.command.force_requested_n == 0.0


def test_a_calibration_whose_force_begins_at_nothing_takes_the_smallest_setpoint(bank, master):
    bank.set_active_model(replace(calibration(), force_limits_n=(0.0, 50.0)))
    master.write(1, 1)
    assert bank.command.force_setpoint_n == 0.01


def test_a_write_of_nothing_is_refused(bank):
    with pytest.raises(Refusal) as caught:
        bank.write_registers(0, b"", Peer("10.0.0.1"))
    assert caught.value.reason is RefusalReason.ADDRESS
