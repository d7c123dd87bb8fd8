"""An S7 with MB_CLIENT, as far as the generated client uses it."""

import struct
from typing import Any, ClassVar

from tests.clients.gateway_at_hand import GatewayAtHand, Unplugged
from tests.clients.programs.controllers.plc import Plc


class MbClient:
    """MB_CLIENT: one request at a time, BUSY for a scan, DONE or ERROR for one call; the connection is its own.

    Manuals call REQ a level, users have seen it want an edge: here it has to rise, which serves both.
    """

    NO_ANSWER = 0x80C8
    """STATUS of a request that was not answered in time; of a connection that has broken it is another."""

    def __init__(self, plc: "S7") -> None:
        self.plc, self.BUSY, self.DONE, self.ERROR, self.STATUS, self.asked = plc, False, False, False, 0x7000, None
        self.calls, self.MB_Unit_ID, self.RCV_TIMEOUT, self.was_asked = 0, 255, 2.0, False

    def set_static(self, name: str, value: float) -> None:
        """Set what a program may set of the instance (S7-1200 system manual, static variables of MB_CLIENT)."""
        assert name == "RCV_TIMEOUT" or (name == "MB_Unit_ID" and 0 <= value <= 255)
        setattr(self, name, value)

    def call(self, given: dict[str, Any]) -> None:
        self.DONE = self.ERROR = False
        rises, self.was_asked = given["REQ"] and not self.was_asked, given["REQ"]
        if given["DISCONNECT"]:
            assert not given["REQ"], "a request while the connection is closed"
            self.BUSY = False
            return
        place = {name: given[name] for name in ("MB_MODE", "MB_DATA_ADDR", "MB_DATA_LEN")}
        if not self.BUSY:
            if rises:
                self.BUSY, self.asked, self.calls = True, place, 0
                self.data = list(given["MB_DATA_PTR"])
            return
        assert place == self.asked, "parameters must not change while BUSY"
        self.calls += 1
        if self.calls == 2:
            self.BUSY = False
            self.finish(given)

    def finish(self, given: dict[str, Any]) -> None:
        address, count, words = given["MB_DATA_ADDR"] - 40001, given["MB_DATA_LEN"], given["MB_DATA_PTR"]
        assert words == self.data and len(words) >= count and 0 <= address < 9999
        assert self.RCV_TIMEOUT == 0.5, "with its own 2 s the status of a gateway that is gone would look fresh"
        connection = given["CONNECT"]
        assert connection["CONNECTIONTYPE"] == 11 and connection["ACTIVEESTABLISHED"]
        octets = connection["REMOTEADDRESS"]["ADDR"][1:]
        self.plc.gateway.asked_at.add((".".join(map(str, octets)), connection["REMOTEPORT"]))
        self.plc.connection = connection["INTERFACEID"], connection["ID"]
        if given["MB_MODE"] == 0:
            request = struct.pack(">BHH", 3, address, count)
        elif count == 1:
            request = struct.pack(">BHH", 6, address, words[0])
        else:
            request = struct.pack(f">BHHB{count}H", 16, address, count, 2 * count, *words[:count])
        try:
            pdu = self.plc.gateway.ask_unit(self.MB_Unit_ID, request)
        except Unplugged:
            self.ERROR, self.STATUS = True, self.NO_ANSWER
            return
        if pdu[0] & 0x80:
            self.ERROR, self.STATUS = True, 0x8380 + {1: 1, 2: 3}.get(pdu[1], 4)
            return
        if given["MB_MODE"] == 0:
            words[:count] = struct.unpack(f">{count}H", pdu[2:])
        self.DONE = True


class S7(Plc):
    """SCL: the block is called in a cyclic interrupt."""

    CYCLE_S = 0.01
    TYPES = ('"FG_Command"', '"FG_Model"')
    TEXTS = ("FG_TestResultText", "FG_VerdictText")
    NAMES: ClassVar[dict[str, str]] = {
        **{name: name for name in ("enable", "reset", "force", "upload", "slot", "command", "model", "pull")},
        **{name: name for name in ("tare", "text", "status", "ended", "uploadBusy")},
        "take": "takeOwnership",
        "test": "selfTest",
        "testing": "selfTestBusy",
        "tested": "selfTestDone",
        "not tested": "selfTestError",
        "words": "test",
        "uploaded": "uploadDone",
        "failing": "failingIndex",
    }

    def __init__(self, text: str, gateway: GatewayAtHand) -> None:
        super().__init__(text, "scl", gateway, "ForceGateway")
        self.connection = 0, 0  # InterfaceId and ID, as MB_CLIENT was told

    def prepare(self) -> None:
        connection = dict.fromkeys(("InterfaceId", "ID", "ConnectionType", "ActiveEstablished"), ("int", None))
        connection |= {"RemoteAddress": ("IP_V4", None), "RemotePort": ("int", None), "LocalPort": ("int", None)}
        self.machine.types |= {"TCON_IP_V4": connection, "IP_V4": {"ADDR": (("array", 0, 4, "int"), None)}}
        self.machine.blocks["MB_CLIENT"] = lambda: MbClient(self)

    def scan(self) -> None:
        self.now_s += self.CYCLE_S
        self.machine.steps = 0
        given = {"slot": 0} | self.inputs | self.structures
        self.block.call(given)
