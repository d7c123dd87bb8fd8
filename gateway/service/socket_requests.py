"""What each verb of control.sock and rig.sock takes: one frozen dataclass per verb, read strictly.

An unknown key, a wrong type, NaN, a number out of range: a sentence, before any handler sees a value. Defaults stand for keys
that are left out; null is no way to leave one out. The views of pydantic are made with this module, not with the first
request: they take milliseconds, which the control loop does not have.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Final, Literal, TypeVar

from annotated_types import Ge, Le, MaxLen
from pydantic import AfterValidator

from gateway import defaults
from gateway.control.runs.experiment_plan import ExperimentPlan
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.profiles.strict_yaml.faults import printable
from gateway.profiles.strict_yaml.text import Document
from gateway.profiles.strict_yaml.typed import adapter, build
from gateway.recording.label import LONGEST_NAME, LONGEST_NOTE

Shape = TypeVar("Shape")
Number = Annotated[int, Ge(0), Le(999_999)]

_STRICT: Final = defaults.STRICT | {"allow_inf_nan": False}


def _check_text(text: str) -> str:
    if not all(sign.isprintable() or sign == "\n" for sign in text):
        raise ValueError(f'"{printable(text)}" has signs that cannot be printed')
    return text


Text = AfterValidator(_check_text)
"""What a user says, and others read on a terminal."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EmptyRequest:
    """Nothing but the verb."""

    __pydantic_config__ = _STRICT


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordRequest:
    """on left out: how it is. name, note: what the user says of it; for_s: it ends by itself after so long, 0: it does not."""

    __pydantic_config__ = _STRICT
    on: bool | None = None
    name: Annotated[str, MaxLen(LONGEST_NAME), Text] = ""
    note: Annotated[str, MaxLen(LONGEST_NOTE), Text] = ""
    for_s: Annotated[float, Ge(0), Le(31 * 86400)] = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationRequest:
    """Neither: what is in use. force: a rejected one, too."""

    __pydantic_config__ = _STRICT
    use: Number | None = None
    force: bool = False
    rollback: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantRequest:
    """Neither: what is in use. use 0: the rig's own."""

    __pydantic_config__ = _STRICT
    use: Number | None = None
    rollback: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrateRequest:
    """plan: as a plan file has it; its own reader judges it. continues: recordings of the run that is resumed. name: of the
    calibration that comes of it; empty for one made up."""

    __pydantic_config__ = _STRICT
    plan: dict[str, Any] | None = None
    continues: Annotated[tuple[Number, ...], MaxLen(1000)] = ()
    name: Annotated[str, MaxLen(LONGEST_NAME), Text] = ""
    dry_run: bool = False
    stop: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ResidualRequest:
    """Report of the residual watch; without a cause it is a question. worse: what the plant in use has made worse;
    why_skipped: why it could not judge the newest window."""

    __pydantic_config__ = _STRICT
    cause: Number | None = None
    sentence: str = ""
    worse: str = ""
    why_skipped: str = ""
    counters: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultRequest:
    """A fault of the simulated rig. values: of its plant, by section.field."""

    __pydantic_config__ = _STRICT
    name: str
    on: bool = True
    values: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulationRequest:
    """What is set on the simulated rig, by name, and what is cleared before that. Neither: what is set."""

    __pydantic_config__ = _STRICT
    set: dict[Annotated[str, MaxLen(100)], bool | float | Annotated[str, MaxLen(100)]] = field(default_factory=dict)
    clear: Annotated[tuple[Annotated[str, MaxLen(100)], ...], MaxLen(200)] = ()
    clear_all: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ModbusRequest:
    """A Modbus request that came by another way than a face. pdu: in hex; until_s: monotonic, behind it nobody waits for the
    answer any more, and nothing must come of it; left out: it is always wanted, as a stop is."""

    __pydantic_config__ = _STRICT
    via: Literal["web", "mqtt", "opcua"]
    pdu: Annotated[str, MaxLen(506)]
    unit: Annotated[int, Ge(0), Le(255)] = defaults.UNIT_ID
    until_s: float | None = None


for _shape in (
    ModbusRequest,
    EmptyRequest,
    RecordRequest,
    CalibrationRequest,
    PlantRequest,
    CalibrateRequest,
    ResidualRequest,
    FaultRequest,
    SimulationRequest,
    CalibrationPlan,
    ExperimentPlan,
):
    adapter(_shape)


def parse_request(shape: type[Shape], request: Mapping[str, Any]) -> Shape:
    """Return the request without its verb as `shape`. ValueError names the first key that does not fit."""
    fields = {key: value for key, value in request.items() if key != "do"}
    for key, value in fields.items():
        if value is None:
            raise ValueError(f"{printable(key)} is null: leave it out instead")
    shaped, faults = build(shape, Document("request", fields, {}))
    if shaped is None or faults:
        raise ValueError(printable(f"{faults[0].path} {faults[0].message}".strip()))
    return shaped
