"""Structured Text behind the transport of a controller: TwinCAT, CODESYS."""

from typing import Any, ClassVar

from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.controllers.library import values
from tests.clients.programs.controllers.plc import Plc
from tests.clients.programs.iec_libraries import REQUEST_EXCEPTION, modbus_fb, tc2_modbus_srv


class StructuredText(Plc):
    """FB_ForceGateway, and the transport of a controller."""

    TRANSPORT = ""

    TYPES = ("ST_FgCommand", "ST_FgModel")
    TEXTS = ("F_FgTestResultText", "F_FgVerdictText")
    NAMES: ClassVar[dict[str, str]] = {
        "enable": "bEnable",
        "reset": "bReset",
        "tare": "bTare",
        "take": "bTakeOwnership",
        "test": "bSelfTest",
        "testing": "bSelfTestBusy",
        "tested": "bSelfTestDone",
        "not tested": "bSelfTestError",
        "words": "stTest",
        "force": "fForce",
        "upload": "bUpload",
        "pull": "bPull",
        "slot": "nSlot",
        "command": "stCommand",
        "model": "stModel",
        "text": "sText",
        "status": "stStatus",
        "ended": "bEnded",
        "uploaded": "bUploadDone",
        "failing": "nFailingIndex",
    }

    def __init__(self, text: str, gateway: GatewayAtHand) -> None:
        super().__init__(text, "st", gateway, "FB_ForceGateway")
        self.link = self.machine.fresh("ST_FgLink")
        self.transport = self.machine.fresh(self.TRANSPORT)

    def library(self) -> dict[str, Any]:
        return super().library() | {"ADR": values(lambda data: data), "SIZEOF": values(lambda data: 2 * len(data))}

    def scan(self) -> None:
        self.now_s += self.CYCLE_S
        self.machine.steps = 0
        self.block.call(self.inputs | self.structures | {"stLink": self.link})
        self.transport.call({"stLink": self.link})


class TwinCat(StructuredText):
    """With Tc2_ModbusSrv."""

    TRANSPORT = "FB_FgTransportTc2"

    def prepare(self) -> None:
        self.machine.blocks |= tc2_modbus_srv(self.gateway)


class Codesys(StructuredText):
    """With ModbusFB."""

    TRANSPORT = "FB_FgTransportCodesys"

    def prepare(self) -> None:
        self.machine.blocks |= modbus_fb(self.gateway)
        self.machine.library["MODBUSFB"] = {"ERROR": {"REQUESTEXCEPTION": REQUEST_EXCEPTION}}  # type: ignore[assignment]
