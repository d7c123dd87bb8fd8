"""A program that uses the generated client of Python as the page says: one exchange a cycle, in virtual time, no socket."""

import socket
from types import SimpleNamespace
from typing import Any

from tests.clients.gateway_at_hand import GatewayAtHand, Unplugged


class SocketAtHand:
    """What the client does to its socket, put to the gateway."""

    def __init__(self, gateway: GatewayAtHand) -> None:
        self._gateway, self._answer = gateway, b""
        self.settimeout = self.setsockopt = self.close = lambda *_: None

    def sendall(self, frame: bytes) -> None:
        try:
            self._answer += self._gateway.ask(frame)  # what nobody has read stays
        except Unplugged:
            raise TimeoutError("no answer") from None

    def recv(self, count: int) -> bytes:
        data, self._answer = self._answer[:count], self._answer[count:]
        return data


class PythonProgram:
    """text: what people would be shown: of the last refusal, loss or fault."""

    def __init__(self, text: str, gateway: GatewayAtHand) -> None:
        self.module: dict[str, Any] = {}
        exec(text, self.module)
        self.gateway, self.now_s, self.text, self.uploaded = gateway, 0.0, "", False
        self.module["time"] = SimpleNamespace(monotonic=lambda: self.now_s, sleep=self._sleep)
        self.module["socket"] = SimpleNamespace(
            create_connection=self._connect, IPPROTO_TCP=socket.IPPROTO_TCP, TCP_NODELAY=socket.TCP_NODELAY
        )
        self.client = self.module["Client"]()
        self._upload: tuple[dict[str, Any], int] | None = None
        self.found: dict[str, Any] = {}

    def _sleep(self, seconds: float) -> None:
        self.now_s += seconds

    def _connect(self, address: tuple[str, int], timeout_s: float) -> SocketAtHand:
        self.gateway.asked_at.add(address)
        try:
            self.gateway.connect()
        except Unplugged:
            raise ConnectionRefusedError from None
        return SocketAtHand(self.gateway)

    def enable(self, force_n: float) -> None:
        self.text = ""
        self._ask_for(self.client.enable, force_n)

    def force(self, force_n: float) -> None:
        self._ask_for(self.client.force, force_n)

    def _ask_for(self, act: Any, force_n: float) -> None:
        try:
            act(force_n)
        except ValueError:
            _, _, least, most = self.module["COMMAND"]["force_setpoint"]
            self.text = f"allowed {least:.2f} .. {most:.2f}"

    def disable(self) -> None:
        self.client.disable()

    def reset(self) -> None:
        self.client.reset_fault()

    def tare(self) -> None:
        self.client.tare()

    def pull(self, *, pulls: bool) -> None:
        self.client.pull(pulls)

    def self_test(self) -> None:
        self.text, self.found = "", {}
        self.client.self_test()

    def end_self_test(self) -> None:
        self.client.disable()

    @property
    def is_testing(self) -> bool:
        return bool(self.client.is_testing)

    def begin_upload(self, model: dict[str, Any], slot: int) -> None:
        self._upload = model, slot

    def cycle(self, seconds: float = 0.04) -> None:
        self.now_s += seconds
        had_ended, was_testing = self.ended, self.is_testing
        try:
            status = self.client.exchange()
            if was_testing and not self.is_testing:
                self.found = self.client.read_self_test()
            if self._upload:
                (model, slot), self._upload = self._upload, None
                self.client.stage(model, slot)
                self.client.commit()
                self.uploaded = True
        except self.module["Refused"] as refused:
            self.text = str(refused)
        except self.module["Lost"] as lost:
            self.text = f"lost: {lost}"
        else:
            if status["fault"]:
                self.text = self.module["FAULTS"][status["fault_code"]]
            elif self.ended and not had_ended:
                self.text = "disabled by the gateway or another master"
            elif self.found and was_testing:
                self.text = f"self-test {self.found['result']}"

    @property
    def enabled(self) -> bool:
        return bool(self.client.status and self.client.status["enabled"])

    @property
    def in_band(self) -> bool:
        return bool(self.client.status and self.client.status["in_band"])

    @property
    def ended(self) -> bool:
        return bool(self.client.ended)
