"""A valve's device: its own words, both directions, the readback, and whatever else comes along the wire."""

import pytest

from gateway.devices import ValveDevice, ValveDirection, ValveHost
from gateway.devices.binary.rtu_framing import rtu_frame
from gateway.devices.messages import Garbage
from gateway.profiles import list_shipped
from gateway.profiles.find import shipped_profiles_folder
from gateway.profiles.kinds.devices import read_device
from gateway.profiles.strict_yaml.text import parse
from tests.profile_files import load_device

PUSH, PULL = ValveDirection
VALVES = ("mcu-valve", "waveshare-relay")


def test_waveshares_own_frames() -> None:
    """Those of its wiki: relay 0 on, relay 0 off, read all eight."""
    host = ValveHost(load_device("waveshare-relay"))
    assert host.request(PULL) == bytes.fromhex("01050000FF008C3A")
    assert host.receive(bytes.fromhex("01050000FF008C3A")) == [PULL]
    assert host.request(PUSH) == bytes.fromhex("010500000000CDCA")
    assert host.request(None) == bytes.fromhex("0101000000083DCC")
    assert host.receive(bytes.fromhex("010101019048")) == [PULL]


@pytest.mark.parametrize("name", VALVES)
def test_both_ends_understand_each_other_however_the_bytes_come(name: str) -> None:
    host, device = ValveHost(load_device(name)), ValveDevice(load_device(name))
    for direction in (PULL, PUSH, PULL):
        for question in (direction, None):
            (heard,) = [one for byte in host.request(question) for one in device.receive(bytes([byte]))]
            assert heard == question
            answer = device.reply(question, direction)
            assert [one for byte in answer for one in host.receive(bytes([byte]))] == [direction]


@pytest.mark.parametrize("name", VALVES)
def test_what_was_not_asked_or_is_broken_tells_no_direction(name: str) -> None:
    host, device = ValveHost(load_device(name)), ValveDevice(load_device(name))
    answer = device.reply(None, PULL)
    assert all(isinstance(one, Garbage) for one in host.receive(answer))
    host.request(None)
    assert all(isinstance(one, Garbage) for one in host.receive(answer[:-2] + b"!" + answer[-1:]))
    host.request(PUSH)
    assert PUSH not in host.receive(device.reply(PULL, PULL)), "the answer to another setting is none to this one"


def test_a_modbus_relay_that_answers_otherwise_is_quoted_and_its_late_answers_are_not() -> None:
    """With another relay on power and wires were blamed, of one that answers each question."""
    host = ValveHost(load_device("waveshare-relay"))
    host.request(None)
    for body, said in ((b"010103", "'010103'"), (b"050000FF00", ""), (b"8102", "exception 2 (illegal data address)")):
        assert [type(one) for one in host.receive(rtu_frame(1, body))] == [Garbage]
        assert host.said == said
    host.receive(rtu_frame(2, b"010103"))
    assert host.said == "", "another unit's"


def test_a_valve_that_answers_in_other_words_is_quoted_and_what_is_no_text_is_not() -> None:
    host, wrong = ValveHost(load_device("mcu-valve")), ("ERR COIL", "'ERR COIL'")
    for body, said in (wrong, ("\x81\x02", ""), wrong):
        host.request(PULL)
        host.receive(f"{body}\n".encode("latin-1"))
        assert host.said == said
        host.forget()


@pytest.mark.parametrize("name", VALVES)
def test_an_answer_that_comes_twice_or_behind_a_lost_port_answers_nothing(name: str) -> None:
    host, device = ValveHost(load_device(name)), ValveDevice(load_device(name))
    answer = device.reply(None, PULL)
    host.request(None)
    assert [PULL in host.receive(answer) for _ in range(2)] == [True, False]
    host.request(None)
    host.forget()
    assert PULL not in host.receive(answer)


@pytest.mark.parametrize("name", VALVES)
def test_what_was_left_of_an_answer_before_is_no_part_of_the_next(name: str) -> None:
    host, device = ValveHost(load_device(name)), ValveDevice(load_device(name))
    answer = device.reply(None, PULL)
    host.request(None)
    assert host.receive(answer[:3]) == []
    host.request(None)
    assert host.receive(answer) == [PULL]


def test_shipped_valves_are_of_the_role_and_say_what_they_are() -> None:
    assert set(VALVES) <= set(list_shipped("device"))
    for name in VALVES:
        profile = load_device(name)
        assert profile.role == "valve" and profile.hardware == "never run on hardware"
        with pytest.raises(ValueError, match="is needed here"):
            ValveHost(load_device("smc-itv-rc"))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (("words: {PUSH: push, PULL: pull}", "words: {PUSH: push}"), "words must say which word means push"),
        (('"VALVE PULL", answer', '"VALVE PUSH", answer'), "push and pull both say"),
        (("{state:PUSH|PULL}", "PULL"), "needs a field {state:A|B}"),
        (("role: valve", "role: output"), "belong to a valve"),
    ],
)
def test_a_valve_file_that_cannot_work_is_told_so(change: tuple[str, str], sentence: str) -> None:
    shipped = (shipped_profiles_folder() / "devices" / "mcu-valve.yaml").read_text(encoding="utf-8")
    changed = shipped.replace(*change)
    assert changed != shipped
    _, faults = read_device(parse(changed.encode(), "mcu-valve.yaml"))
    assert any(sentence in fault.message for fault in faults), faults
