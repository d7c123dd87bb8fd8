"""Lines for `control.sock`, drawn from a seed: what its tools ask of a gateway at work, and what no tool of ours would say."""

import json
from random import Random
from typing import Any

from tests.simulation.masters.spelling import read_pdu, write_one_pdu, write_pdu

STEPS = {
    "name": "steps",
    "moves": [{"do": "step", "to_share": 0.4, "hold_s": 0.5}, {"do": "step", "to_v": 0.0, "hold_s": 0.5}],
}
PLANS: tuple[dict[str, Any], ...] = (
    {},
    {"tare": True},
    {"groups": 1, "step_v": 0.25, "minor_points": 0, "response_steps": 0},
    {"name": "short", "check": False, "parts": [STEPS]},
    {"name": "checked", "parts": [STEPS, STEPS]},
)
REFUSED_PLANS: tuple[Any, ...] = (
    {"step_v": -1.0},
    {"groups": 1e9},
    {"v_max_v": 99.0},
    {"name": "", "parts": []},
    {"parts": "x"},
    {"nothing": 1},
    [],
    7,
)
QUESTIONS = (
    "state",
    "running",
    "health",
    "last-writer",
    "last-refusal",
    "self-test",
    "calibrate",
    "calibration",
    "plant",
)
MALFORMED = (
    b"",
    b"{}",
    b"[]",
    b"null",
    b'{"do": "state"',
    b'{"do": ["state"]}',
    b'{"do": "reboot"}',
    b'{"do": "state", "more": 1}',
    b'{"do": "record", "on": "yes"}',
    b'{"do": "record", "on": true, "for_s": NaN}',
    b'{"do": "record", "on": true, "for_s": -1}',
    b'{"do": "record", "on": null}',
    b'{"do": "calibration", "use": -1}',
    b'{"do": "calibration", "use": true}',
    b'{"do": "calibration", "use": 1e400}',
    b'{"do": "plant", "use": "1"}',
    b'{"do": "plant", "use": 999999}',
    b'{"do": "modbus", "via": "web", "pdu": ""}',
    b'{"do": "modbus", "via": "web", "pdu": "zz"}',
    b'{"do": "modbus", "via": "me", "pdu": "0300640001"}',
    b'{"do": "residual", "cause": 999999, "sentence": "\\ud800"}',
    b'{"do": "sim", "set": {"no-such": 1}}',
    b'{"do": "calibrate", "stop": 1, "plan": {}}',
    b"\xff\xfe{",
    b"[" * 2000,
    b'{"do": ' * 300,
    b'{"do": "record", "on": true, "name": "' + b"x" * 5000 + b'"}',
)


def draw_line(chance: Random) -> bytes:
    """A question, a change, or nonsense."""
    draw = chance.random()
    if draw < 0.2:
        return _line(chance.choice(QUESTIONS))
    if draw < 0.38:
        use = {"use": chance.randrange(6), "force": chance.random() < 0.3}
        return _line("calibration", **chance.choice(({"rollback": True}, use)))
    if draw < 0.48:
        return _line("plant", **chance.choice(({"rollback": True}, {"use": 0}, {"use": 1}, {"use": 2}, {"use": 2})))
    if draw < 0.58:
        return _record(chance)
    if draw < 0.75:
        return _calibrate(chance)
    if draw < 0.85:
        return _modbus(chance)
    return chance.choice(MALFORMED) if chance.random() < 0.8 else chance.randbytes(chance.randrange(1, 200))


def _line(verb: str, **fields: Any) -> bytes:
    return json.dumps({"do": verb, **fields}).encode()


def _record(chance: Random) -> bytes:
    on = chance.random() < 0.6
    return _line("record", on=on, **({"for_s": round(chance.uniform(0.5, 3.0), 2), "name": "shift"} if on else {}))


def _calibrate(chance: Random) -> bytes:
    """name: how often the person who starts it looks at it afterwards (socket_user.py)."""
    if chance.random() < 0.3:
        return _line("calibrate", **chance.choice(({"stop": True}, {"plan": chance.choice(REFUSED_PLANS)})))
    return _line(
        "calibrate",
        plan=chance.choice(PLANS),
        name=str(chance.choice((0, 3, 20))),
        dry_run=chance.random() < 0.2,
        continues=chance.choice(([], [], [1], [999_999])),
    )


def _modbus(chance: Random) -> bytes:
    pdus = (
        read_pdu(100, 30),
        write_pdu(0, 0, 0),
        write_one_pdu(0, 0),
        write_one_pdu(0, 4),
        write_pdu(0, 1, 1200),
        b"\x63",
    )
    via, unit = chance.choice(("web", "mqtt", "opcua")), chance.choice((1, 1, 1, 77))
    return _line("modbus", via=via, pdu=chance.choice(pdus).hex(), unit=unit)
