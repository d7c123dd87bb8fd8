"""The last self-test in the registers: its result, the verdict on each item, and how many there were."""

from collections.abc import Mapping
from typing import Final

from gateway.registers.image import RegisterImage
from gateway.registers.map.register_map import RegisterMap
from gateway.registers.words import SelfTestResult, SelfTestVerdict

_PREFIX: Final = "self_test_"


class SelfTestWords:
    """Words of the registers self_test_...; of a map that has none of them nothing is shown."""

    def __init__(self, register_map: RegisterMap, image: RegisterImage) -> None:
        self._image = image
        self._registers = {
            register.name.removeprefix(_PREFIX): register
            for register in register_map.registers_of("proof")
            if register.name.startswith(_PREFIX)
        }

    def show(self, number: int, result: SelfTestResult, verdicts: Mapping[str, SelfTestVerdict]) -> None:
        """Show a self-test. verdicts: by item; an item that is left out was not tested."""
        values = {"result": int(result), "count": number & 0xFFFF}
        for name, register in self._registers.items():
            self._image.put(register, values.get(name, int(verdicts.get(name, SelfTestVerdict.NOT_TESTED))))
