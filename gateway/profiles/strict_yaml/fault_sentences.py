"""pydantic's findings in the user's words: what was seen, what is allowed, and what was probably meant."""

import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

from gateway.profiles.strict_yaml.faults import closest, one_of
from gateway.units import STANDARD_GRAVITY_M_PER_S2

_UNITS: Final = {
    "n": "N", "v": "V", "s": "s", "ms": "ms", "us": "us", "hz": "Hz", "kg": "kg", "g": "g", "pa": "Pa", "kpa": "kPa",
    "mpa": "MPa", "bar": "bar", "m": "m", "mm": "mm", "m2": "m2", "mm2": "mm2", "n_per_v": "N/V", "n_per_s": "N/s",
    "v_per_s": "V/s", "n_per_m": "N/m", "v_per_n_s": "V/(N s)", "pa_per_v": "Pa/V", "n_s_per_m": "N s/m", "mv": "mV",
    "kn": "kN", "kgf": "kgf", "khz": "kHz", "min": "min", "n_per_n": "N/N", "n_per_mm": "N/mm", "n_per_mm2": "N/mm2",
    "n_s_per_mm": "N s/mm", "pa_per_s": "Pa/s", "pa_per_pa": "Pa/Pa", "m_per_s": "m/s", "per_s": "1/s", "per_n": "1/N",
    "per_m": "1/m", "per_pa": "1/Pa",
}  # fmt: skip
_SCALES: Final = (
    {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0},
    {"v": 1.0, "mv": 1e-3},
    {"n": 1.0, "kn": 1e3, "kgf": STANDARD_GRAVITY_M_PER_S2},
    {"pa": 1.0, "kpa": 1e3, "mpa": 1e6, "bar": 1e5},
    {"kg": 1.0, "g": 1e-3},
    {"m": 1.0, "mm": 1e-3},
    {"m2": 1.0, "mm2": 1e-6},
    {"hz": 1.0, "khz": 1e3},
)
_NEWTONS: Final = {"MN": "1000000", "kN": "1000", "daN": "10", "cN": "0.01", "mN": "0.001"} | {
    "t": f"{1e3 * STANDARD_GRAVITY_M_PER_S2:g}"
}
"""Units of force that no `unit` names, in N: near to one that it does, and a thousand times as large."""
_DECIMAL: Final = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")

_WITH_UNIT: Final = re.compile(rf"({_DECIMAL.pattern}) ?(?P<unit>[^\W\d]\S*)")
_FORMS: Final = {
    "^[a-z0-9][a-z0-9._-]{0,62}$": "small letters a-z, digits and . _ -, at most 63, a letter or digit first",
    "^/": "an absolute path, with / first",
    r"^([^/:\s]+|[0-9A-Fa-f:.]+)$": "a name or an address, without mqtt:// and without its port",
    r"^[^/#+\x00]{1,100}$": "1 to 100 characters, none of them / # +",
    r"^[^/#+\x00][^#+\x00]{0,199}$": "1 to 200 characters, none of them # +, and no / first",
}
"""Patterns of texts in words."""
_SHORT: Final = 40  # characters of a value that is quoted whole

_TYPES_ELSEWHERE: Final = dict.fromkeys(
    ("tcp", "modbus-tcp"), "; plain Modbus TCP has its keys under network: (bind, port, allow)"
)
"""What is written as a `type` and has a place of its own."""
_PLAIN: Final = re.compile(r"[\w.:/+ -]+")  # what reads well without quotes
_SWITCHES: Final = dict.fromkeys(("yes", "on", "y", "true"), True) | dict.fromkeys(("no", "off", "n", "false"), False)
"""What YAML 1.1 takes for a boolean, and what that means."""
_MOST_KEYS: Final = 6  # of a group, in a sentence
_ONLY_CHOICE: Final = ", the only choice"
_SECRETS: Final = ("token", "password", "password_file")  # a password may stand in place of its file

_PATH_OF_A_DEVICE: Final = "the path of a device, such as /dev/serial/by-id/usb-..."
_TCP_PORT: Final = "the number of a TCP port; a serial line is a face of `type: rtu`"


class _Secret(str):
    """A value that no fault may quote: the journal, the events and a support bundle tell faults."""


def _unit_start(key: str) -> int | None:
    """Index of the word where the unit begins that ends a key; None when it has none."""
    words = key.split("_")
    return next((start for start in range(1, len(words)) if "_".join(words[start:]) in _UNITS), None)


def unit_of(key: object) -> str:
    """Return the unit that ends a key, as it is printed: ` N/s` for `force_ramp_n_per_s`; empty when it has none."""
    start = _unit_start(str(key))
    return f" {_UNITS['_'.join(str(key).split('_')[start:])]}" if start else ""


def without_unit(key: str) -> str:
    """Return `force_ramp` of `force_ramp_n_per_s`."""
    return "_".join(key.split("_")[: _unit_start(key)])


def number(value: float) -> str:
    """Return a number as people write it: without a trailing `.0`, with at most ten digits."""
    return str(value) if isinstance(value, int) else f"{value:.10g}"


def newton(value: float) -> str:
    """Return a force with its unit."""
    return f"{number(value)} N"


def volt(value: float) -> str:
    """Return a voltage with its unit."""
    return f"{number(value)} V"


def second(value: float) -> str:
    """Return a time with its unit."""
    return f"{number(value)} s"


def quote_value(value: object) -> str:
    """Return a value as the file has it, short."""
    if value is None:
        return "empty"
    if isinstance(value, _Secret):
        return "what stands there"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (int, float)):
        return number(value)
    if isinstance(value, str):
        return f'"{value if len(value) <= _SHORT else value[:37] + "..."}"'
    return "a list" if isinstance(value, list) else "a group of keys"


def unknown_key(
    key: str, group: Mapping[Any, Any], known: Iterable[str], elsewhere: Mapping[str, str]
) -> tuple[str, str]:
    """Return (sentence, key that was meant) for a key that its group does not have; the latter empty where nobody
    knows. group: what stands there; elsewhere: key -> where it belongs, as `under limits`.

    A key that the group has already cannot have been meant.
    """
    known = list(known)
    free = [name for name in known if name not in group]
    if (scaled := _other_unit(key, group.get(key), free)) is not None:
        name, amount = scaled
        return f"is not a known key; this quantity is given as {name}{amount}", name
    for name in free:
        if name != key and without_unit(name) == key:
            return f"is not a known key; did you mean {name}? (a key ends with its unit)", name
    if key in elsewhere:
        return f"is not a known key here; it belongs {elsewhere[key]}", ""
    if (near := closest(key, free)) is not None:
        return f"is not a known key; did you mean {near}?", near
    return "is not a known key; " + (f"known are {one_of(known)}" if known else "nothing may stand here"), ""


def _other_unit(key: str, value: object, known: list[str]) -> tuple[str, str] | None:
    """Return `lease_ms: 200` -> (`lease_s`, `: 0.2`): the same stem with another unit of the same kind."""
    stem, _, unit = key.rpartition("_")
    for scale in _SCALES:
        if unit not in scale:
            continue
        for other in scale:
            if other != unit and f"{stem}_{other}" in known:
                is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
                factor = scale[unit] / scale[other]
                factor = 1.0 / factor if stem.endswith("_per") else factor  # 0.05 V/ms are 50 V/s
                amount = f": {float(value) * factor:.6g}" if is_number else ""  # type: ignore[arg-type]
                return f"{stem}_{other}", amount
    return None


def _describe_expected(what: str) -> Callable[[Any, dict[str, Any], str], str]:
    def sentence(value: Any, context: dict[str, Any], unit: str) -> str:
        hint = _hint(value, what, unit)
        value_text = str(value) if isinstance(value, float) and hint else quote_value(value)
        return f"{value_text} is not {what}{hint}"

    return sentence


def _hint(value: Any, what: str, unit: str) -> str:
    """Return why a value that looks right is not: quotes, decimal comma, a unit, YAML 1.1's booleans, a lone entry."""
    if isinstance(value, float) and value.is_integer() and what == "a whole number":
        return f": write {int(value)}"
    if isinstance(value, bool) and what == "text":
        return f': write "{str(value).lower()}" in quotes'
    if isinstance(value, (int, float)) and what == "text":
        return f': write "{number(value)}" in quotes'
    if what == "a list" and isinstance(value, (int, str)) and len(str(value)) <= _SHORT:
        return f": write [{quote_value(value)}]"
    if what == "text" and isinstance(value, dict):
        return ": quote a text that begins with `{`"
    if what == "a list" and isinstance(value, dict):
        return ": write `- ` before its first key, and spaces before the others"
    if isinstance(value, _Secret) and what == "text":
        return ": write it in quotes"
    if not isinstance(value, str):
        return ""
    if what == "true or false" and value.lower() in _SWITCHES:
        return f": write {str(_SWITCHES[value.lower()]).lower()}"
    if "number" in what:
        return _number_hint(value, unit.strip())
    return ""


def _number_hint(text: str, unit: str) -> str:
    repairs = (
        (text, "take the quotes away"),
        (text.replace("_", ""), "digits are not grouped"),
        (text.replace(",", "."), "decimals take a point"),
        _without_its_unit(text, unit),
    )
    return next((f": write {new} ({reason})" for new, reason in repairs if _DECIMAL.fullmatch(new)), "")


def _without_its_unit(text: str, unit: str) -> tuple[str, str]:
    """Return the number of `200 ms` as a key in this unit takes it, and why; an empty one where the two do not go together."""
    if not (parts := _WITH_UNIT.fullmatch(text)):
        return "", ""
    amount, given, wanted = parts[1], parts["unit"].lower(), unit.lower()
    if not unit or given == wanted:
        return amount, "the unit stands in the key" if unit else "without a unit"
    scale = next((scale for scale in _SCALES if given in scale and wanted in scale), None)
    return (f"{float(amount) * scale[given] / scale[wanted]:.6g}", f"the key is in {unit}") if scale else ("", "")


def _form(pattern: str) -> str:
    return f": {_FORMS[pattern]}" if pattern in _FORMS else f" {pattern}"


def _choices(listed: object) -> list[str]:
    """Return the choices in a list of pydantic's: `'fault', 'hold' or 'ramp'`."""
    return [word.strip(" '") for word in str(listed).replace(" or ", ",").split(",")]


def _kind_choice(value: Any, context: dict[str, Any], unit: str) -> str:
    """Return the sentence about a group whose `type` is not there, or none of the known."""
    if "tag" not in context or (isinstance(value, dict) and value.get("type") is None):
        types = context.get("types") or _choices(context["expected_tags"])
        return f"has no type: it says what this is, one of {one_of(types)}"
    elsewhere = _TYPES_ELSEWHERE.get(str(context["tag"]), "")
    return f"type {_choice(context['tag'], {'expected': context['expected_tags']}, unit)}{elsewhere}"


def _choice(value: Any, context: dict[str, Any], unit: str) -> str:
    choices = _choices(context["expected"])
    value_text = value if isinstance(value, str) and _PLAIN.fullmatch(value) else quote_value(value)
    near = closest(value, choices) if isinstance(value, str) else _nearest(value, choices)
    shown = [choice if _PLAIN.fullmatch(choice) else f'"{choice}"' for choice in choices]
    if isinstance(value, str) and value in choices:  # a number is wanted
        return f'"{value}" is text: write {value} (take the quotes away)'
    if len(choices) == 1:
        return f"{value_text} is not {shown[0]}{_ONLY_CHOICE}"
    if "N" in choices and isinstance(value, str) and value in _NEWTONS:
        cure = f"; in its place: newton_per_count: {_NEWTONS[value]}"
    else:
        cure = f"; did you mean {near}?" if near else ""
    return f"{value_text} is not one of {one_of(shown)}{cure}"


def _nearest(value: Any, choices: list[str]) -> str | None:
    """Return the number among the choices that a slip of the finger makes this one of."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    near = [choice for choice in choices if choice.isdecimal() and abs(value - int(choice)) <= 0.1 * int(choice)]
    return min(near, key=lambda choice: abs(value - int(choice)), default=None)


def tell_group(sentence: str, value: object, known: list[str], *, without: bool, empty: bool) -> str:
    """Return a sentence about a value in whose place a group of keys may stand: what says the same for a word that switches
    the group on or off, else the first of its keys. without: a file that leaves the group out has none; empty: every key
    has a default."""
    switch = str(_SWITCHES.get(str(value).lower(), "")).lower()
    if switch and "enabled" in known:
        return f"{sentence}: write {{enabled: {switch}}}"
    if switch == "false" and without:
        return f"{sentence}: leave it out, and there is none"
    if switch == "true" and without and empty:
        return f"{sentence}: write {{}}, or its keys: {one_of(known)}"
    if isinstance(value, list) and value and all(isinstance(entry, dict) for entry in value):
        return f"{sentence}: write its keys without `- ` before them"
    keys = one_of(known[:_MOST_KEYS]) + (" ..." if len(known) > _MOST_KEYS else "")
    word, is_word, _ = sentence.partition(_ONLY_CHOICE)
    return f"{word}, nor a group of keys: {keys}" if is_word else f"{sentence}: {keys}"


_BY_TYPE: Final[dict[str, Callable[[Any, dict[str, Any], str], str]]] = {
    "literal_error": _choice,
    "enum": _choice,
    "union_tag_invalid": _kind_choice,
    "union_tag_not_found": _kind_choice,
    "float_type": _describe_expected("a number"),
    "float_parsing": _describe_expected("a number"),
    "int_type": _describe_expected("a whole number"),
    "int_parsing": _describe_expected("a whole number"),
    "int_from_float": _describe_expected("a whole number"),
    "int_parsing_size": _describe_expected("a whole number of usual size"),
    "bool_type": _describe_expected("true or false"),
    "bool_parsing": _describe_expected("true or false"),
    "string_type": _describe_expected("text"),
    "tuple_type": _describe_expected("a list"),
    "list_type": _describe_expected("a list"),
    "set_type": _describe_expected("a list"),
    "frozen_set_type": _describe_expected("a list"),
    "dict_type": _describe_expected("a group of keys"),
    "dataclass_type": _describe_expected("a group of keys"),
    "model_type": _describe_expected("a group of keys"),
    "greater_than": lambda v, c, u: f"{quote_value(v)}{u} is not above {number(c['gt'])}{u}",
    "greater_than_equal": lambda v, c, u: f"{quote_value(v)}{u} is below {number(c['ge'])}{u}, the least allowed",
    "less_than": lambda v, c, u: f"{quote_value(v)}{u} is not below {number(c['lt'])}{u}",
    "less_than_equal": lambda v, c, u: f"{quote_value(v)}{u} is above {number(c['le'])}{u}, the most allowed",
    "multiple_of": lambda v, c, u: f"{quote_value(v)}{u} is not a multiple of {number(c['multiple_of'])}{u}",
    "too_short": lambda v, c, u: f"has {c['actual_length']} entries, at least {c['min_length']} are needed",
    "too_long": lambda v, c, u: f"has more than {c['max_length']} entries, the most allowed",
    "string_too_short": lambda v, c, u: (
        "is empty" if not v else f"{quote_value(v)} is shorter than {c['min_length']} characters"
    ),
    "string_too_long": lambda v, c, u: f"{quote_value(v)} is longer than {c['max_length']} characters",
    "string_pattern_mismatch": lambda v, c, u: f"{quote_value(v)} does not have the form{_form(c['pattern'])}",
    "value_error": lambda v, c, u: str(c["error"]),
    "finite_number": lambda v, c, u: f"{quote_value(v)} is not a finite number",
}


def _wanted_port(finding: str, value: Any) -> str:
    """Return what a port is where a number stands in place of a path, or a path in place of a number; empty otherwise."""
    if finding == "string_type" and isinstance(value, (int, float)) and not isinstance(value, bool):
        return _PATH_OF_A_DEVICE
    return _TCP_PORT if finding == "int_type" and isinstance(value, str) and value.startswith("/") else ""


def type_sentence(error: Mapping[str, Any], value: Any, key: object, *, optional: bool = False) -> str:
    """Return the sentence for one pydantic error about a value that is there; value as the file has it. optional: the key may
    be left out."""
    context: dict[str, Any] = error.get("ctx") or {}
    if value is None and error["type"] != "value_error":
        comment = "; behind a `#` is a comment: quote a text with it" if error["type"] == "string_type" else ""
        return ("has no value: write one, or leave this line out" if optional else "has no value") + comment
    if key in _SECRETS and isinstance(value, (str, int, float)) and not isinstance(value, bool):
        value = _Secret(value)
    if key == "port" and (wanted := _wanted_port(error["type"], value)):
        return f"{quote_value(value)} is not {wanted}"
    words = _BY_TYPE.get(error["type"])
    return words(value, context, unit_of(key)) if words else f"{quote_value(value)}: {error['msg']}"
