"""What masters and people at the machine ask for, as a scene draws it."""

import os
from math import inf
from typing import TYPE_CHECKING, Any, Final

from gateway.modbus import Peer
from gateway.registers.words import State
from tests.service.running_rig.runs.drawn.run_laws import Asked, Run
from tests.service.running_rig.runs.drawn.run_rig import Fits
from tests.service.running_rig.simulated_rig import CALIBRATE, ENABLE, OTHER, OWNER, RESET, SELF_TEST, TAKE, TARE, VALVE

if TYPE_CHECKING:
    from tests.service.running_rig.runs.drawn.scene import Scene

MASTERS: Final = OWNER, OTHER, Peer("10.0.0.7", 4003)
QUIET_LEAVES_OUT: Final = "calibration", "self-test"
"""A master's ladder lasts for minutes."""
BITS: Final = {"calibration": CALIBRATE, "self-test": SELF_TEST}
MOVES: Final = (
    {"do": "step", "to_share": 0.6, "hold_s": 1.0},
    {"do": "ramp", "to_share": 1.0, "over_s": 1.5, "hold_s": 0.5},
    {"do": "reversals", "size_share": 0.3, "times": 2, "over_s": 0.5, "hold_s": 0.2},
    {"do": "ladder", "to_share": 0.9, "stairs": 4, "hold_s": 0.3},
    {"do": "dwell", "hold_s": 1.0},
)


# -- begins


def begin(scene: "Scene") -> None:
    """By a master's bit, or by somebody at this machine."""
    draw, master = scene.draw, scene.draw.choice(MASTERS)
    if scene.rig.relay:
        push(scene, master)
    kind = draw.choice(("self-test", "here", "here", "experiment", *QUIET_LEAVES_OUT * (not scene.is_quiet)))
    if kind not in BITS:
        _begin_here(scene, kind)
    elif draw.random() < 0.25:
        bit = BITS[kind].bit_length() - 1
        scene.ask(Asked(kind, master), f"coil {bit} on", lambda: scene.rig.bank.write_bits(bit, [True], master))
    else:
        bits = BITS[kind] | draw.choice((0, 0, ENABLE)) | draw.choice((0, 0, 0, TAKE, TARE, RESET))
        scene.write(master, 0, bits, 0, 0, 0, scene.next_beat(master), name=f"begins a {kind}, {bits:#x}")


def push(scene: "Scene", master: Peer) -> None:
    """As a run wants its valve."""
    scene.write(master, 0, ENABLE, 0, 0, 0, scene.next_beat(master), name="enables to push")
    scene.rig.run(1.0)


def _begin_here(scene: "Scene", kind: str) -> None:
    draw, rig = scene.draw, scene.rig
    tare, plan = draw.random() < 0.2, dict[str, Any]()
    if kind == "here":
        plan = {
            "step_v": draw.choice((0.7, 1.2)),
            "groups": 1,
            "minor_points": draw.choice((0, 13)),
            "response_steps": 2,
        }
        plan |= draw.choice(({}, {"v_max_v": 4.0}))
    else:
        parts = [{"name": "one", "moves": [draw.choice(MOVES) for _ in range(3)]}]
        plan = {"name": "drawn", "check": draw.random() < 0.5, "parts": parts}
    asked = Asked("calibration" if kind == "here" else kind, has_check=bool(plan.get("check", True)))
    if scene.ask(asked, f"{plan}", lambda: rig.runs.answer({"plan": plan | {"tare": tare}})):
        scene.is_followed = True


# -- ends


def stop(scene: "Scene") -> None:
    """In one of the ways that end a run."""
    draw, rig, run = scene.draw, scene.rig, scene.laws.run
    ways = ("word 0", "word 0", "bit", "coil", "mask", "enable off", "Ctrl-C", "leaves", "hangs", "disk", "end")
    way, master = draw.choice(ways), draw.choice(MASTERS)
    if way == "word 0":
        scene.write(master, 0, 0, name="writes 0")
    elif way == "bit":
        scene.write(master, 0, rig.word("control_word") & ENABLE, name="clears the run's bit")
    elif way == "mask":
        scene.ask(Asked("", master), "masks bits 5, 6", lambda: rig.bank.mask_write(0, 0xFF9F, 0, master))
    elif way in ("coil", "enable off"):
        bit = 0 if way == "enable off" else 6 if run and run.kind == "self-test" else 5
        scene.ask(Asked("", master), f"coil {bit} off", lambda: rig.bank.write_bits(bit, [False], master))
    elif way == "Ctrl-C":
        if scene.ask(Asked(), "Ctrl-C", lambda: rig.runs.answer({"stop": True})) and run:
            scene.laws.stopped(run, scene.judge.state, at_once=False)
    elif way == "leaves":
        scene.is_followed = False
        scene.note("leaves")
    elif way == "hangs":
        scene.beating ^= {master.host}
        scene.judge.is_disturbed = True
        scene.judge.befallen["hangs"] = inf if len(scene.beating) < len(MASTERS) else scene.rig.now()
        scene.note(f"{master.host} {'beats' if master.host in scene.beating else 'hangs'}")
    elif way == "disk":
        _fill_disk(scene)
    else:
        end_process(scene)


def judge_stop(scene: "Scene", run: Run, words: tuple[int, ...]) -> None:
    """What a word that has been taken in a run ends: by the contract, not by what became of it."""
    stopped, state = scene.laws.stopped, scene.judge.state
    if run.is_local:
        if words == (0,):
            stopped(run, state, at_once=True)
    elif run.asked.with_enable and not words[0] & ENABLE:
        stopped(run, state, at_once=True)
    elif not words[0] & BITS[run.kind]:
        stopped(run, state, at_once=False)


def _fill_disk(scene: "Scene") -> None:
    recording = scene.rig.runs._recording
    if recording and recording._file and recording._file.is_open:
        scene.note("the disk is full")
        with open("/dev/full", "wb", buffering=0) as full:  # noqa: PTH123
            os.dup2(full.fileno(), recording._file._descriptor)
        scene.recorded.is_cut = True


def end_process(scene: "Scene") -> None:
    """As `service stop` ends it, and another one is started."""
    rig = scene.rig
    scene.note("the process is ended")
    rig.controller.stop()
    if scene.laws.run:
        rig.run(0.01)
        if run := scene.laws.run:
            scene.laws.stopped(run, scene.judge.state, at_once=False)
    for _ in range(450):
        if rig.controller.has_stopped:
            break
        rig.run(0.01)
    else:
        if scene.judge.is_on:
            scene.judge.complain("a stopped gateway still presses after 4.5 s")
    rig.run(0.02)
    scene.renew(is_restarted=False)


# -- beside


def press(scene: "Scene") -> None:
    """Ask for a force."""
    draw, rig, master = scene.draw, scene.rig, scene.draw.choice(MASTERS)
    bits = ENABLE | draw.choice((0, 0, TAKE)) | (draw.choice((0, VALVE)) if rig.settings.valve else 0)
    force = draw.choice((0, 500, 1500))
    scene.write(master, 0, bits, force, 0, 0, scene.next_beat(master), name=f"presses {force / 100} N, {bits:#x}")


def meddle(scene: "Scene") -> None:
    """What is no business of a run."""
    draw, rig, master = scene.draw, scene.rig, scene.draw.choice(MASTERS)
    word = draw.choice((TARE, TAKE, RESET, TARE, SELF_TEST, CALIBRATE, VALVE if rig.settings.valve else TARE))
    match draw.choice(("word", "word", "force", "block", "payload", "dry run", "coil")):
        case "word":
            written = rig.word("control_word") | word
            scene.write(master, 0, written, name=f"writes {written:#x}")
        case "coil":
            bit = word.bit_length() - 1
            kind = {CALIBRATE: "calibration", SELF_TEST: "self-test"}.get(word, "")
            if scene.ask(Asked(kind, master), f"coil {bit} on", lambda: rig.bank.write_bits(bit, [True], master)):
                scene.judge.taken_by = master.host if word == TAKE else scene.judge.taken_by
        case "force":
            scene.write(master, 1, draw.choice((0, 1200)), name="writes a force")
        case "block":
            block = rig.block(rig.word("control_word"), beat=scene.next_beat(master))
            scene.write(master, 0, *block, name="writes the block as it is")
        case "payload":
            if scene.write(master, 9, draw.choice((0, 300)), name="writes a payload"):
                scene.judge.note_event("payload")  # there is none
        case "dry run":
            state = scene.judge.state
            scene.ask(Asked(), "dry run", lambda: rig.runs.answer({"plan": {"step_v": 1.0}, "dry_run": True}))
            if scene.judge.state is not state:
                scene.judge.complain(f"a dry run leads from {state.name} to {scene.judge.state.name}")


def fit(scene: "Scene") -> None:
    """The fit of the last ladder has ended."""
    if Fits.answer:
        answer, Fits.answer = Fits.answer, None
        answer(scene.draw.choice(({"stored": 3, "report": "r.html"}, {"refused": "A331 no"})))
        scene.note("the fit answers")


def reset(scene: "Scene") -> bool:
    """As a person does who has looked."""
    master = scene.draw.choice(MASTERS)
    was = scene.judge.state
    return scene.write(master, 0, RESET, 0, 0, 0, scene.next_beat(master), name="resets") and was is State.FAULT
