"""Which load cell is behind the port? Asked once after each opening, where its profile can ask it, before any reading."""

from gateway.codes.faults import FaultCode
from gateway.devices import DeviceProfile
from gateway.devices.device_checks.spelling import CheckSpelling
from gateway.devices.grammar import Grammar
from gateway.devices.messages import DeviceStep, Garbage


class CellIdentity:
    """question: what asks it, empty where the profile has no words for it; is_due: it has not answered yet; fault: another
    device answered, said is what it calls itself."""

    def __init__(self, profile: DeviceProfile) -> None:
        self._grammar = Grammar(profile)
        self._checks = CheckSpelling(self._grammar)
        self._lines = self._grammar.answers()
        can_ask = profile.own_identity is not None and profile.read_force is not None
        self.question = self._checks.ask_cell_identity() if can_ask else b""
        self._no_answers = self._grammar.no_answers(self.question)
        self.begin()

    def begin(self) -> None:
        """Begin anew: the port has been opened, and another device may be behind it."""
        self._lines.forget()
        self._grammar.expect_own_words(self._lines, self.question)
        self.is_due = bool(self.question)
        self.fault, self.said = FaultCode.NONE, ""

    def receive(self, chunk: bytes) -> list[Garbage]:
        """Take the bytes of its answer; return those that are none."""
        garbage = []
        for line in self._lines.feed(chunk):
            answer = self._checks.answer(DeviceStep.IDENTITY, self._grammar.body(line, self.question))
            if answer is None:
                garbage += [] if line.data in self._no_answers else [Garbage(line.data)]
                continue
            self.is_due = False
            if not answer.is_right:
                self.fault, self.said = FaultCode.WRONG_DEVICE, f"{self._grammar.profile.name}'s port: {answer.text}"
        return garbage
