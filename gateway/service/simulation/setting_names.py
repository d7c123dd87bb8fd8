"""The table of what `force-gateway sim set NAME=VALUE` takes: faults, numbers, surroundings, and the effects of the catalogue.

An effect alone is its first parameter: `creep=0.05` is `creep.creep_share=0.05`; with `on` each of its parameters gets the
size in demonstration.py.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Final

from gateway.catalogue.all_effects import BY_NAME, EFFECTS
from gateway.catalogue.effect import Effect, Parameter
from gateway.service.simulation.demonstration import DEMONSTRATIONS

Value = bool | float


@dataclass(frozen=True, slots=True)
class Setting:
    """One thing that can be set. unit "": on or off, and low and high mean nothing."""

    name: str
    what: str
    unit: str = ""
    low: float = 0.0
    high: float = 1.0

    @property
    def is_switch(self) -> bool:
        """Decide whether it is on or off, and no number."""
        return not self.unit

    @property
    def allowed(self) -> str:
        """Values that it takes, in words."""
        return "on, off" if self.is_switch else _range(self.low, self.high, self.unit)


FAULTS: Final = (
    Setting("cell.silent", "the load-cell amplifier sends nothing"),
    Setting("cell.frozen", "it repeats its last value"),
    Setting("cell.inverted", "its signal wires are exchanged"),
    Setting("cell.kgf", "its display is in kgf where the rig file says N: it shows a 9.81th"),
    Setting("cell.scale", "it shows this many times the force; 9.81: N where the rig file says kgf", "1", 0.01, 100.0),
    Setting("cell.noise", "standard deviation of a reading", "N", 0.0, 50.0),
    Setting("cell.unplug", "its port disappears; back, it is another one"),
    Setting("output.silent", "the output device obeys and answers nothing"),
    Setting("output.refuse", "it refuses each setting, in its own words"),
    Setting("output.alter", "it sets, and says, this much more than it was told", "V", -10.0, 10.0),
    Setting("output.unplug", "its port disappears; back, it is another one"),
    Setting("air.off", "no air supply"),
    Setting("contact.off", "no workpiece under the tool"),
    Setting("wire.noise", "share of the bytes of all answers of devices that arrive with a wrong bit", "1", 0.0, 1.0),
    Setting("valve.silent", "the valve's relay answers nothing"),
    Setting("valve.stuck", "the relay answers and the valve does not move"),
    Setting("valve.unplug", "its port disappears; back, it is another one"),
)
SURROUNDINGS: Final = (
    Setting("around.temperature_c", "temperature of the load cell", "degC", -40.0, 150.0),
    Setting("around.supply_kpa", "pressure of the air line", "kPa", 0.0, 2000.0),
    Setting("around.spindle_rpm", "speed of the spindle", "rpm", 0.0, 100_000.0),
    Setting("around.feed_mm_s", "feed of the tool", "mm/s", -1000.0, 1000.0),
    Setting("around.tilt_deg", "tilt of the tool", "deg", -360.0, 360.0),
    Setting("around.position_mm", "place on the path", "mm", -10_000.0, 10_000.0),
    Setting("around.distance_m", "way ground so far", "m", 0.0, 1.0e6),
)
ALIASES: Final = {"noise": "cell.noise", "unplug": "output.unplug"}
BY_SETTING: Final[Mapping[str, Setting]] = {one.name: one for one in (*FAULTS, *SURROUNDINGS)}
_ON: Final = {"true": True, "on": True, "yes": True, "false": False, "off": False, "no": False}


def parse_assignment(name: str, value: Value | str) -> dict[str, Value | None]:
    """Return what NAME=VALUE sets, by whole names; None: it is as the rig's own again. ValueError: E132, E133."""
    name = ALIASES.get(name, name)
    if setting := BY_SETTING.get(name):
        return {name: _value_of(setting, value)}
    effect = BY_NAME.get(name.partition(".")[0])
    if effect is None:
        raise ValueError(_explain_unknown(name))
    if "." in name:
        parameter = _parameter_of(effect, name)
        off = _switch(value) is False
        return {name: None if off else _number(name, value, parameter.low, parameter.high, parameter.unit)}
    return _effect_values(effect, value)


def list_cleared_names(name: str) -> tuple[str, ...]:
    """Return the whole names that `sim clear NAME` means. ValueError: E132."""
    name = ALIASES.get(name, name)
    if name in BY_SETTING:
        return (name,)
    effect = BY_NAME.get(name.partition(".")[0])
    if effect is None:
        raise ValueError(_explain_unknown(name))
    if "." in name:
        _parameter_of(effect, name)
        return (name,)
    return tuple(f"{effect.name}.{parameter.name}" for parameter in effect.parameters)


def find_unit(name: str) -> str:
    """Return the unit of a setting by its whole name; empty for a switch."""
    setting, parameter = BY_SETTING.get(name), None if name in BY_SETTING else find_parameter(name)
    return setting.unit if setting else parameter.unit if parameter else ""


def find_parameter(name: str) -> Parameter | None:
    """Return the parameter of an effect by its whole name; None for anything else."""
    effect = BY_NAME.get(name.partition(".")[0])
    return _parameter_of(effect, name) if effect else None


def effect_settings() -> tuple[Setting, ...]:
    """Return the parameters of all effects as settings."""
    return tuple(
        Setting(f"{effect.name}.{one.name}", effect.what, one.unit or "1", one.low, one.high)
        for effect in EFFECTS
        for one in effect.parameters
    )


def _effect_values(effect: Effect, value: Value | str) -> dict[str, Value | None]:
    switch = _switch(value)
    if switch is False:
        return dict.fromkeys(list_cleared_names(effect.name))
    if switch is True:
        return {f"{effect.name}.{name}": size for name, size in DEMONSTRATIONS[effect.name].items()}
    first = effect.parameters[0]
    return {f"{effect.name}.{first.name}": _number(effect.name, value, first.low, first.high, first.unit)}


def _parameter_of(effect: Effect, name: str) -> Parameter:
    wanted = name.partition(".")[2]
    found = next((one for one in effect.parameters if one.name == wanted), None)
    if found is None:
        known = ", ".join(f"{effect.name}.{one.name}" for one in effect.parameters)
        raise ValueError(f"E132 {name}: effect {effect.name} has no such parameter; it has {known}")
    return found


def _value_of(setting: Setting, value: Value | str) -> Value | None:
    """Return what is set, None where it is switched off. A zero is a number: 0 degC is a temperature that is known."""
    if not setting.is_switch:
        off = _switch(value) is False
        return None if off else _number(setting.name, value, setting.low, setting.high, setting.unit)
    switch = _switch({"1": True, "0": False}.get(str(value), value))
    if switch is None:
        raise ValueError(f"E133 {setting.name}={value}: allowed are on and off (or true and false)")
    return switch or None


def _switch(value: Value | str) -> bool | None:
    """Return True or False for a word that says so; None for a number."""
    return value if isinstance(value, bool) else _ON.get(str(value).strip().lower())


def _number(name: str, value: Value | str, low: float, high: float, unit: str) -> float:
    allowed = f"allowed: {_range(low, high, unit)}"
    try:
        number = float(value) if not isinstance(value, bool) else None
    except ValueError:
        number = None
    if number is None:
        raise ValueError(f"E133 {name}={value} is not a number; {allowed}")
    if not low <= number <= high:
        raise ValueError(f"E133 {name}={value} is out of range; {allowed}")
    return number


def _range(low: float, high: float, unit: str) -> str:
    """Return bounds in words; a share has no unit."""
    return f"{low:g} .. {high:g}{'' if unit in ('', '1') else f' {unit}'}"


def _explain_unknown(name: str) -> str:
    names = [*ALIASES, *BY_SETTING, *BY_NAME]
    near = get_close_matches(name, names, n=1) or get_close_matches(name.partition(".")[0], names, n=1)
    meant = f"did you mean {near[0]}? " if near else ""
    return f"E132 {name} cannot be set: {meant}`force-gateway sim list --all` shows every name"
