"""Both ends of the line from a Modbus load-cell amplifier: weight, sign and health out of the registers of one answer."""

from gateway.devices.binary.weight_registers import FORCE, RegisterBit, WeightRegisters, word_name
from gateway.devices.fields import Value, ValueRefused
from gateway.devices.messages import Quality
from gateway.devices.profile import DeviceProfile
from gateway.devices.template_codecs.cell import TemplateCellDevice, TemplateCellHost


def _registers(profile: DeviceProfile) -> WeightRegisters:
    registers = profile.reading.modbus
    assert registers  # the profile was checked for it
    return registers


def _is_set(bit: RegisterBit, values: dict[str, Value]) -> bool:
    return int(values[word_name(bit.register)]) >> bit.bit & 1 == bit.value


class ModbusCellHost(TemplateCellHost):
    """See roles.CellHost."""

    def __init__(self, profile: DeviceProfile, sign: int = 1, unit: str | None = None) -> None:
        super().__init__(profile, sign, unit)
        self._registers = _registers(profile)

    def _raw(self, values: dict[str, Value]) -> float:
        weight = float(values[FORCE]) / 10.0**self._registers.decimals
        negative = self._registers.negative
        return -abs(weight) if negative and _is_set(negative, values) else weight  # a signed one may say it twice

    def _quality(self, raw: float, values: dict[str, Value]) -> Quality:
        if any(_is_set(bit, values) for bit in self._registers.overload):
            return Quality.OVERLOAD
        believed = super()._quality(raw, values)  # a count at the converter's end
        is_unstable = any(_is_set(bit, values) for bit in self._registers.unstable)
        return Quality.UNSTABLE if is_unstable and believed is Quality.OK else believed


class ModbusCellDevice(TemplateCellDevice):
    """See roles.CellDevice."""

    def __init__(self, profile: DeviceProfile, unit: str | None = None) -> None:
        super().__init__(profile, unit)
        self._registers = _registers(profile)

    def _tell_registers(self, values: dict[str, Value], quality: Quality) -> None:
        registers, raw = self._registers, float(values[FORCE])
        weight = raw if registers.is_float else round(raw * 10.0**registers.decimals)
        if abs(raw) > self._reading.largest_shown or (weight < 0 and not registers.is_signed):
            raise ValueRefused(f"{raw} is more than the amplifier shows")
        values[FORCE] = abs(weight) if registers.negative else weight
        meant = [(registers.negative, weight < 0)] if registers.negative else []
        meant += [(bit, quality is Quality.OVERLOAD and bit is registers.overload[0]) for bit in registers.overload]
        meant += [(bit, quality is Quality.UNSTABLE and bit is registers.unstable[0]) for bit in registers.unstable]
        for bit, is_meant in meant:
            name, one = word_name(bit.register), 1 << bit.bit
            is_one = is_meant == bool(bit.value)
            values[name] = int(values[name]) | one if is_one else int(values[name]) & ~one
