"""A serial line in virtual time: what a receiver makes of bytes that arrive at given times."""

from dataclasses import dataclass, field

from gateway.modbus.rtu_receiver import RtuReceiver, RtuRequest

BAUD = 19200
CHARACTER_S = 11 / BAUD
SILENCE_S = 3.5 * CHARACTER_S


@dataclass
class Bus:
    """One receiver with its clock; `heard` holds (time, request)."""

    unit: int = 1
    baud: int = BAUD
    now_s: float = 100.0
    may_echo: bool = True
    heard: list[tuple[float, RtuRequest]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.receiver = RtuReceiver(self.unit, self.baud, 11 / self.baud, may_echo=self.may_echo)

    def pause(self, duration_s: float) -> "Bus":
        """Let time pass, and the receiver decide when it wants to."""
        end_s = self.now_s + duration_s
        while (deadline_s := self.receiver.deadline_s) is not None and deadline_s <= end_s:
            self.heard += [(deadline_s, request) for request in self.receiver.take(deadline_s)]
        self.now_s = end_s
        return self

    def send(self, *chunks: bytes, pause_s: float = 0.0) -> "Bus":
        """Let chunks arrive, each read at once, with a pause behind each."""
        for chunk in chunks:
            self.receiver.receive(chunk, self.now_s)
            self.pause(pause_s)
        return self

    def requests(self) -> list[RtuRequest]:
        """What has been taken for requests when the line has become silent; forgotten then."""
        self.pause(1.0)
        taken = [request for _, request in self.heard]
        self.heard.clear()
        return taken
