"""Case -> recording -> answer -> score -> one flat row; many of them over processes, each row handed on as it is ready."""

import os
import time
import traceback
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from functools import partial
from multiprocessing import get_context
from typing import Any

from generator.recording import Recording, make
from generator.sizing import UnreachableError
from judge.cases import Case
from judge.engine import ENGINES, Answer
from judge.score import score

Row = dict[str, Any]


def run_one(case: Case, engine: str) -> Row:
    """A row always: `skipped` tells why there is no recording, `failed` why there is no answer."""
    row: Row = {"kind": case.kind, "truth": list(case.wish.effects), "size": case.wish.size, "seed": case.wish.seed}
    row["excitation"] = case.wish.excitation
    begun_s = time.perf_counter()
    try:
        recording = make(case.wish)
    except UnreachableError as why:
        return row | {"skipped": str(why)}
    row |= {"noise_n": round(recording.noise_n, 4), "colour": recording.colour, "amounts": recording.amounts}
    row["generated_s"] = round(time.perf_counter() - begun_s, 2)
    spent_s = processor_s()
    try:
        answer = ENGINES[engine](recording)
    except Exception as why:  # whatever the engine dies of is a result
        return row | {"failed": f"{type(why).__name__}: {why}", "trace": traceback.format_exc(limit=-4)}
    return row | {"processor_s": round(processor_s() - spent_s, 2)} | told(case, recording, answer)


def processor_s() -> float:
    """Of this process and its ended children: what a loaded machine does not stretch."""
    return sum(os.times()[:4])


def told(case: Case, recording: Recording, answer: Answer) -> Row:
    return {
        "verdict": answer.verdict,
        "causes": [asdict(cause) for cause in answer.causes],
        "leftover": list(answer.leftover),
        "seconds": round(answer.seconds, 2),
        "family": recording.rig.friction.family,
        "jitter": recording.jitters,
        "columns": list(recording.covariates),
        **asdict(score(case.kind, case.wish.effects, answer)),
    }


def run_all(cases: Sequence[Case], engine: str, jobs: int) -> Iterator[Row]:
    """Rows in the order in which they get ready; with one job in the order of the cases, in this process."""
    if jobs <= 1:
        yield from map(partial(run_one, engine=engine), cases)
        return
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        waiting = [pool.submit(run_one, case, engine) for case in cases]
        for future in as_completed(waiting):
            yield future.result()


def line(row: Row) -> str:
    """One recording on one line: truth, size, verdict, causes with confidence and group, seconds, judgement."""
    truth = "+".join(row["truth"]) or "null"
    head = f"{truth:34s} {row['size']:4.2f}x seed {row['seed']:<4d}"
    if "skipped" in row:
        return f"{head} skipped: {row['skipped']}"
    if "failed" in row:
        return f"{head} FAILED: {row['failed']}"
    blamed = "; ".join(blame(cause) for cause in row["causes"]) or "-"
    left = f"  left: {', '.join(row['leftover'])}" if row["leftover"] else ""
    return f"{head} {judged(row):9s} {row['verdict']:13s} {row['seconds']:5.1f} s  {blamed}{left}"


def blame(cause: dict[str, Any]) -> str:
    others = [name for name in cause["group"] if name != cause["name"]]
    return f"{cause['name']} {cause['confidence']:.2f}" + (f" (or {', '.join(others)})" if others else "")


def judged(row: Row) -> str:
    """One word for a row."""
    if row["kind"] == "null":
        return "ALARM" if row["alarm"] else ("uneasy" if row["described"] else "quiet")
    if row["kind"] == "outside":
        lied = row["verdict"] == "confirmed" and row["causes"]
        return "LIED" if lied else ("described" if row["described"] else "silent")
    if row["wrong"]:
        return "WRONG"
    return "right" if row["right"] else ("grouped" if row["honest"] else ("vague" if row["causes"] else "missed"))
