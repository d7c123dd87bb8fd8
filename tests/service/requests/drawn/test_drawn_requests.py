"""Drawn scenes of everything that may be asked of a running gateway, on all its faces at once.

Each scene is played twice: what nothing may come of (reads, what is refused) is left out of the second play, and is not missed.
"""

from pathlib import Path

import pytest

from tests.service.requests.drawn.scene import Scene, told

COUNT = 8


@pytest.mark.sampled
@pytest.mark.parametrize("first", range(COUNT))
def test_each_request_has_its_answer_and_what_is_refused_changes_nothing(
    first: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, budget: int
) -> None:
    for seed in (first, *range(1000 * (first + 1), 1000 * (first + 1) + budget - 1)):
        played: Scene | None = None
        for state in (tmp_path / f"{seed}", tmp_path / f"{seed} again"):
            state.mkdir()
            with monkeypatch.context() as patch:
                scene = Scene(seed, state, patch, played)
                assert scene.play() == [], told(scene)
                assert len(scene.judge.executed) > 20
                played = scene
