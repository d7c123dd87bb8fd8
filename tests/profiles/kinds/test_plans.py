"""Plan files: an experiment or a ladder, read strictly, written so that they read back the same."""

from pathlib import Path

import jsonschema
import pytest
import yaml

from gateway.control.runs.experiment_plan import ExperimentPlan, Move, MoveKind, Part
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.profiles import ProfileError
from gateway.profiles.kinds.plans import load_plan_fields, plan_document, plan_of, plan_text
from gateway.profiles.schema import schema
from tests.profile_files import load_plan

PLAN = ExperimentPlan(
    name='steps "and" more',
    description="é: # no comment",
    shows=("transport-delay", "extra-lag"),
    columns=("pressure_kpa",),
    by_hand=("turn the tool",),
    check=False,
    parts=(
        Part(name="steps", why="they part lags", moves=(Move(do=MoveKind.STEP, to_share=0.1 + 0.2, hold_s=1.0e-5),)),
        Part(
            name="no",
            moves=(
                Move(do=MoveKind.RAMP, to_n=20.0, over_s=3.0),
                Move(do=MoveKind.LADDER, to_v=1.0, stairs=10, hold_s=0.5),
                Move(do=MoveKind.REVERSALS, size_share=0.1, times=3, over_s=0.4),
                Move(do=MoveKind.DWELL, hold_s=3.0),
            ),
        ),
    ),
)


def written(path: Path, text: str) -> Path:
    file = path / "p.yaml"
    file.write_text(text, encoding="utf-8")
    return file


def test_a_written_plan_reads_back_to_the_last_bit(tmp_path: Path) -> None:
    assert load_plan(written(tmp_path, plan_text(PLAN, "two\nlines of comment"))) == PLAN


def test_it_crosses_the_control_socket_the_same(tmp_path: Path) -> None:
    assert plan_of(plan_document(PLAN)) == PLAN
    assert plan_of(load_plan_fields(written(tmp_path, plan_text(PLAN)))) == PLAN


def test_a_written_plan_is_valid_by_the_schema_and_a_stranger_is_not(tmp_path: Path) -> None:
    validator = jsonschema.Draft202012Validator(schema("plan"))
    document = yaml.safe_load(plan_text(PLAN))
    validator.validate(document)
    validator.validate({"groups": 3, "step_v": 0.5})
    assert not validator.is_valid(document | {"no_such_key": 1})


def test_a_ladder_says_no_more_than_its_file(tmp_path: Path) -> None:
    file = written(tmp_path, "groups: 5\nstep_v: 0.5\n")
    assert load_plan(file) == CalibrationPlan(groups=5, step_v=0.5)
    assert load_plan_fields(file) == {"groups": 5, "step_v": 0.5}


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        (
            "groups: five\nstep: 0.1\n",
            [":1:9 groups: \"five\" is not a whole number", ":2:1 step: is not a known key; did you mean step_v"],
        ),
        ("name: x\n", [":1:1 parts: is missing"]),
        ("name: x\nparts: []\n", [":2:8 parts: is empty"]),
        (
            "name: x\nparts:\n  - name: a\n    moves:\n      - {do: stepp, to_share: 0.5}\n      - {do: step, to_share: 1.5}\n",
            [":5:14 parts[0].moves[0].do: stepp is not one of step, dwell", ":6:30 parts[0].moves[1].to_share: 1.5 is above 1"],
        ),
        (
            "name: x\nparts:\n  - name: a\n    moves:\n      - {do: step, hold_s: 1}\n      - {do: dwell, hold_s: 1, times: 3}",
            [":5:9 parts[0].moves[0]: a step needs to_share", ":6:39 parts[0].moves[1].times: means nothing in a dwell"],
        ),
        ("name: x\nname: y\nparts: []\n", [":2:1 name: the key stands twice"]),
        ("", ["is an empty file; a plan is needed here"]),
    ],
)  # fmt: skip
def test_a_bad_plan_is_refused_at_its_place(tmp_path: Path, text: str, faults: list[str]) -> None:
    with pytest.raises(ProfileError) as refused:
        load_plan(written(tmp_path, text))
    assert len(refused.value.faults) == len(faults)
    for fault, told in zip(faults, refused.value.faults, strict=True):
        assert fault in str(told)


def test_over_the_socket_the_first_fault_is_told_in_one_sentence() -> None:
    with pytest.raises(ValueError, match="plan: grups is not a known key; did you mean groups"):
        plan_of({"grups": 1})
    with pytest.raises(ValueError, match="groups true is not a whole number"):
        plan_of({"groups": True})
    assert plan_of({}) == CalibrationPlan()
