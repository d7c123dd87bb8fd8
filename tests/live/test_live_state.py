"""The state as the socket carries it: what control made is what processes beside it read, part by part."""

import json
from dataclasses import fields

import pytest

from gateway.live import live_state
from gateway.live.live_state import LiveAlarm, LivePeer, LiveResidual, LiveRun, LiveState, LiveWriter


def test_a_state_is_the_same_behind_the_socket() -> None:
    alarm = LiveAlarm(code="A311", title="stale", cure="look", since_unix_s=1.0)
    state = LiveState(
        rig="demo",
        simulated=True,
        version="1",
        time_unix_s=2.0,
        state="holding",
        status=("ready", "in_band"),
        faults=(alarm,),
        warnings=(alarm, alarm),
        peers=(LivePeer(identity="10.0.0.7", address="10.0.0.7:1", role="setpoint"),),
        residual=LiveResidual(cause=3, effect="leak"),
        run=LiveRun(running=True, share=0.5),
        writers={"force_setpoint": LiveWriter(peer="10.0.0.7", age_s=0.1)},
    )
    heard = LiveState.from_json(json.loads(json.dumps({"ok": True, **state.to_json()})))
    assert heard == state


def test_every_part_of_a_state_is_read_as_what_it_is() -> None:
    """A part that is forgotten stays a dict, and whoever asks it for a name fails."""
    state = LiveState(rig="demo", simulated=False, version="1", time_unix_s=0.0, state="off")
    heard = LiveState.from_json(json.loads(json.dumps(state.to_json())))
    for field in fields(LiveState):
        assert type(getattr(heard, field.name)) is type(getattr(state, field.name)), field.name
    with pytest.raises(TypeError):
        LiveState.from_json({"rig": "demo"})
    assert len(live_state._PARTS) == sum(isinstance(part, dict) for part in state.to_json().values()) - 1


def test_a_gateway_that_still_runs_behind_an_update_is_understood() -> None:
    """Older than who asks, it lacks a part; newer, it tells of parts and fields that nobody here knows."""
    residual = LiveResidual(cause=3, effect="leak")
    state = LiveState(rig="demo", simulated=False, version="1", time_unix_s=0.0, state="off", residual=residual)
    older, newer = state.to_json(), state.to_json()
    del older["valve"], older["writers"], older["residual"]["why_skipped"]
    assert LiveState.from_json(older) == state
    newer["temperature"] = {"celsius": 21.0}
    newer["residual"]["p_value"] = 0.5
    newer["faults"] = [{"code": "A311", "title": "stale", "cure": "look", "since_unix_s": 1.0, "how_often": 2}]
    newer["writers"] = {"payload": {"peer": "10.0.0.7", "age_s": 0.1, "role": "admin"}}
    heard = LiveState.from_json(newer)
    assert heard.residual == residual
    assert [alarm.code for alarm in heard.faults] == ["A311"]
    assert heard.writers["payload"].peer == "10.0.0.7"
