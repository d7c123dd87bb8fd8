"""A value at the very end of what a rig allows is taken, in a word as in a float; one beyond is told with the range."""

import struct
from copy import deepcopy

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.registers import BankRules, RegisterBank
from gateway.registers.map.map_reader import read_map
from tests.calibrations.coefficients import calibration

FORCE, FORCE_FLOAT, MODE_FLOAT, PRECONTACT, VOLTAGE, PAYLOAD = 1, 202, 206, 7, 5, 9


def test_the_least_force_of_a_rig_and_0_are_taken_in_words_and_floats(make_bank, master_of):
    """2.1 N is no float32: the nearest one is a little less, and is what a master sends."""
    master = master_of(make_bank(setpoint_min_n=2.1), "10.0.0.1")
    for word in (210, 0, 6000):
        master.write(FORCE, word)
        assert master.word(FORCE) == word
    for force_n in (2.1, 0.0, 60.0):
        master.write_float(FORCE_FLOAT, force_n)
        assert master.float(FORCE_FLOAT) == pytest.approx(force_n)
    master.write(PRECONTACT, 100)
    assert master.word(PRECONTACT) == 100, "the least is that of the force to hold"
    for act, value in ((master.write, 209), (master.write_float, 2.09)):
        refused = master.refusal(act, FORCE if act == master.write else FORCE_FLOAT, value)
        assert "allowed 0 and 2.1 .. 60 N" in refused.sentence


def test_a_least_force_of_less_than_a_newton_is_one_as_well(make_bank, master_of):
    master = master_of(make_bank(setpoint_min_n=0.5), "10.0.0.1")
    master.write(FORCE, 50)
    assert "allowed 0 and 0.5 .. 60 N" in master.refusal(master.write, FORCE, 49).sentence


def test_a_force_in_words_without_a_sign_has_its_hundredths_as_a_float_too(document, master_of):
    """A map of one's own for forces up to 655.35 N: 12.5 N as a float was "not a whole number"."""
    document = deepcopy(document)
    force = next(one for one in document["blocks"]["command"]["registers"] if one["name"] == "force_setpoint")
    force |= {"type": "uint16", "max": 655.35}
    bank = RegisterBank(read_map(document), BankRules(rig_name="demo", force_max_n=600.0), now=lambda: 7.0)
    master = master_of(bank, "10.0.0.1")
    master.write_float(FORCE_FLOAT, 12.5)
    assert master.word(FORCE) == 1250
    master.write(FORCE, 50000)
    assert master.float(FORCE_FLOAT) == 500.0
    assert "not a whole number" in master.refusal(master.write_float, MODE_FLOAT + 2, 1.5).sentence


def test_a_rig_with_all_of_the_maps_force_has_its_own_least(make_bank, master_of):
    master = master_of(make_bank(force_max_n=400.0, setpoint_min_n=2.0), "10.0.0.1")
    master.write(FORCE, 32767)
    assert "allowed 0 and 2 .. 327.67 N (rig demo)" in master.refusal(master.write, FORCE, 199).sentence


def test_the_largest_force_in_swapped_words_is_known_as_that(make_bank, master_of):
    master = master_of(make_bank(), "10.0.0.1")
    refused = master.refusal(master.write_float_cdab, FORCE_FLOAT, 60.0)
    assert refused.reason is RefusalReason.WORDS_SWAPPED and "with the words swapped 60.00 N" in refused.sentence


def test_a_mode_that_is_no_number_is_refused_as_any_other_value(make_bank, master_of):
    """Also where its words the other way round were a mode."""
    master = master_of(make_bank(), "10.0.0.1")
    assert master.refusal(master.write_float, MODE_FLOAT, float("nan")).reason is RefusalReason.NOT_FINITE
    (swapped,) = struct.unpack(">f", struct.pack(">HH", 0x7FC0, 0x3F80))
    refused = master.refusal(master.write_float, MODE_FLOAT, swapped)
    assert refused.reason is RefusalReason.WORDS_SWAPPED and "nan" in refused.sentence


def test_a_limit_is_told_with_what_has_set_it(make_bank, master_of):
    master = master_of(make_bank(force_source="calibration 3", voltage_max_v=8.0), "10.0.0.1")
    assert "(calibration 3)" in master.refusal(master.write, FORCE, 6001).sentence
    assert "(calibration 3)" in master.refusal(master.write, PRECONTACT, 6001).sentence
    assert "(rig demo)" in master.refusal(master.write, 5, 8001).sentence
    assert "(map force-v1)" in master.refusal(master.write, 8, 10001).sentence


def test_a_number_is_the_same_command_as_a_word_and_as_a_float(make_bank, master_of):
    """2.3 and 40.2 are no float32: the nearest one is a little less, or a little more, than what is meant."""
    bank = make_bank(force_max_n=327.67)
    master = master_of(bank, "10.0.0.1")
    for count in range(1, 32768, 37):
        master.write(FORCE, count)
        by_word = bank.command.force_setpoint_n
        master.write_float(FORCE_FLOAT, count / 100)
        assert bank.command.force_setpoint_n == by_word
        assert master.float(FORCE_FLOAT) == struct.unpack(">f", struct.pack(">f", count / 100))[0], "as it was written"


@pytest.mark.parametrize("limit_n", [40.2, 40.205, 40.200000123, 40.204999999])
def test_a_float_at_the_limit_is_the_limit_and_no_more(make_bank, master_of, limit_n):
    bank = make_bank(force_max_n=limit_n)
    master_of(bank, "10.0.0.1").write_float(FORCE_FLOAT, limit_n)
    assert bank.command.force_setpoint_n <= limit_n


def test_the_largest_voltage_of_a_rig_is_taken_whatever_it_is(make_bank, master_of):
    """1000 times 8.03 is 8029.999999999999, and there are 174 others of which a product is not the number."""
    inexact = [millivolts for millivolts in range(1, 10001) if 1000 * (millivolts / 1000) != millivolts]
    for millivolts in (*inexact, 10000):
        master = master_of(make_bank(voltage_max_v=millivolts / 1000), "10.0.0.1")
        master.write(VOLTAGE, millivolts)
        assert master.word(VOLTAGE) == millivolts
        if millivolts < 10000:
            master.refusal(master.write, VOLTAGE, millivolts + 1)


def test_a_setpoint_that_a_calibration_lowers_may_be_written_as_it_reads(make_bank, master_of):
    """25.346 N read as 25.35 N: who writes back what it reads was refused for more than the limit."""
    for high_n, word in ((25.346, 2534), (0.29, 29), (40.2, 4020)):
        bank = make_bank()
        master = master_of(bank, "10.0.0.1")
        master.write(0, 1, 5000)
        assert f"to {word / 100:.2f} N" in bank.set_active_model(calibration(force_limits_n=(0.0, high_n)))
        assert master.word(FORCE) == word and bank.command.force_setpoint_n == word / 100
        master.write(FORCE, word)


def test_a_payload_heavier_than_the_load_cell_bears_is_refused(make_bank, master_of):
    """32.7 kg on a cell of 10 kg were accepted, and the next reading was an over-force."""
    master = master_of(make_bank(payload_max_kg=10.0007), "10.0.0.1")
    master.write(PAYLOAD, 10000)
    master.write_float(200 + 2 * PAYLOAD, 2500.5)
    for act, address, grams in ((master.write, PAYLOAD, 10001), (master.write_float, 200 + 2 * PAYLOAD, 32000)):
        refused = master.refusal(act, address, grams)
        assert refused.reason is RefusalReason.OUT_OF_RANGE
        assert f"payload = {grams} g, allowed 0 .. 10000 g (rig demo)" in refused.sentence
    assert master.float(200 + 2 * PAYLOAD) == 2500.5
    unbounded = master_of(make_bank(), "10.0.0.1")
    unbounded.write(PAYLOAD, 32767)
    assert unbounded.word(PAYLOAD) == 32767
