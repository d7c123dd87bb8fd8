"""Drawn scenes of everything that may be asked of a running gateway, on all its faces at once."""

from pathlib import Path

import pytest

from tests.service.requests.drawn.scene import Scene, told

COUNT = 12


def test_each_request_has_its_answer_and_what_is_refused_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, budget: int
) -> None:
    for seed in range(COUNT * budget):
        with monkeypatch.context() as patch:
            (state := tmp_path / str(seed)).mkdir()
            scene = Scene(seed, state, patch)
            assert scene.play() == [], told(scene)
            assert scene.executed > 20
