"""What a step answers beside the voltage, and what is written where it raised."""

from dataclasses import dataclass, field

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.control.inputs import Output
from gateway.control.messages import fault_sentence
from gateway.registers.words import State, StatusBit


@dataclass(slots=True)
class StepOutcome:
    """Answer of a step beside the voltage."""

    events: list[str] = field(default_factory=list)
    clear_command: bool = False
    release_owner: bool = False

    @property
    def is_empty(self) -> bool:
        """Decide whether there is nothing to say and nothing to do."""
        return not (self.events or self.clear_command or self.release_owner)


def safe_output(fault: FaultCode, safe_voltage_v: float = 0.0) -> Output:
    """Return what a caller writes when `step` raised: the safe voltage, latched fault. `Controller.safe_output` knows the
    rig's voltage."""
    return Output(
        safe_voltage_v,
        state=State.FAULT,
        status=StatusBit.FAULT,
        fault=fault,
        enable_block=RefusalReason.FAULT_LATCHED,
        clear_command=True,
        events=(fault_sentence(fault, "safe voltage written"),),
    )
