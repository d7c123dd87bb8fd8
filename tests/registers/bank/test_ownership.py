"""One master commands; others read, may stop, and take over only when they say so."""

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.registers import Refusal, Status
from gateway.registers.rig_rules import BASIC_BITS
from gateway.registers.words import ControlBit, State
from gateway.registers.writes.ownership import NOT_IPV4, ip_number

TAKE = int(ControlBit.TAKE_OWNERSHIP)


def test_the_first_that_commands_owns_and_others_get_06(bank, master, other, commands):
    master.write(1, 1200)
    assert bank.owner == "10.0.0.1"
    assert bank.read_registers(116, 2) == bytes([10, 0, 0, 1])
    refusal = other.refusal(other.write, 1, 1300)
    assert (refusal.code, refusal.reason) == (6, RefusalReason.NOT_OWNER)
    assert refusal.sentence.startswith("W210 10.0.0.1 owns the setpoint, 10.0.0.2 may read and clear enable")
    assert len(commands) == 1


def test_only_the_owners_heartbeat_reaches_control(bank, master, other):
    master.write(0, 1, 1200)
    other.refusal(other.write, 4, 9)
    other.refusal(other.write_float, 208, 9.0)
    assert bank.command.heartbeat == 0


def test_a_second_connection_of_the_owners_host_is_the_owner(bank, master, master_of):
    master.write(0, 1, 1200)
    master_of(bank, "10.0.0.1").write(1, 1300)
    assert bank.command.force_setpoint_n == 13.0


STOPS = [
    lambda peer: peer.write(0, 0),
    lambda peer: peer.bank.write_bits(0, [False], peer.peer),
    lambda peer: peer.write(0, 0, 1300, 0, 0, 99),
    lambda peer: peer.write_float(200, 0.0),
    lambda peer: peer.bank.mask_write(0, 0xFFFE, 0, peer.peer),
]


@pytest.mark.parametrize("stop", STOPS)
def test_anybody_may_stop_and_nothing_else_is_taken(bank, master, other, commands, stop):
    master.write(0, 1, 1200, 300, 0, 7)
    stop(other)
    assert (commands[-1].control_word, commands[-1].force_setpoint_n, commands[-1].peer) == (0, 0.0, "10.0.0.2")
    assert (commands[-1].heartbeat, commands[-1].force_ramp_n_per_s) == (7, 30.0)
    assert bank.owner is None
    assert bank.read_registers(116, 2) == bytes(4)


def test_the_whole_block_written_again_undoes_another_s_stop_and_the_words_behind_enable_do_not(bank, master, other):
    """As README and `wiring` say; and a setpoint that goes on being written owns, where 0 does not."""
    master.write(0, 1, 1200, 0, 0, 1)
    other.write(0, 0)
    master.write(1, 1300, 0, 0, 2)
    assert (bank.command.control_word, bank.owner) == (0, "10.0.0.1")
    master.write(1, 0, 0, 0, 3)
    assert (bank.command.control_word, bank.owner) == (0, None)
    master.write(0, 1, 1300, 0, 0, 4)
    assert bank.command.control_word == ControlBit.ENABLE


@pytest.mark.parametrize(("stands", "written", "left"), [(32, 0, 0), (33, 1, 1), (32, 16, 0)])
def test_anybody_may_end_a_run_and_nothing_else_is_taken(make_bank, master_of, stands, written, left):
    """Clearing bit 5 is no request for more; an enable is one, and so is an edge."""
    bank = make_bank(supported_bits=BASIC_BITS | ControlBit.START_CALIBRATION | ControlBit.VALVE_PULL)
    owner, other = master_of(bank, "10.0.0.1"), master_of(bank, "10.0.0.2")
    owner.write(0, stands, 0, 50)
    other.write(0, written, 1300, 70)
    assert (bank.command.control_word, bank.command.force_setpoint_n, bank.command.force_ramp_n_per_s) == (
        left,
        0.0,
        5.0,
    )
    assert other.word(0) == left
    owner.write(0, 32)
    assert other.refusal(other.write, 0, 1).reason is RefusalReason.NOT_OWNER


@pytest.mark.parametrize("edge", [2, 4, 6])
@pytest.mark.parametrize("stands", [1, 32])
def test_an_edge_of_somebody_else_is_refused_and_no_stop(make_bank, master_of, stands, edge):
    """A panel's tare took the force that a robot held, was answered as taken, and nothing was tared."""
    bank = make_bank(supported_bits=BASIC_BITS | ControlBit.START_CALIBRATION)
    owner, other = master_of(bank, "10.0.0.1"), master_of(bank, "10.0.0.2")
    owner.write(0, stands)
    for write, *words in ((other.write, 0, edge), (other.write, 0, edge, 0, 0, 0, 5), (other.write_float, 200, edge)):
        assert other.refusal(write, *words).reason is RefusalReason.NOT_OWNER
    assert bank.command.control_word == stands and bank.owner == "10.0.0.1"


def test_a_takeover_lasts_when_its_command_rests(bank, master, other):
    master.write(0, 1, 1200)
    other.write(0, 1 | 8)
    other.bank.clear_command()
    assert bank.owner == "10.0.0.2"
    assert master.refusal(master.write, 1, 100).reason is RefusalReason.NOT_OWNER


def test_the_audit_hears_who_wrote_what_before_and_who_owned(bank, master):
    heard = []
    bank.on_write = lambda *given: heard.append(given)
    master.write(0, 1, 1200)
    ((peer, before, admitted, owners),) = heard
    assert (peer, before[1], admitted.values[1], owners) == (master.peer, 0.0, 12.0, (None, "10.0.0.1"))


def test_a_stop_when_nothing_runs_is_no_error_and_no_command(master, other, commands):
    master.write(1, 1200)
    other.write(0, 0)
    other.bank.write_bits(0, [False], other.peer)
    assert len(commands) == 1
    assert other.refusal(other.write, 0, 0, 0).reason is RefusalReason.NOT_OWNER


def test_disable_and_neutral_writes_release(bank, master, other):
    master.write(0, 1, 1200)
    master.write(0, 0)
    assert bank.owner is None
    master.write(1, 500)
    assert bank.owner == "10.0.0.1"
    master.write(1, 0)
    assert bank.owner is None
    other.write(4, 5)
    assert bank.owner is None


def test_takeover_is_explicit_bumpless_and_visible(bank, master, other, commands):
    told = []
    bank.on_accepted = lambda sentence, peer: told.append(sentence)
    master.write(0, 1, 1200)
    bank.publish(Status(state=State.HOLDING, force_accepted_n=13.0))
    other.write(0, 1 | TAKE, 1300)
    assert (bank.owner, bank.read_registers(116, 2)) == ("10.0.0.2", bytes([10, 0, 0, 2]))
    assert (commands[-1].control_word, commands[-1].force_setpoint_n) == (1 | TAKE, 13.0)
    assert "owner 10.0.0.1 -> 10.0.0.2" in told[-1]
    assert other.word(0) == 1
    assert master.refusal(master.write, 1, 100).reason is RefusalReason.NOT_OWNER
    bank.write_bits(3, [True], master.peer)
    assert (bank.owner, bank.command.force_setpoint_n) == ("10.0.0.1", 13.0)


def test_a_takeover_that_is_refused_changes_no_owner(bank, master, other):
    master.write(0, 1, 1200)
    other.refusal(other.write, 0, 1 | TAKE, 6500)
    assert bank.owner == "10.0.0.1"


def test_an_owner_that_the_rig_names_stays(make_bank, master_of):
    bank = make_bank(owner="10.0.0.1")
    owner, other = master_of(bank, "10.0.0.1"), master_of(bank, "10.0.0.2")
    assert bank.owner == "10.0.0.1"
    for words in ((1, 100), (0, 1 | TAKE, 100)):
        assert "this rig names its owner" in other.refusal(other.write, *words).sentence
    owner.write(0, 1, 1200)
    other.write(0, 0)
    bank.release_owner()
    assert (bank.owner, bank.command.control_word) == ("10.0.0.1", 0)


def test_the_lease_end_releases(bank, master, other):
    master.write(0, 1, 1200)
    bank.clear_command()
    bank.release_owner()
    other.write(0, 1, 1300)
    assert bank.owner == "10.0.0.2"


def test_the_lease_end_releases_who_took_over_and_shows_it(bank, master):
    master.write(0, 1 | TAKE, 1200)
    bank.clear_command()
    bank.release_owner()
    assert (bank.owner, bank.read_registers(116, 2)) == (None, bytes(4))


def test_the_byte_order_proof_needs_no_ownership(bank, master, other):
    master.write(0, 1, 1200)
    other.write_float(416, 1234.5)
    assert other.float(416) == 1234.5
    assert bank.owner == "10.0.0.1"


@pytest.mark.parametrize(
    ("host", "number"),
    [
        (None, 0),
        ("127.0.0.1", 0x7F000001),
        ("::ffff:10.1.2.3", 0x0A010203),
        ("fe80::1%eth0", NOT_IPV4),
        ("serial", NOT_IPV4),
    ],
)
def test_owner_ip(host, number):
    assert ip_number(host) == number


def test_who_is_no_owner_is_told_what_would_help_on_this_rig(make_bank, master_of):
    for rules, cure in (
        ({}, "write control_word with bit 3 to take over"),
        ({"owner": "10.0.0.1"}, "this rig names its owner"),
    ):
        bank = make_bank(**rules)
        master_of(bank, "10.0.0.1").write(0, 1, 1200)
        other = master_of(bank, "10.0.0.2")
        assert other.refusal(other.write, 1, 1300).sentence.endswith(cure)


@pytest.mark.parametrize(("first", "word"), [(8, "control_word is 0 .. 15"), (108, "status_word is 100 .. 115")])
def test_bits_beyond_a_word_are_refused_with_where_it_ends(bank, first, word):
    with pytest.raises(Refusal, match=word):
        bank.read_bits(first, 9)
    assert len(bank.read_bits(first, 8)) == 1


def test_a_takeover_in_the_write_that_disables_holds(bank, master, other):
    master.write(0, 1, 1200)
    other.write(0, TAKE)
    assert (bank.owner, other.word(0), other.word(1)) == ("10.0.0.2", 0, 0)
    assert master.refusal(master.write, 1, 100).reason is RefusalReason.NOT_OWNER


def test_a_number_that_is_not_the_echo_proves_no_byte_order(make_bank, master_of, register_map):
    bank = make_bank(require_byte_order_echo=True)
    master = master_of(bank, "10.0.0.1")
    echo = register_map.find("byte_order_echo").address
    master.refusal(master.write_float, echo, 1234.0)
    assert master.refusal(master.write, 0, 1).reason is RefusalReason.BYTE_ORDER_UNPROVEN
    assert master.refusal(master.write_float, 200, 1.0).reason is RefusalReason.BYTE_ORDER_UNPROVEN
    master.write_float(echo, 1234.5)
    master.write(0, 1)


def test_a_voltage_that_is_asked_for_owns_too(bank, master, other):
    master.write(5, 3000)
    assert bank.owner == "10.0.0.1"
    assert other.refusal(other.write, 5, 100).reason is RefusalReason.NOT_OWNER
    master.write(5, 0)
    assert bank.owner is None
