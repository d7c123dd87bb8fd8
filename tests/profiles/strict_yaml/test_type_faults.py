"""What a wrong type, bound or key is told: what was seen, what is allowed, what was probably meant, and where."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import pytest
from pydantic import Discriminator

from gateway.defaults import STRICT
from gateway.profiles.rigs.rig_file import RigFile
from gateway.profiles.strict_yaml.text import parse
from gateway.profiles.strict_yaml.typed import build

DEMO = (Path(__file__).parents[3] / "profiles" / "rigs" / "demo.yaml").read_text(encoding="utf-8")


def told(*edits: tuple[str, str]) -> list[str]:
    """The faults of demo.yaml after `old -> new` edits, each without the file's name."""
    source = DEMO
    for old, new in edits:
        assert source.count(old) == 1, old
        source = source.replace(old, new)
    _, faults = build(RigFile, parse(source.encode(), "rig.yaml"))
    return [str(fault).removeprefix("rig.yaml:") for fault in faults]


def line_of(text: str) -> int:
    return DEMO[: DEMO.index(text)].count("\n") + 1


def test_a_list_is_not_too_short_because_of_its_wrong_entries() -> None:
    (fault,) = told(("units: [0, 1, 255]", "units: [300]"))
    assert fault.endswith("network.units[0]: 300 is above 255, the most allowed")
    (fault,) = told(("units: [0, 1, 255]", "units: []"))
    assert fault.endswith("network.units: has 0 entries, at least 1 are needed")


def test_the_example_of_the_first_hour() -> None:
    source = "name: cell\ncalibration: demo\noutput:\n  device: smc-itv-rc\n  baud: 115300\n"
    _, faults = build(RigFile, parse(source.encode(), "rig.yaml"))
    (told,) = (str(fault) for fault in faults if fault.path == "output.baud")
    assert told.startswith("rig.yaml:5:9 output.baud: 115300 is not one of 300, 600, 1200, 2400, 4800, 9600, ")
    assert told.endswith("4000000; did you mean 115200?")


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("baud: 9600", "boud: 9600", "output.boud: is not a known key; did you mean baud?"),
        ("force_max_n: 60", "force_max: 60",
         "limits.force_max: is not a known key; did you mean force_max_n? (a key ends with its unit)"),
        ("lease_s: null", "lease_ms: 200", "supervision.lease_ms: is not a known key; this quantity is given as lease_s: 0.2"),
        ("lease_s: null", "lease: 200",
         "supervision.lease: is not a known key; did you mean lease_s? (a key ends with its unit)"),
        ("limit_v: 0.5", "limit_mv: 500", "trim.limit_mv: is not a known key; this quantity is given as limit_v: 0.5"),
        ("force_ramp_n_per_s: 200", "force_ramp_n_per_ms: 0.2",
         "defaults.force_ramp_n_per_ms: is not a known key; this quantity is given as force_ramp_n_per_s: 200"),
        ("sign: 1", "over_force_n: 1", "load_cell.over_force_n: is not a known key here; it belongs under limits"),
        ("sign: 1", "parity: even", "load_cell.parity: is not a known key here; it belongs under `serial` in the device's"),
        ("limit_v: 0.5", "unit: 1", "trim.unit: is not a known key here; it belongs under load_cell or fieldbus"),
        ("bind: 127.0.0.1", "xyz: 1", "network.xyz: is not a known key; known are bind, port, "),
    ],
)  # fmt: skip
def test_an_unknown_key_is_placed_at_the_key_with_what_was_meant(old: str, new: str, sentence: str) -> None:
    (fault,) = told((old, new))
    assert fault.startswith(f"{line_of(old)}:3 {sentence}")


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("seed: 7", 'seed: "7"', 'seed: "7" is not a whole number: write 7 (take the quotes away)'),
        ("seed: 7", "seed: 7.0", "seed: 7.0 is not a whole number: write 7"),
        ("seed: 7", "seed: -1", "seed: -1 is below 0, the least allowed"),
        ("loop_hz: 100", "loop_hz: 49", "loop_hz: 49 Hz is below 50 Hz, the least allowed"),
        ("loop_hz: 100", "loop_hz: 251", "loop_hz: 251 Hz is above 250 Hz, the most allowed"),
        ("loop_hz: 100", "loop_hz: true", "loop_hz: true is not a number"),
        ("loop_hz: 100", "loop_hz: 100 Hz", 'loop_hz: "100 Hz" is not a number: write 100 (the unit stands in the key)'),
        ("loop_hz: 100", "loop_hz: 100Hz", 'loop_hz: "100Hz" is not a number: write 100 (the unit stands in the key)'),
        ("loop_hz: 100", "loop_hz: 100 N", 'loop_hz: "100 N" is not a number'),
        ("lease_s: null", "lease_s: 200 ms",
         'supervision.lease_s: "200 ms" is not a number: write 0.2 (the key is in s)'),
        ("seed: 7", "seed: 7 times", 'seed: "7 times" is not a whole number: write 7 (without a unit)'),
        ("name: demo", "name: Süd 3",
         'name: "Süd 3" does not have the form: small letters a-z, digits and . _ -, at most 63, a letter or digit first'),
        ("units: [0, 1, 255]", "units: 1", "network.units: 1 is not a list: write [1]"),
        ("loop_hz: 100", "loop_hz: 1_00", 'loop_hz: "1_00" is not a number: write 100 (digits are not grouped)'),
        ("loop_hz: 100", "loop_hz: 1:40", 'loop_hz: "1:40" is not a number'),
        ("loop_hz: 100", "loop_hz:", "loop_hz: has no value: write one, or leave this line out"),
        ("loop_hz: 100", "loop_hz: [100]", "loop_hz: a list is not a number"),
        ("simulated: true", "simulated: yes", 'simulated: "yes" is not true or false: write true'),
        ("simulated: true", "simulated: off", 'simulated: "off" is not true or false: write false'),
        ("simulated: true", "simulated: 1", "simulated: 1 is not true or false"),
        ("name: demo", "name: 12", 'name: 12 is not text: write "12" in quotes'),
        ("name: demo", "name: #12", "name: has no value; behind a `#` is a comment: quote a text with it"),
        ("name: demo", "name: {v: 1}", "name: a group of keys is not text: quote a text that begins with `{`"),
        ("lease_s: null", "lease_action: falt",
         "supervision.lease_action: falt is not one of fault, hold, ramp; did you mean fault?"),
        ("sign: 1", "unit: kN", "load_cell.unit: kN is not one of N, kg, g, lb; in its place: newton_per_count: 1000"),
        ("limit_v: 0.5", "limit_v: 0,5", 'trim.limit_v: "0,5" is not a number: write 0.5 (decimals take a point)'),
        ("force_max_n: 60", "force_max_n: 400", "limits.force_max_n: 400 N is above 300 N, the most allowed"),
        ("force_max_n: 60", "force_max_n: 0", "limits.force_max_n: 0 N is not above 0 N"),
        ("units: [0, 1, 255]", "requests_per_s: 0", "network.requests_per_s: 0 1/s is not above 0 1/s"),
        ("units: [0, 1, 255]", "units: [0, 1, 256]", "network.units[2]: 256 is above 255, the most allowed"),
        ("units: [0, 1, 255]", "units: []", "network.units: has 0 entries, at least 1 are needed"),
        ("bind: 127.0.0.1", "bind: robot", 'network.bind: "robot" is not an IP address such as 127.0.0.1 or 192.168.125.10'),
        ("units: [0, 1, 255]", "allow: [192.168.125.1/24]",
         'network.allow[0]: "192.168.125.1/24" is not a network such as 192.168.125.0/24; did you mean 192.168.125.0/24?'),
        ("units: [0, 1, 255]", "allow: [24]", "network.allow[0]: 24 is not a network such as 192.168.125.0/24"),
    ],
)  # fmt: skip
def test_a_wrong_value_is_told_in_the_users_words(old: str, new: str, sentence: str) -> None:
    (fault,) = told((old, new))
    assert fault.split(" ", 1)[1] == sentence
    assert int(fault.split(":")[0]) == line_of(old)


def test_a_missing_key_is_placed_at_its_group() -> None:
    assert told(("  force_max_n: 60\n", "")) == [
        f"{line_of('limits:')}:1 limits.force_max_n: is missing (a value in N)"
    ]
    assert told(("calibration: demo", "#")) == ["5:1 calibration: is missing"]


def test_a_group_that_is_a_word_is_told_once() -> None:
    assert told(("trim: #", "trim: off #"), ("  gain_v_per_n_s: 0.3\n  limit_v: 0.5\n", ""))[0].endswith(
        'trim: "off" is not a group of keys: gain_v_per_n_s, limit_v, dead_zone_n, memory_n'
    )


@pytest.mark.parametrize(("word", "cure"), [("off", "false"), ("false", "false"), ("on", "true")])
def test_a_word_in_place_of_a_group_with_a_switch_is_told_how_the_group_says_it(word: str, cure: str) -> None:
    (fault,) = told(("registers: force-v1", f"residual_watch: {word}\nregisters: force-v1"))
    assert fault.endswith(f"is not a group of keys: write {{enabled: {cure}}}")
    assert told(("registers: force-v1", f"residual_watch: {{enabled: {cure}}}\nregisters: force-v1")) == []


SECTIONS = ("web", "metrics", "opcua")


@pytest.mark.parametrize("section", SECTIONS)
def test_a_word_in_place_of_a_section_is_told_what_says_the_same(section: str) -> None:
    """`web: off` was told the keys only, as if a page were wanted."""
    (fault,) = told(("registers: force-v1", f"{section}: off\nregisters: force-v1"))
    assert fault.endswith(f'{section}: "off" is not a group of keys: leave it out, and there is none')
    (fault,) = told(("registers: force-v1", f"{section}: true\nregisters: force-v1"))
    assert f"{section}: true is not a group of keys: write {{}}, or its keys: listen" in fault
    assert told(("registers: force-v1", f"{section}: {{}}\nregisters: force-v1")) == []


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("valve: false", "valve: false is not a group of keys: leave it out, and there is none"),
        ("mqtt: true", "mqtt: true is not a group of keys: host, port, tls, username, password_file, base_topic ..."),
        ("web: [{listen: 127.0.0.1:0}]", "web: a list is not a group of keys: write its keys without `- ` before them"),
        ("fieldbus: off", 'fieldbus: "off" is not a list, and "off" is not a group of keys with a type: rtu, tls'),
        ("fieldbus: [1]", "fieldbus[0]: 1 is not a group of keys with a type: rtu, tls"),
        ("fieldbus: [{unit: 1}]", "fieldbus[0]: has no type: it says what this is, one of rtu, tls"),
        ("fieldbus: {type: rtu}",
         "fieldbus: a group of keys is not a list: write `- ` before its first key, and spaces before the others"),
        ("fieldbus: [{type: rtu, bind: 127.0.0.1}]",
         "fieldbus[0].bind: is not a known key here; it belongs to a face of `type: tls`"),
        ("opcua: {listen: 0}", "opcua.listen: 0 is no port that a client could know: write 127.0.0.1:4840"),
        ("opcua: {listen: 4841}", "opcua.listen: 4841 is a port alone: write 127.0.0.1:4841"),
        ("web: {listen: true}", 'web.listen: "true" is not HOST:PORT such as 127.0.0.1:8080'),
        ("mqtt: {host: h, base_topic: /a}",
         'mqtt.base_topic: "/a" does not have the form: 1 to 200 characters, none of them # +, and no / first'),
        ("mqtt: {host: h, sparkplug: {group: a/b}}",
         'mqtt.sparkplug.group: "a/b" does not have the form: 1 to 100 characters, none of them / # +'),
    ],
)  # fmt: skip
def test_what_is_proposed_for_a_section_is_taken_there(line: str, sentence: str) -> None:
    (fault,) = told(("registers: force-v1", f"{line}\nregisters: force-v1"))
    assert fault.split(" ", 1)[1] == sentence


@pytest.mark.parametrize(
    ("new", "cure"),
    [
        (
            "bind: 192.168.125.20:5020",
            "192.168.125.10; the port has a key of its own: bind: 192.168.125.20 and port: 5020",
        ),
        ('bind: "[::1]:5020"', "192.168.125.10; the port has a key of its own: bind: ::1 and port: 5020"),
        ("bind: robot:5020", "127.0.0.1 or 192.168.125.10"),
        ("owner: 10.0.0.5:4711", "nor certificate NAME; an owner has no port: write 10.0.0.5"),
    ],
)
def test_an_address_with_a_port_is_told_where_the_port_belongs(new: str, cure: str) -> None:
    (fault,) = told(("bind: 127.0.0.1", new))
    assert "is not an IP address such as" in fault and fault.endswith(cure)


@pytest.mark.parametrize(
    ("new", "sentence"),
    [
        ("bind: true", 'network.bind: "true" is not an IP address such as 127.0.0.1 or 192.168.125.10'),
        ("allow: 24", "network.allow: 24 is not a list, and 24 is not a network such as 192.168.125.0/24"),
        ("allow: 10.0.0.0/8", 'network.allow: "10.0.0.0/8" is not a list: write ["10.0.0.0/8"]'),
    ],
)
def test_no_quotes_or_brackets_are_proposed_where_they_are_refused(new: str, sentence: str) -> None:
    """`bind: true` was told to go in quotes, and `allow: 24` in brackets."""
    (fault,) = told(("bind: 127.0.0.1", new))
    assert fault.split(" ", 1)[1] == sentence


@pytest.mark.parametrize("host", ["broker.cell-3.local", "10.0.0.5", "fd00::5", "::1"])
def test_a_broker_is_a_name_or_an_address(host: str) -> None:
    assert told(("registers: force-v1", f'mqtt: {{host: "{host}"}}\nregisters: force-v1')) == []


@pytest.mark.parametrize("host", ["mqtt://broker", "broker:1883", "my broker"])
def test_a_broker_with_more_than_its_name_is_refused(host: str) -> None:
    (fault,) = told(("registers: force-v1", f'mqtt: {{host: "{host}"}}\nregisters: force-v1'))
    form = "a name or an address, without mqtt:// and without its port"
    assert fault.endswith(f' mqtt.host: "{host}" does not have the form: {form}')


def test_of_a_hostile_document_no_proposal_is_tried() -> None:
    """50 findings in 20 000 entries took five seconds: each proposal reads all of them."""
    faults = told(("registers: force-v1", f"fieldbus: [{'{type: rtu, port: true}, ' * 2000}]\nregisters: force-v1"))
    assert len(faults) == 50 and all(
        fault.endswith('port: true is not text: write "true" in quotes') for fault in faults
    )
    (fault,) = told(("bind: 127.0.0.1", f"bind: true\n  allow: [{'10.0.0.0/8, ' * 4000}]"))
    assert fault.endswith('network.bind: true is not text: write "true" in quotes')


def test_whole_numbers_are_accepted_where_a_number_is_needed_and_become_floats() -> None:
    file, faults = build(RigFile, parse(DEMO.encode(), "rig.yaml"))
    assert not faults and file is not None
    assert file.limits.force_max_n == 60.0 and type(file.limits.force_max_n) is float


def test_all_faults_are_told_at_once_from_top_to_bottom() -> None:
    faults = told(
        ("seed: 7", "seed: x"),
        ("baud: 9600", "boud: 115300"),
        ("force_max_n: 60", "force_max_n: -1"),
        ("port: 5020", "port: 70000"),
    )
    places = [int(fault.split(":")[0]) for fault in faults]
    assert places == [line_of(text) for text in ("seed: 7", "baud: 9600", "force_max_n: 60", "port: 5020")]


@dataclass(frozen=True)
class Round:
    __pydantic_config__ = STRICT
    type: Literal["round"]
    radius_mm: float


@dataclass(frozen=True)
class Square:
    __pydantic_config__ = STRICT
    type: Literal["square"]
    side_mm: float


@dataclass(frozen=True)
class Nothing:
    __pydantic_config__ = STRICT


def test_where_no_key_is_known_the_sentence_names_none() -> None:
    _, faults = build(Nothing, parse(b"a: 1", "a.yaml"))
    assert "is not a known key; nothing may stand here" in str(faults[0])


@dataclass(frozen=True)
class Shapes:
    __pydantic_config__ = STRICT
    shapes: tuple[Annotated[Round | Square, Discriminator("type")], ...]


@pytest.mark.parametrize(
    ("shape", "sentence"),
    [
        ("{type: sqare, side_mm: 1}", "shapes[0]: type sqare is not one of round, square; did you mean square?"),
        ("{side_mm: 1}", "shapes[0]: has no type: it says what this is, one of round, square"),
        ("{type: square, side_mm: 1, sde_mm: 2}", "shapes[0].sde_mm: is not a known key; known are type, side_mm"),
        ("{type: square, side_cm: 1}", "shapes[0].side_cm: is not a known key; did you mean side_mm?"),
    ],
)
def test_a_group_of_several_kinds_is_judged_by_its_own(shape: str, sentence: str) -> None:
    _, faults = build(Shapes, parse(f"shapes: [{shape}]".encode(), "a.yaml"))
    assert any(str(fault).split(" ", 1)[1] == sentence for fault in faults), faults
