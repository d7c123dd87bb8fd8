"""What holds of one run from its begin to its end: its force, its way to 0, and what registers and log say of it then."""

import re
from dataclasses import dataclass
from functools import cache
from math import inf
from typing import Final

from gateway.codes.faults import FaultCode
from gateway.modbus import Peer
from gateway.registers.words import CalibrationPhase, SelfTestResult, SelfTestVerdict, State, StatusBit
from gateway.service.running_rig.calibration_runs import FOLLOWED_S
from tests.control.bench import bsfm
from tests.service.running_rig.runs.drawn.run_rig import RunRig

STOP_S: Final = 4.0
"""The longest way to 0 N."""
SEEN_S: Final = 0.021
"""Two ticks: one until it is seen, one until it is decided."""
END: Final = re.compile(r"(self-test|calibration|experiment)( ladder| \S+)? (done|stopped)|the run is stopped$")
WHY: Final = re.compile(r"stopped|done after|done:|disabled by|A3\d\d|A4\d\d")
TOLD: Final = re.compile(r"self-test ([a-z ]+) (passed|warned|failed|not tested): ")
ITEMS: Final = "noise", "resolution", "zero", "sign", "scale", "response", "leak", "output_line", "cell_line"
FAULTS: Final = {code.code for code in FaultCode} - {"", FaultCode.MASTER_LOST.code}
ENDS: Final = (
    CalibrationPhase.FITTING,
    CalibrationPhase.STOPPED,
    CalibrationPhase.RECORDED,
    CalibrationPhase.TESTED,
)
STRONG_N_PER_V: Final = 9.0
"""So much stronger than its calibration a machine may fail a test of its scale."""
model = cache(bsfm)
PASSED, FAILED, NOT_TESTED = SelfTestVerdict.PASSED, SelfTestVerdict.FAILED, SelfTestVerdict.NOT_TESTED


@dataclass(frozen=True)
class Asked:
    """What somebody asks for. kind: of what is to begin, empty for nothing; master: None for somebody at this machine;
    has_check: a plan that begins with the coarse cycle; with_enable: in the same word."""

    kind: str = ""
    master: Peer | None = None
    has_check: bool = True
    with_enable: bool = False

    @property
    def by(self) -> str:
        return self.master.host if self.master else "here"


@dataclass
class Run:
    """What has been begun. most_n: the largest force that it states; since: lines of the log before it; scale: of the
    calibration in use; is_odd: something that its forces cannot be judged behind; flaws: of the tool, from begin to end."""

    asked: Asked
    most_n: float
    begun_s: float
    since: int
    scale: float
    is_odd: bool
    flaws: tuple[str, ...]
    ramps_since_s: float = inf
    read: int = 0
    before_v: float = inf
    has_pressed: bool = False  # until then the machine follows what was written before the run

    @property
    def kind(self) -> str:
        return self.asked.kind

    @property
    def is_local(self) -> bool:
        return self.asked.master is None

    @property
    def is_ramping(self) -> bool:
        return self.ramps_since_s < inf


class RunLaws:
    """number: of self-tests begun since the process began; beaten_s: when the owner has beaten last; followed_s: when somebody
    at this machine has asked last; complain: a law did not hold."""

    def __init__(self, rig: RunRig) -> None:
        self.rig = rig
        self.run: Run | None = None
        self.number = 0
        self.beaten_s = self.followed_s = 0.0
        self.broken: list[str] = []

    def complain(self, words: str) -> None:
        """Note a law that did not hold."""
        self.broken.append(f"{self.rig.now():.2f} s {words}")

    def begin(self, asked: Asked, scale: float, since: int, *, is_odd: bool) -> None:
        """A run has the output: what it states is known from here on."""
        rig, plant, stated_n = self.rig, self.rig.plant, self.rig.settings.limits.force_max_n
        flaws = {"contact": plant.contact, "air": plant.air, "unit": plant.unit == 1.0, "sign": plant.sign > 0.0}
        if asked.kind == "self-test" and rig.settings.self_test:
            self.number += 1
            rest_n = max(plant.force_n, model(scale).force_n(rig.settings.limits.safe_voltage_v, 1.0))
            stated_n = max(rig.settings.self_test.force_n, rest_n + 0.1)
            flaws = flaws if rig.settings.self_test.force_n else {}
        if not asked.has_check:
            flaws = {}
        wrong = tuple(name for name, is_right in flaws.items() if not is_right)
        self.run = Run(asked, stated_n, rig.now(), since, scale, is_odd, wrong, read=since)

    def stopped(self, run: Run, state: State, *, at_once: bool) -> None:
        """Judge what a stop has done in its own write."""
        rig = self.rig
        if at_once and (state is State.CALIBRATING or rig.wire.voltage_v != rig.settings.limits.safe_voltage_v):
            self.complain(f"{rig.wire.voltage_v:.2f} V, {state.name} behind a disable")
        run.ramps_since_s = min(run.ramps_since_s, rig.now())

    def look(self, state: State) -> None:
        """Judge this moment of the run, if there is one."""
        if (run := self.run) is None:
            return
        rig, now_s = self.rig, self.rig.now()
        if any(END.search(line) for line in rig.log[run.read :]):
            run.ramps_since_s = min(run.ramps_since_s, now_s)
        run.read = len(rig.log)
        if state is not State.CALIBRATING:
            self._judge_end(run, state)
            self.run = None
            return
        self._judge_force(run, now_s)
        self._judge_who(run, now_s)
        if rig.ticks % 10 == 0:
            if rig.word("status_word") & (StatusBit.ENABLED | StatusBit.READY) != StatusBit.ENABLED:
                self.complain(f"status_word is {rig.word('status_word'):#x} in a run")
            is_test = rig.word("self_test_result") == SelfTestResult.RUNNING
            if is_test is not (run.kind == "self-test") and not run.is_ramping:
                self.complain(f"self_test_result is {rig.word('self_test_result')} in a {run.kind}")

    def _judge_force(self, run: Run, now_s: float) -> None:
        volts, force_n = self.rig.wire.voltage_v, self.rig.plant.force_n
        expected_n = model(run.scale).force_n(volts, 1.0)
        if expected_n > run.most_n + 0.1:
            self.complain(f"{volts:.2f} V make {expected_n:.1f} N, {run.most_n:g} N are stated")
        run.has_pressed |= volts != self.rig.settings.limits.safe_voltage_v
        if run.has_pressed and not run.is_odd and run.asked.has_check and force_n > run.most_n + 0.1:
            self.complain(f"{force_n:.1f} N press, {run.most_n:g} N are stated by the {run.kind}")
        if "sign" in run.flaws and force_n > 12.0:
            self.complain(f"{force_n:.1f} N press though the sign is wrong")
        if now_s - run.ramps_since_s > STOP_S + 0.1:
            self.complain("a run that was stopped is on its way to 0 for longer than 4 s")
        if now_s > run.ramps_since_s and volts > run.before_v + 1e-9:
            self.complain(f"{run.before_v:.3f} V rise to {volts:.3f} V behind a stop")
        run.before_v = volts

    def _judge_who(self, run: Run, now_s: float) -> None:
        """Whether whoever has asked for it is there."""
        bounds = self.rig.settings.supervision
        if run.is_ramping:
            return
        if run.is_local:
            if now_s - self.followed_s > FOLLOWED_S + 2.0 * SEEN_S:
                self.complain(f"a run goes on {now_s - self.followed_s:.2f} s behind the last who has followed it")
            return
        if bounds.lease_s is None:
            return
        lost_s = now_s - max(run.begun_s, self.beaten_s) - bounds.lease_s
        if lost_s > SEEN_S:
            self.complain(f"a run goes on {lost_s:.2f} s behind the lease")

    # -- its end

    def _judge_end(self, run: Run, state: State) -> None:
        rig, said = self.rig, self.rig.log[run.since :]
        phase = CalibrationPhase(rig.word("calibration_phase"))
        if phase not in ENDS or (state is State.FAULT and phase is not CalibrationPhase.STOPPED and not run.is_ramping):
            self.complain(f"calibration_phase {phase.name} behind a run, {state.name}")
        if rig.word("fault_code") == FaultCode.MASTER_LOST and rig.now() - run.ramps_since_s > SEEN_S:
            self.complain("a run that was stopped has needed its master on its way to 0")
        if rig.word("calibration_time_left") or rig.word("force_accepted"):
            self.complain("a run that has ended still takes time, or a force")
        if not any(WHY.search(line) for line in said):
            self.complain(f"why the {run.kind} has ended is not in the log: {said}")
        if run.flaws and phase is CalibrationPhase.FITTING:
            self.complain(f"a ladder is fitted of a tool with {run.flaws}")
        faults = [line for line in said if line.split(" ")[0] in FAULTS]
        if faults and state is not State.FAULT:
            self.complain(f"{state.name} behind {faults}")
        if run.kind == "self-test":
            self._judge_report(run, said)

    def _judge_report(self, run: Run, said: list[str]) -> None:
        rig, code, text = self.rig, FaultCode(self.rig.word("fault_code")), "\n".join(said)
        result = SelfTestResult(rig.word("self_test_result"))
        verdicts = {item: SelfTestVerdict(rig.word(f"self_test_{item}")) for item in ITEMS}
        told = {item.replace(" ", "_"): word.replace(" ", "_").upper() for item, word in TOLD.findall(text)}
        wrong = [(item, one.name) for item, one in verdicts.items() if told.get(item, NOT_TESTED.name) != one.name]
        if wrong:
            self.complain(f"the log does not tell {wrong}: {said}")
        if not re.search(rf"self-test {rig.word('self_test_count')} {result.name.lower()}: ", text):
            self.complain(f"the log tells another result than {result.name}: {said}")
        if rig.word("self_test_count") != self.number:
            self.complain(f"self_test_count is {rig.word('self_test_count')}, {self.number} were begun")
        worst = max(verdicts.values())
        is_well = result not in (SelfTestResult.WARNED, SelfTestResult.FAILED, SelfTestResult.STOPPED)
        passes = worst is PASSED and result is SelfTestResult.PASSED and (not code or run.is_ramping)
        if is_well and not passes:
            self.complain(f"{result.name} with {worst.name} and {code.name}")
        if (
            code not in (FaultCode.NONE, FaultCode.MASTER_LOST)
            and not run.is_ramping
            and result is not SelfTestResult.FAILED
        ):
            self.complain(f"{result.name} behind {code.name}")
        if worst is FAILED and result not in (SelfTestResult.FAILED, SelfTestResult.STOPPED):
            self.complain(f"{result.name} though an item has failed")
        passed = {item for item, verdict in verdicts.items() if verdict is PASSED}
        lies = {"sign": {"sign"}, "contact": {"sign", "scale", "response"}, "unit": {"scale"}, "air": {"sign", "scale"}}
        for flaw in run.flaws:
            if lies[flaw] & passed:
                self.complain(f"{lies[flaw] & passed} passed though {flaw} is wrong: {said}")
        # behind a fault the fault's own cause is judged: an output that had become deaf before the test, say
        if (
            worst is FAILED
            and not code
            and not run.is_odd
            and not run.flaws
            and rig.plant.gain_n_per_v < STRONG_N_PER_V
        ):
            self.complain(f"failed, though nothing has happened: {said}")
