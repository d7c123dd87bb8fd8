"""Sockets of a Universal Robot, as far as the generated client uses them. It runs a client's text against a gateway at hand, in
virtual time."""

import math
from contextlib import suppress
from typing import Any

from tests.clients.gateway_at_hand import GatewayAtHand, Unplugged
from tests.clients.programs.controllers.library import values
from tests.clients.programs.machine import Machine
from tests.clients.programs.syntax.languages import parse


class UniversalRobot:
    """URScript: fg_exchange per cycle, as fg_thread calls it."""

    def __init__(self, text: str, gateway: GatewayAtHand) -> None:
        self.gateway, self.sending, self.received = gateway, b"", b""
        self.sent: list[bytes] = []
        self.syncs, self.waits = 0, 0
        self.pauses: list[float] = []
        library = {
            "first_index": 0,
            "typed": True,
            "sliced": True,  # a thread whose time is used up stops within a statement
            "socket_open": values(self.open),
            "socket_close": values(self.close),
            "socket_send_byte": values(self.send_byte),
            "socket_read_byte_list": values(self.read),
            "floor": values(math.floor),
            "str_cat": values(lambda a, b: f"{a}{b}"),  # of strings and whole numbers alike (script manual)
            "textmsg": values(lambda *words: None),
            "sync": values(self.sync),
            "sleep": values(self.sleep),
        }
        self.machine = Machine(parse(text, "urscript"), library, fold=False)
        self.machine.begin()

    def serve(self, waits: int) -> list[float]:
        """Run fg_thread until it has paused so many times; return how long each pause was."""
        self.pauses, self.waits = [], waits
        with suppress(StopIteration):
            self.machine.start("fg_thread")
        return self.pauses

    def sleep(self, seconds: float) -> None:
        assert not self.machine.is_critical, "no other thread would run while it waits"
        self.pauses.append(seconds)
        if len(self.pauses) == self.waits:
            raise StopIteration

    def sync(self) -> None:
        """Use up what is left of the thread's time in this frame: the robot's motion is planned by the next."""
        self.syncs += 1

    def open(self, host: str, port: int, _name: str) -> bool:
        assert not self.machine.is_critical, "no other thread would run while it waits"
        self.gateway.asked_at.add((host, port))
        try:
            self.gateway.connect()
        except Unplugged:
            return False
        return True

    def close(self, _name: str) -> None:
        """What nobody has read goes with the socket; no manual says that it goes with the program that opened it."""
        self.received = b""

    def send_byte(self, value: int, _name: str) -> bool:
        assert isinstance(value, int) and 0 <= value <= 255
        self.sending += bytes([value])
        return True

    def read(self, count: int, _name: str, _timeout: float) -> list[int]:
        """As socket_read_byte_list: "a maximum of 30 values can be read in one command" (script manual, e-Series)."""
        assert not self.machine.is_critical, "no other thread would run while it waits"
        if count > 30:
            return [0] + [-1] * count
        if self.sending:
            self.sent.append(self.sending)
            try:
                self.received += self.gateway.ask(self.sending)
            except Unplugged:
                self.received = b""
            self.sending = b""
        data, self.received = self.received[:count], self.received[count:]
        return [len(data), *data]

    def set(self, **values: Any) -> None:
        self.machine.global_names |= values

    def get(self, name: str) -> Any:
        return self.machine.global_names[name]

    def enable(self, force_n: float) -> None:
        self.machine.start("fg_enable", force_n)

    def force(self, force_n: float) -> None:
        self.machine.start("fg_force", force_n)

    def disable(self) -> None:
        self.machine.start("fg_disable")

    def reset(self) -> None:
        self.machine.start("fg_reset_fault")

    def tare(self) -> None:
        self.machine.start("fg_tare")

    def pull(self, *, pulls: bool) -> None:
        self.machine.start("fg_pull", pulls)

    def self_test(self) -> None:
        self.machine.start("fg_self_test")

    def end_self_test(self) -> None:
        self.disable()

    @property
    def is_testing(self) -> bool:
        return bool(self.get("fg_is_testing"))

    @property
    def found(self) -> dict[str, str]:
        """What the last self-test has found, in words; nothing where it did not come to its end."""
        if not self.get("fg_tested"):
            return {}
        words = self.get("fg_test")
        say = lambda name, item: str(self.machine.start(name, words[self.get(f"FG_T_{item}")]))  # noqa: E731
        return {"result": say("fg_test_result_text", "RESULT"), "leak": say("fg_verdict_text", "LEAK")}

    def cycle(self, seconds: float = 0.04) -> None:
        self.machine.start("fg_exchange")

    @property
    def text(self) -> str:
        return str(self.get("fg_text"))

    @property
    def enabled(self) -> bool:
        return bool(self.get("fg_enabled"))

    @property
    def ended(self) -> bool:
        return bool(self.get("fg_ended"))

    def begin_upload(self, model: dict[str, Any], slot: int) -> None:
        self.machine.start("fg_model_clear")
        for name, value in model.items():
            place = self.get(f"FG_M_{name.upper()}")
            for k, each in enumerate(value if isinstance(value, list) else [value]):
                routine = "fg_model_count" if name in ("order", "slip_stops") else "fg_model_number"
                self.machine.start(routine, place + 2 * k, each)
        self.machine.start("fg_upload", slot)

    @property
    def uploaded(self) -> bool:
        return bool(self.get("fg_upload_done"))
