"""The items of a self-test, the verdict on each, and the report that they make."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final, NamedTuple

from gateway.codes.faults import FaultCode
from gateway.registers.words import SelfTestResult, SelfTestVerdict


@dataclass(frozen=True, slots=True)
class SelfTestPlan:
    """Ask for the rig's self-test. tare: never; a plan has it."""

    tare: bool = False


class Item(StrEnum):
    """One thing that is tested; the register is self_test_ and this."""

    NOISE = "noise"
    RESOLUTION = "resolution"
    ZERO = "zero"
    SIGN = "sign"
    SCALE = "scale"
    RESPONSE = "response"
    LEAK = "leak"
    OUTPUT_LINE = "output_line"
    CELL_LINE = "cell_line"


FORCE_ITEMS: Final = (Item.SIGN, Item.SCALE, Item.RESPONSE, Item.LEAK)
"""Items that need a force."""

NOT_TESTED, PASSED, WARNED, FAILED = SelfTestVerdict
_WORDS: Final = {NOT_TESTED: "not tested", PASSED: "passed", WARNED: "warned", FAILED: "failed"}
_CODES: Final = {NOT_TESTED: "", PASSED: "", WARNED: "W316 ", FAILED: "A354 "}

_ITEM_OF_FAULT: Final = {
    FaultCode.SAMPLE_FROZEN: Item.RESOLUTION,
    FaultCode.SIGN_INVERTED: Item.SIGN,
    FaultCode.GAIN_WRONG: Item.SCALE,
    FaultCode.OVER_FORCE: Item.SCALE,
    FaultCode.SAMPLE_STALE: Item.CELL_LINE,
    FaultCode.CELL_LOST: Item.CELL_LINE,
    FaultCode.NOT_FINITE: Item.CELL_LINE,
    FaultCode.OUTPUT_SILENT: Item.OUTPUT_LINE,
    FaultCode.OUTPUT_REFUSED: Item.OUTPUT_LINE,
    FaultCode.OUTPUT_ALTERED: Item.OUTPUT_LINE,
    FaultCode.OUTPUT_LOST: Item.OUTPUT_LINE,
}
"""A fault of the supervision during the test is the verdict on the item that it is about."""


class Finding(NamedTuple):
    """The verdict on one item. text: what was measured and what is allowed, or why it was not tested."""

    item: Item
    verdict: SelfTestVerdict
    text: str

    @property
    def sentence(self) -> str:
        """Line of the log, with a code where it is not as it should be."""
        return f"{_CODES[self.verdict]}self-test {self.item.replace('_', ' ')} {_WORDS[self.verdict]}: {self.text}"


@dataclass(frozen=True, slots=True)
class SelfTestReport:
    """A self-test that has ended, or runs. number: of this one since the start; findings: by item, in its order; fault: that
    ended it, which may belong to no item."""

    number: int = 0
    result: SelfTestResult = SelfTestResult.NONE
    findings: tuple[Finding, ...] = ()
    fault: FaultCode = FaultCode.NONE

    @property
    def _is_stopped(self) -> bool:
        return self.result is SelfTestResult.STOPPED

    @property
    def sentences(self) -> tuple[str, ...]:
        """One per item for the log, and one for the whole."""
        counts = {verdict: sum(found.verdict is verdict for found in self.findings) for verdict in _WORDS}
        listed = ", ".join(f"{count} {_WORDS[verdict]}" for verdict, count in counts.items() if count)
        told = [found.sentence for found in self.findings if not self._is_stopped or found.verdict is not NOT_TESTED]
        ended = f"; ended by {self.fault.code} {self.fault.explanation.title}" if self.fault else ""
        whole = f"self-test {self.number} {self.result.name.lower()}: {listed}{ended}"
        return (*told, whole)


class RunEnding(NamedTuple):
    """How a run has ended. fault: that ended it, NONE for none; is_done: it came to its end; wants_force: the rig states a
    force, so that an item of it that was not tested deserves a look."""

    fault: FaultCode
    is_done: bool
    wants_force: bool


def report_of(number: int, findings: dict[Item, Finding], ending: RunEnding) -> SelfTestReport:
    """Return the report of a run that has ended."""
    fault = ending.fault
    found = dict(findings)
    if fault:
        item = _ITEM_OF_FAULT.get(fault)
        if item and verdict_of(found, item) is not FAILED:
            text = f"the supervision stopped the test with {fault.code} {fault.explanation.title}"
            found[item] = Finding(item, FAILED, text)
    why = "the test did not come to it" if ending.is_done else "the test was stopped before"
    why = f"{fault.code} {fault.explanation.title} ended the test before" if fault else why
    whole = tuple(found.get(item, Finding(item, NOT_TESTED, why)) for item in Item)
    return SelfTestReport(number, _result(whole, ending), whole, fault)


def verdict_of(findings: dict[Item, Finding], item: Item) -> SelfTestVerdict:
    """Return the verdict so far."""
    return findings[item].verdict if item in findings else NOT_TESTED


def _result(findings: tuple[Finding, ...], ending: RunEnding) -> SelfTestResult:
    if ending.fault and ending.fault is not FaultCode.MASTER_LOST:
        return SelfTestResult.FAILED
    if not ending.is_done:  # also by a master that has gone, where the rig makes a fault of it: that is about no item
        return SelfTestResult.STOPPED
    worst = max(found.verdict for found in findings)
    is_whole = not ending.wants_force or all(
        found.verdict is not NOT_TESTED for found in findings if found.item in FORCE_ITEMS
    )
    return SelfTestResult(max(worst, SelfTestResult.PASSED if is_whole else SelfTestResult.WARNED))
