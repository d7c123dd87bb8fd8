"""The JSON of a diagnosis is a contract: exactly these fields, numbers that JSON has, the same values as the answer."""

import json
from dataclasses import replace

import jsonschema
import pytest

from gateway.diagnosis.input_checks import Suspect
from gateway.diagnosis.result import (
    Estimate,
    Extended,
    Gain,
    Leftover,
    Machine,
    OwnEffect,
    Refit,
    RefittedNumber,
    Verdict,
)
from gateway.reports.diagnosis.document import diagnosis_document
from tests.reports.fake_diagnosis import FRICTION, WARMTH, diagnosis

NUMBER = {"type": ["number", "null"]}
INTERVAL = {"type": "array", "items": NUMBER, "minItems": 2, "maxItems": 2}
TEXT = {"type": "string"}


def exactly(**properties: object) -> dict[str, object]:
    return {"type": "object", "properties": properties, "required": list(properties), "additionalProperties": False}


def several(**properties: object) -> dict[str, object]:
    return {"type": "array", "items": exactly(**properties)}


NUMBER_OR_NULL = {"type": ["number", "null"]}
CONTRACT = exactly(
    format={"const": 1},
    verdict={"enum": ["nothing-found", "confirmed", "partial", "unknown"]},
    baseline=exactly(
        rms_n=NUMBER,
        noise_floor_n=NUMBER,
        noise_floor_source={"enum": ["given", "replicates", "rests", "calibration", "search"]},
        samples={"type": "integer"},
        duration_s=NUMBER,
    ),
    causes=several(
        name=TEXT,
        group={"type": "array", "items": TEXT},
        confidence=NUMBER,
        parameters={"type": "object", "additionalProperties": exactly(value=NUMBER, unit=TEXT, ci95=INTERVAL)},
        gain=exactly(held_out_rms_before_n=NUMBER, held_out_rms_after_n=NUMBER, ci95=INTERVAL, share_of_excess=NUMBER),
    ),
    leftover=several(
        depends_on=TEXT,
        shape=TEXT,
        share=NUMBER,
        columns={"type": "array", "items": TEXT},
        frequency_hz=NUMBER_OR_NULL,
        amplitude_n=NUMBER_OR_NULL,
        period_s=NUMBER_OR_NULL,
        file={"type": ["string", "null"]},
        experiment=TEXT,
    ),
    not_identifiable=several(name=TEXT, why=TEXT, experiment=TEXT),
    rejected=several(name=TEXT, gain=NUMBER),
    extended=exactly(held_out_rms_n=NUMBER, reaches_noise_floor={"type": "boolean"}),
    runtime_s=NUMBER,
    suspects=several(
        code=TEXT,
        recording=TEXT,
        column=TEXT,
        swapped_with={"type": ["string", "null"]},
        unit={"type": ["string", "null"]},
        factor=NUMBER,
        is_sure={"type": "boolean"},
        option=TEXT,
        sentence=TEXT,
    ),
    notes={"type": "array", "items": TEXT},
)


@pytest.mark.parametrize(
    "answer",
    [
        diagnosis(),
        diagnosis(causes=(FRICTION, WARMTH), verdict=Verdict.CONFIRMED),
        diagnosis(causes=(), leftover=(), rejected=(), not_identifiable=(), verdict=Verdict.NOTHING_FOUND),
    ],
)
def test_exactly_the_fields_of_the_contract_stand_in_the_json(answer) -> None:
    document = json.loads(json.dumps(diagnosis_document(answer, 1.5), allow_nan=False))
    assert list(jsonschema.Draft202012Validator(CONTRACT).iter_errors(document)) == []


def test_values_are_those_of_the_answer_and_causes_keep_their_order() -> None:
    document = diagnosis_document(diagnosis(causes=(FRICTION, WARMTH)), 1.5)
    assert [cause["name"] for cause in document["causes"]] == ["load-dependent-friction", "thermal-zero-drift"]
    result = document["causes"][0]["parameters"]["load_dependent_n_per_n"]
    assert result == {"value": 0.0497, "unit": "N/N", "ci95": [0.0482, 0.0511]}
    assert document["causes"][1]["group"] == ["thermal-zero-drift", "warm-up", "linear-drift"]
    assert document["runtime_s"] == 1.5


def test_each_number_of_the_answer_stands_under_its_own_name() -> None:
    """Programs read them: a gain whose before and after are exchanged is a loss, and of the right type."""
    suspect = Suspect("E521", "a.csv", "command_v", 1.5, other="force_n", is_sure=False, option="--columns x")
    rest = Leftover("time_s", "wanders", 0.4, ("time_s",), 2.0, 3.0, 4.0, "a.csv", "a rest")
    size = {"zero_n": Estimate("cell", 0.5, "N", (0.4, 0.6))}
    machine = Machine(("old.fgr",), (OwnEffect("creep", size),), 0.3, 0.2)
    refit = Refit(1.4, 1.3, (RefittedNumber("friction", "coulomb_n", "N", 1.0, 3.0, 1.2),))
    answer = diagnosis(
        suspects=(suspect,), leftover=(rest,), machine=machine, extended=Extended(0.25, True), refit=refit
    )
    document = diagnosis_document(answer, 1.5)
    assert document["suspects"] == [{
        "code": "E521", "recording": "a.csv", "column": "command_v", "swapped_with": "force_n", "unit": None, "factor": 1.5,
        "is_sure": False, "option": "--columns x", "sentence": suspect.sentence,
    }]  # fmt: skip
    assert document["leftover"] == [{
        "depends_on": "time_s", "shape": "wanders", "share": 0.4, "columns": ["time_s"], "frequency_hz": 2.0,
        "amplitude_n": 3.0, "period_s": 4.0, "file": "a.csv", "experiment": "a rest",
    }]  # fmt: skip
    own = [{"name": "creep", "parameters": {"zero_n": {"value": 0.5, "unit": "N", "ci95": [0.4, 0.6]}}}]
    assert document["machine"] == {"against": ["old.fgr"], "effects": own, "common_error_n": 0.3, "left_n": 0.2}
    numbers = {"coulomb_n": {"value": 3.0, "before": 1.0, "unit": "N", "costs_n": 1.2}}
    assert document["refit"] == {"as_given_rms_n": 1.4, "parameters": numbers}
    (cause,) = document["causes"]
    assert cause["before"] == {"load_dependent_n_per_n": answer.base.friction.load_dependent_n_per_n}
    assert cause["gain"] == {
        "held_out_rms_before_n": 1.186, "held_out_rms_after_n": 0.257, "ci95": [0.871, 0.986], "share_of_excess": 0.962,
    }  # fmt: skip
    assert document["extended"] == {"held_out_rms_n": 0.25, "reaches_noise_floor": True}
    assert (document["baseline"]["rms_n"], document["baseline"]["noise_floor_n"]) == (1.186, 0.12)


def test_what_is_not_said_is_null_or_not_there() -> None:
    """A column in another unit is swapped with none; what a foreign machine's numbers are says nothing of this plant."""
    suspect = Suspect("E520", "a.csv", "force_n", 1000.0, unit="mn", option="--columns force_n=force_n:mn")
    refit = Refit(1.4, 1.3, (RefittedNumber("friction", "coulomb_n", "N", 1.0, 3.0, 1.2),), is_own=False)
    document = diagnosis_document(diagnosis(suspects=(suspect,), refit=refit), 1.5)
    assert (document["suspects"][0]["swapped_with"], document["suspects"][0]["unit"]) == (None, "mn")
    assert "refit" not in document and "machine" not in document


def test_what_is_no_number_is_null() -> None:
    nan = float("nan")
    cause = replace(FRICTION, gain=Gain(1.0, 0.5, (nan, float("inf")), nan))
    rest = Leftover("time_s", "hums", 0.4, ("time_s",), nan, None, float("inf"), "", "a rest")
    answer = diagnosis_document(diagnosis(causes=(cause,), leftover=(rest,), extended=Extended(nan, False)), 1.0)
    ((left,), names) = answer["leftover"], ("frequency_hz", "amplitude_n", "period_s", "file")
    assert [left[name] for name in names] == [None] * 4
    assert answer["causes"][0]["gain"]["ci95"] == [None, None]
    assert answer["extended"]["held_out_rms_n"] is None
    jsonschema.validate(json.loads(json.dumps(answer, allow_nan=False)), CONTRACT)
