"""Whose write stands last, who a serial face is, how numbers are told, and the last self-test in its words."""

import pytest

from gateway.modbus import Peer
from gateway.registers.image import RegisterImage
from gateway.registers.refusal import quantity
from gateway.registers.residual_cause import ResidualCause
from gateway.registers.self_test_words import SelfTestWords
from gateway.registers.values import decimal, float32
from gateway.registers.words import SelfTestResult, SelfTestVerdict
from gateway.registers.writes.ownership import LastWriters, serial_place


def test_who_wrote_the_same_registers_again_wrote_them_last():
    writers, robot, panel = LastWriters(), Peer("10.0.0.1"), Peer("10.0.0.2")
    writers.note(("mode", "heartbeat"), robot, 1.0)
    writers.note(("heartbeat",), panel, 2.0)
    assert writers.by_name() == {"mode": (robot, 1.0), "heartbeat": (panel, 2.0)}
    writers.note(("mode", "heartbeat"), robot, 3.0)
    assert writers.by_name() == {"mode": (robot, 3.0), "heartbeat": (robot, 3.0)}


def test_who_stops_another_s_force_with_a_whole_block_wrote_the_control_word_alone(bank, master, other):
    """Nothing else of it is taken; the page and the monitor named the stopper for a ramp that was the owner's."""
    master.write(0, 1, 1200, 300, 0, 7)
    other.write(0, 0, 1300, 500, 0, 99)
    writers = {name: peer for name, (peer, _) in bank.last_writer.items()}
    assert writers["control_word"] == other.peer and bank.command.force_ramp_n_per_s == 30.0
    assert {writers[name] for name in ("force_setpoint", "force_ramp", "mode", "heartbeat")} == {master.peer}


@pytest.mark.parametrize(
    ("host", "place"),
    [
        ("serial:1", 1),
        ("serial:255", 255),
        ("serial:256", None),
        ("serial:0", None),
        ("serial:01", None),
        ("serial:", None),
        ("serial:x", None),
        ("7", None),
        ("10.0.0.1", None),
    ],
)
def test_a_serial_face_is_known_by_its_place(host, place):
    assert serial_place(host) == place


def test_the_bank_shows_its_self_test_to_masters(bank, register_map):
    bank.self_test.show(1, SelfTestResult.WARNED, {})
    address = register_map.find("self_test_result").address
    assert bank.read_registers(address, 1) == bytes((0, SelfTestResult.WARNED))


def test_a_self_test_is_shown_with_its_result_its_count_and_what_was_not_tested(register_map):
    image = RegisterImage(register_map)
    words = SelfTestWords(register_map, image)
    words.show(65537, SelfTestResult.PASSED, {"noise": SelfTestVerdict.PASSED})
    shown = {
        one.name: image.word(one.address)
        for one in register_map.registers_of("proof")
        if one.name.startswith("self_test_")
    }
    assert shown.pop("self_test_result") == SelfTestResult.PASSED
    assert shown.pop("self_test_count") == 1
    assert shown.pop("self_test_noise") == SelfTestVerdict.PASSED
    assert set(shown.values()) == {SelfTestVerdict.NOT_TESTED} and len(shown) > 3


@pytest.mark.parametrize(
    ("value", "told"),
    [
        (0.0, "0.00 N"),
        (0.5, "0.50 N"),
        (0.001, "0.00 N"),
        (0.0009, "0.0009 N"),
        (-12.0, "-12.00 N"),
        (1.0e7, "1e+07 N"),
    ],
)
def test_a_number_is_told_by_its_decimals_unless_they_hide_or_swell_it(value, told):
    assert quantity(value, 2, "N") == told


@pytest.mark.parametrize("number", [25.3, 0.1, 30.23067, 2.672501, 51.0, 1.0e-3])
def test_a_float32_is_told_by_the_shortest_decimal_that_it_stands_for(number):
    assert decimal(float32(number)) == number


def test_an_effect_that_nobody_knows_is_unknown():
    assert ResidualCause.of_effect("creep") is ResidualCause.CREEP
    assert ResidualCause.of_effect("no-such-effect") is ResidualCause.UNKNOWN


def test_repeated_floats_keep_the_word_order_of_their_block(register_map):
    orders = {
        block: {one.word_order for one in register_map.registers_of(block)} for block in ("float_abcd", "float_cdab")
    }
    assert {block: {str(order).lower() for order in found} for block, found in orders.items()} == {
        "float_abcd": {"abcd"},
        "float_cdab": {"cdab"},
    }
