"""The four ends of two wires, as seen by those who use them. Bytes in, values out; half a frame is normal.

Codecs (the template codec, or a Python one for a device that needs it) provide these; `gateway.devices.codecs` makes them.
"""

from typing import Protocol

from gateway.devices.messages import (
    Accepted,
    DeviceStep,
    ForceSample,
    Garbage,
    OutputReply,
    OutputRequest,
    Quality,
    Refused,
    RepeatedSample,
)


class OutputHost(Protocol):
    """Our end of the line to the DAC or regulator. Answers are matched to requests in order."""

    @property
    def resolution_v(self) -> float:
        """One step of the output, V."""

    @property
    def idle_questions(self) -> tuple[OutputRequest, ...]:
        """Questions for a device that has nothing to do, in turn; none where it can only be told its setting again."""

    def confirms(self, voltage_v: float, reply: Accepted, question: OutputRequest) -> bool:
        """Return whether this answer to `question` says that the setting stands, up to the rounding of the numbers on the
        wire."""

    @property
    def checks(self) -> tuple[DeviceStep, ...]:
        """Questions that this device can be asked besides its work: what it is, and of its watchdog."""

    @property
    def sign_of_life(self) -> bytes:
        """The sentence that feeds the device's watchdog, unanswered; empty where any sentence does, or there is none."""

    @property
    def feed_period_s(self) -> float:
        """Time between two signs of life, s; 0 without a watchdog."""

    @property
    def gap_s(self) -> float:
        """Silence that the wire needs between an answer and the next question, s."""

    @property
    def last_frame(self) -> bytes:
        """Return what follows the last safe frame when the gateway ends in order: the device's watchdog is switched off."""

    @property
    def hears_itself(self) -> bool:
        """Decide whether the adapter is known to bring our own words back, which a device's answer may equal."""

    @property
    def safe_reply(self) -> bytes:
        """The whole line that acknowledges the last `safe_frame` (the least voltage before the first)."""

    @property
    def safe_reply_form(self) -> bytes:
        """An expression of that line without its end, where a device may spell it otherwise; empty where it may not."""

    def request(self, message: OutputRequest) -> bytes:
        """Return the bytes to write; their answer is expected from now on. ValueRefused when the device cannot be told that."""

    def safe_frame(self, voltage_v: float) -> bytes:
        """Return the bytes that set this voltage, without expecting anything: for the final safe-voltage write."""

    def receive(self, chunk: bytes, now_s: float) -> list[OutputReply]:
        """Return what these bytes complete. Never raises."""

    def expect(self, message: OutputRequest) -> None:
        """Expect the answer of a request that is out already: what was taken for it answered an older one."""

    def forget(self) -> None:
        """Drop half-received bytes and expected answers: after a timeout, or when the port was opened again."""


class OutputDevice(Protocol):
    """The regulator's end, for the simulated rig and for tests."""

    def receive(self, chunk: bytes, now_s: float) -> list[OutputRequest | Garbage]:
        """Return requests in the order of arrival. Garbage is answered by `refusal`."""

    def reply(self, reply: OutputReply, to: OutputRequest | None = None) -> bytes:
        """Return the bytes of an answer; `to` says the question where Accepted answers a ReadVoltage."""

    def elapse(self, now_s: float) -> bool:
        """Let time pass; return whether the device's own watchdog trips now, and the output goes to its safe value."""

    def refusal(self, garbage: Garbage) -> Refused:
        """Return the device's own word for bytes that it does not obey; no text: it stays silent."""


class CellHost(Protocol):
    """Our end of the line from the load-cell amplifier."""

    @property
    def resolution_n(self) -> float:
        """One count of the amplifier as it is set in the profile, N."""

    def poll(self) -> bytes:
        """Return the bytes that ask for one reading; empty for a stream."""

    @property
    def start(self) -> bytes:
        """The bytes that begin a stream which does not begin by itself; empty for any other."""

    @property
    def gap_s(self) -> float:
        """Silence that the wire needs between an answer and the next question, s."""

    def receive(self, chunk: bytes, now_s: float) -> list[ForceSample | Garbage | RepeatedSample]:
        """Return what these bytes complete. Never raises."""

    def forget(self) -> None:
        """Drop half-received bytes: when the port was opened again."""


class CellDevice(Protocol):
    """The amplifier's end, for the simulated rig and for tests."""

    def receive(self, chunk: bytes, now_s: float) -> int:
        """Return how many readings these bytes ask for; 0 for a stream."""

    def take_answers(self) -> bytes:
        """Return the answers to what else was asked, such as what it is; each once."""

    def frame(self, force_n: float, quality: Quality = Quality.OK) -> bytes:
        """Return one reading, in the rig's unit where the frame says none. What does not fit the display is an overload, as on
        the device."""
