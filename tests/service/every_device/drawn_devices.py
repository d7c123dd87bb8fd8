"""Device profiles drawn from the schema: every key that the schema has, present or not, with values of every shape.

Not all of them make sense, as not all that people write does: `check` must tell the ones that cannot work.
"""

from random import Random
from typing import Any

from gateway.profiles.schema import schema

SCHEMA = schema("device")
Profile = dict[str, Any]

_ENDINGS = (*4 * ("\r\n", "\r", "\n", "\x03"), "\n\r", ";FF")


def choices(owner: str, key: str) -> list[Any]:
    """What the schema lists for a key of a group, `DeviceProfile` for the top."""
    group = SCHEMA if owner == "DeviceProfile" else SCHEMA["$defs"][owner]
    described = group["properties"][key]
    if "$ref" in described:
        described = SCHEMA["$defs"][described["$ref"].rpartition("/")[2]]
    if "anyOf" in described:  # none, or a group of its own
        described = next(one for one in described["anyOf"] if "const" in one)
    return [one for one in described["enum"] if one] if "enum" in described else [described["const"]]


def _about(rng: Random, role: str) -> Profile:
    profile: Profile = {
        "name": "drawn",
        "description": "drawn from the schema",
        "role": role,
        "source": "a test",
        "certainty": rng.choice(choices("DeviceProfile", "certainty")),
        "hardware": "never run on hardware",
        "serial": {
            "baud": rng.choice(choices("SerialSettings", "baud")),
            "data_bits": rng.choice(choices("SerialSettings", "data_bits")),
            "parity": rng.choice(choices("SerialSettings", "parity")),
            "stop_bits": rng.choice(choices("SerialSettings", "stop_bits")),
        },
        "terminator": rng.choice(_ENDINGS),
        "checksum": rng.choice(choices("DeviceProfile", "checksum")),
    }
    _maybe(rng, profile, "codec", "template")
    _maybe(rng, profile, "watchdog", rng.choice(choices("DeviceProfile", "watchdog")))
    _maybe(rng, profile, "identity", rng.choice(choices("DeviceProfile", "identity")))
    _maybe(rng, profile, "reply_timeout_s", rng.choice([0.02, 0.1, 0.5, 2.0]), 0.7)
    _maybe(rng, profile, "constants", {"address": rng.choice([1, 2, 255])}, 0.4)
    if profile.get("constants") == {"address": 2}:
        profile["channels"] = 4
    return profile


def _maybe(rng: Random, group: Profile, key: str, value: Any, share: float = 0.5) -> None:
    if rng.random() < share:
        group[key] = value


_NUMBERS = ":d", ":04d", ":+05d", ":5d", ":.1f", ":.3f", ":07.3f", ":+07.3f", ":8.4f", ":+.6E", ":+04X", ":g"
_SPANS = {"d": [[0, 1023], [0, 4095.5], [0, 100], [-2047, 2048]], "f": [[0, 10], [0.0, 5.0], [-10.0, 10.0], [0, 99.9]]}
_SPANS |= {"E": _SPANS["f"], "g": _SPANS["f"], "X": _SPANS["d"]}


def _number(rng: Random, name: str) -> tuple[str, list[float]]:
    """A field, and what span its device counts in."""
    shape = rng.choice(_NUMBERS)
    return f"{{{name}{shape}}}", rng.choice(_SPANS[shape[-1]])


def _sentence(rng: Random, profile: Profile, words: str, number: str = "") -> str:
    """The words, perhaps with the address, perhaps with the number."""
    head = "#{address:02X}" if "address" in profile.get("constants", {}) and rng.random() < 0.8 else ""
    return f"{head}{words}{number}"


def drawn_output(rng: Random) -> Profile:
    profile = _about(rng, "output")
    number, span = _number(rng, "level")
    voltage_v = rng.choice([[0.0, 10.0], [0.0, 10.0], [0, 9], [0.0, 5.0]])
    setting: Profile = {"ask": _sentence(rng, profile, rng.choice(["SET ", "V", "", "@"]), number)}
    setting["range"] = {"device": span, "voltage_v": voltage_v}
    answers = ["", ">", "OK", number, f"V={number}", f"{{flag:OK|WARN}} {number}", "{level:.1f}", "{level:d}"]
    _maybe(rng, setting, "answer", rng.choice(answers), 0.9)
    profile["set_voltage"] = setting
    if rng.random() < 0.5:
        read, read_span = rng.choice([(number, span), _number(rng, "present")])
        answer = _sentence(rng, profile, rng.choice(["", "S "]), read)
        ranges = {"device": read_span, "voltage_v": voltage_v}
        profile["read_voltage"] = {"ask": rng.choice(["REQ", "?", "$8"]), "answer": answer, "range": ranges}
    if rng.random() < 0.5:
        read, read_span = _number(rng, "pressure")
        ranges = {"device": read_span, "pressure_pa": [0.0, 0.9e6]}
        profile["read_pressure"] = {"ask": rng.choice(["MON", "P", "?"]), "answer": f"{read}", "range": ranges}
    _maybe(rng, profile, "steps", [{"ask": "INC", "by": 2}, {"ask": "DEC", "by": -2}], 0.3)
    refusals: Profile = {"unknown": rng.choice(["", "UNKNOWN", "?", ">"])}
    _maybe(rng, refusals, "out_of_range", {"text": "RANGE", "numbers": [1024, 9999]})
    _maybe(rng, profile, "refusals", refusals)
    return profile


_FORCES = (
    ":d",
    ":06d",
    ":+06d",
    ":.1f",
    ":.2f",
    ":.3f",
    ":+08.2f",
    ":08.3f",
    ":7.1f",
    ":5.1f",
    ":4.2f",
    ":+.5E",
    ":+06X",
    ":g",
)
_FORCES += (":+08,2f",)


def drawn_cell(rng: Random) -> Profile:
    profile = _about(rng, "load cell")
    number, reading = f"{{force{rng.choice(_FORCES)}}}", {}
    frame = _sentence(rng, profile, rng.choice(["", "W ", "!"]), number)
    if rng.random() < 0.4:
        words, reading["quality"] = rng.choice(
            [("ST|US|OL", {"ST": "ok", "US": "unstable", "OL": "overload"}), ("G|B", {"G": "ok", "B": "unstable"})]
        )
        frame = f"{{status:{words}}},{frame}"
        if words == "G|B" and "{force:+" not in frame:
            reading["negative"] = ["B"]
    if rng.random() < 0.2:
        frame = frame.replace("{force:", "{sign: |-}{force:").replace("{force:+", "{force:")
    if rng.random() < 0.4:
        frame += rng.choice(["{unit:kg|lb|g|N}", "{unit: kg|  N}", " {unit:KG|lbF|gf|N}"])
    frame += rng.choice(["", "", " {serial:04X}", " {remark:6s}", ";{count:d}"])
    reading["frame"] = frame
    _maybe(rng, reading, "unit", rng.choice(["N", "N", "kg", "g", "lb"]), 0.7)
    _maybe(rng, reading, "blank_is_overload", rng.choice([True, False]), 0.4)
    is_read_over = "{serial" in frame or "{remark" in frame  # then something has to tell an overload
    overload = rng.choice([["S +"], ["OL,+9999999E+19", "------"]])
    _maybe(rng, reading, "overload", overload, 0.8 if is_read_over else 0.3)
    _maybe(rng, reading, "underload", ["S -"], 0.3)
    is_asked = rng.random() < 0.6
    if is_asked:
        reading["ask"] = _sentence(rng, profile, rng.choice(["W?", "SYS?", "MSV?;"]))
        _maybe(rng, reading, "rate_hz", rng.choice([0.0, 10.0, 80.0]), 0.5)
    else:
        _maybe(rng, reading, "rate_hz", rng.choice([1.0, 10.0, 40.0, 100.0, 400.0]), 0.95)
        _maybe(rng, reading, "start", rng.choice(["SIR", "SG"]), 0.3)
    profile["read_force" if is_asked else "stream"] = reading
    beside = Random(frame)  # one of its own: the other draws stay as they are
    _maybe(beside, profile, "read_over", beside.choice([["T={degrees:.1f}"], ["alive {seconds:d}", ""]]), 0.3)
    return profile


def _as_modbus(rng: Random, profile: Profile) -> Profile:
    """The same device on Modbus RTU: no words, no line's end."""
    left = {key: value for key, value in profile.items() if key not in ("terminator", "checksum", "steps", "refusals")}
    whole = {"codec": "modbus-rtu", "serial": left["serial"] | {"data_bits": 8}, "reply_timeout_s": 0.1}
    return left | whole | {"constants": {"address": rng.choice([1, 17])}}


_REGISTER_SPANS = {"uint16": [0, 10000], "int16": [-32000, 32000], "uint32": [0, 100000], "float32": [0.0, 10.0]}


def drawn_modbus_output(rng: Random) -> Profile:
    profile, kind = _as_modbus(rng, _about(rng, "output")), rng.choice(list(_REGISTER_SPANS))
    ranges = {"device": _REGISTER_SPANS[kind], "voltage_v": [0.0, 10.0]}
    access = {"register": rng.choice([0, 4096]), "type": kind, "word_order": rng.choice(["abcd", "cdab"])}
    if profile["constants"] == {"address": 17}:
        profile["channels"] = 8
    writes = 6 if kind.endswith("16") and rng.random() < 0.5 else 16
    profile["set_voltage"] = {"modbus": {"function": writes, **access}, "range": ranges}
    _maybe(rng, profile, "read_voltage", {"modbus": {"function": rng.choice([3, 4]), **access}, "range": ranges})
    return profile


def drawn_modbus_cell(rng: Random) -> Profile:
    profile, kind = _as_modbus(rng, _about(rng, "load cell")), rng.choice(["uint32", "int32", "int16", "float32"])
    registers: Profile = {"first": 6, "last": 10, "weight": 7, "type": kind, "decimals": 0 if kind == "float32" else 2}
    if kind == "uint32" or rng.random() < 0.3:
        registers["negative"] = {"register": 6, "bit": 7}
    registers["overload"] = [{"register": 6, "bit": bit} for bit in (0, 3)]
    profile["read_force"] = {"modbus": registers, "unit": rng.choice(["N", "kg"]), "rate_hz": 100.0}
    return profile


def drawn_counts(rng: Random) -> Profile:
    """Raw counts of a converter, and a device whose sentences have other ends than the gateway's."""
    profile = _about(rng, "load cell") | {"terminator": "\r\n", "question_terminator": ";", "checksum": "none"}
    reading = {"frame": "{force:d}", "ask": "MSV?", "before": "STP", "newton_per_count": 0.01, "zero_count": 840.0}
    reading["end_count"] = 8388607
    if rng.random() < 0.5:
        reading["before_answer"] = "OK"
    return profile | {"read_force": reading}
