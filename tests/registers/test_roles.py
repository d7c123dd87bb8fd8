"""Who may write what: every block by every role and every function, and how a role that may not is told."""

import struct
from itertools import product

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.modbus import Peer, Role, answer
from gateway.registers.map.register_map import Block
from gateway.registers.roles import WRITE_ROLES, render_roles, role_refusal, write_roles

ZERO_WORD = {
    "command": 4,
    "float_abcd": 208,
    "float_cdab": 308,
    "proof": 430,
    "staging": 1000,
    "status": 101,
    "active": 1500,
}
"""A word of each block to which 0 may be written, for who may at all; the last two are read only."""


def test_a_monitor_may_write_no_block_and_who_commands_no_coefficients() -> None:
    assert min(WRITE_ROLES.values()) is Role.SETPOINT and WRITE_ROLES["staging"] is Role.CALIBRATION


def requests(address: int) -> dict[int, bytes]:
    """Function: a request that writes two words of 0 at the address, or one where the function knows no more."""
    return {
        6: struct.pack(">BHH", 6, address, 0),
        16: struct.pack(">BHHBI", 16, address, 2, 4, 0),
        22: struct.pack(">BHHH", 22, address, 0, 0),
        23: struct.pack(">BHHHHBI", 23, 100, 1, address, 2, 4, 0),
    }


def is_cut(block: str, function: int) -> bool:
    """Half of a float is refused whoever writes it."""
    return block in ("float_abcd", "float_cdab") and function in (6, 22)


@pytest.mark.parametrize(("block", "role"), [*product(ZERO_WORD, Role)])
def test_each_role_writes_its_blocks_by_every_function_and_no_other(make_bank, block, role):
    needed = WRITE_ROLES[block]
    for function, request in requests(ZERO_WORD[block]).items():
        bank = make_bank()
        got = answer(request, bank, Peer("10.0.0.1", role=role))
        if block in ("status", "active"):
            assert got == bytes([function | 0x80, 2])
        elif role < needed:
            assert got == bytes([function | 0x80, 1])
            assert bank.last_refusal and bank.last_refusal.reason is RefusalReason.ROLE
            assert bank.last_writer == {}
        elif is_cut(block, function):
            assert got == bytes([function | 0x80, 3])
        else:
            assert got[0] == function


@pytest.mark.parametrize("role", list(Role))
def test_coils_need_what_the_control_word_needs(make_bank, role):
    for function, request in {5: struct.pack(">BHH", 5, 1, 0), 15: struct.pack(">BHHBB", 15, 0, 2, 1, 0)}.items():
        got = answer(request, make_bank(), Peer("10.0.0.1", role=role))
        assert got[0] == (function if role >= WRITE_ROLES["command"] else function | 0x80)


@pytest.mark.parametrize("role", list(Role))
def test_everybody_reads_everything(make_bank, register_map, role):
    bank = make_bank()
    for block, function in product(register_map.blocks, (3, 4)):
        assert answer(struct.pack(">BHH", function, block.first, 2), bank, Peer("10.0.0.1", role=role))[0] == function


def test_a_monitor_does_not_even_stop(master, master_of, commands):
    """Any peer with the role setpoint may clear enable; one without may not."""
    master.write(0, 1, 1200)
    watcher = master_of(master.bank, "10.0.0.2", Role.MONITOR)
    refusal = watcher.refusal(watcher.write, 0, 0)
    assert (refusal.code, refusal.reason, master.word(119)) == (1, RefusalReason.ROLE, RefusalReason.ROLE)
    assert len(commands) == 1
    master_of(master.bank, "10.0.0.3").write(0, 0)
    assert not commands[-1].control_word


def test_a_block_that_the_table_has_forgotten_is_locked(register_map):
    assert write_roles([Block("recipes", 2000, 2010)])["recipes"] is Role.ADMIN
    assert {block.name for block in register_map.blocks} == set(WRITE_ROLES), "every block has its line in the table"


@pytest.mark.parametrize(
    ("peer", "address", "cure"),
    [
        (Peer("10.0.0.1"), 1000, "set network.allow_plain_upload"),
        (
            Peer("10.0.0.1", name="robot"),
            1000,
            "certificate that has it (force-gateway certs --client NAME:calibration)",
        ),
        (Peer("10.0.0.1", role=Role.MONITOR), 1, "connect by TLS"),
        (Peer("serial:2", role=Role.MONITOR), 1, "set `role: setpoint` of this face"),
        (Peer("serial:2", role=Role.MONITOR), 1000, "set `role: calibration` of this face"),
    ],
)
def test_the_sentence_says_what_would_help(bank, peer, address, cure):
    answer(struct.pack(">BHH", 6, address, 0), bank, peer)
    assert bank.last_refusal and cure in bank.last_refusal.sentence


@pytest.mark.parametrize("host", ["10.0.0.1", "serial:2"])
def test_what_only_an_admin_may_no_setting_of_the_rig_allows(host):
    told = role_refusal(Peer(host), Block("recipes", 2000, 2010), Role.ADMIN, 2000).sentence
    assert told.endswith("block recipes (2000 .. 2010) needs admin: connect by TLS with a certificate that has it")


def test_the_table_for_people_is_the_one_that_is_asked(register_map):
    lines = render_roles(register_map).splitlines()
    assert lines[0] == "| block | addresses | monitor | setpoint | calibration | admin |"
    assert "| command | 0 .. 15 | read | read, write | read, write | read, write |" in lines
    assert "| staging | 1000 .. 1199 | read | read | read, write | read, write |" in lines
    assert "| status | 100 .. 131 | read | read | read | read |" in lines


def test_a_certificate_owns_and_not_its_address(bank, master_of):
    robot = master_of(bank, "10.0.0.1", name="robot")
    robot.write(0, 1, 1200)
    assert bank.owner == "certificate robot"
    assert bank.read_registers(116, 2) == bytes([10, 0, 0, 1])
    plain = master_of(bank, "10.0.0.1")
    refusal = plain.refusal(plain.write, 1, 1300)
    assert refusal.sentence.startswith("W210 certificate robot owns the setpoint, 10.0.0.1 may read and clear enable")
    master_of(bank, "10.0.0.9", name="robot").write(1, 1300)
    assert bank.command.force_setpoint_n == 13.0


def test_a_byte_order_is_proven_by_a_certificate_and_not_for_its_address(make_bank, master_of):
    bank = make_bank(require_byte_order_echo=True)
    robot, plc = (master_of(bank, "10.0.0.1", name=name) for name in ("robot", "plc"))
    robot.write_float(416, 1234.5)
    assert plc.refusal(plc.write, 0, 1).reason is RefusalReason.BYTE_ORDER_UNPROVEN
    master_of(bank, "10.0.0.9", name="robot").write(0, 1)
    assert bank.owner == "certificate robot"


def test_no_address_is_taken_for_a_certificate():
    assert Peer("10.0.0.1", name="10.0.0.2").identity != Peer("10.0.0.2").identity
