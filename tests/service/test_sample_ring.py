"""The memory that control shares with the processes beside it: where there is none, that is said, and nothing else changes."""

import os
import resource

import pytest

from gateway.service.control_process import sample_ring


@pytest.mark.parametrize("is_limited", [True, False])
def test_a_limit_on_files_that_takes_the_watch_its_memory_is_said(is_limited: bool) -> None:
    """The watch was away without a word."""
    said: list[str] = []
    memory = os.memfd_create("ring")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096 if is_limited else before[0], before[1]))
    try:
        ring = sample_ring(memory, lambda _, sentence: said.append(sentence))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    if is_limited:
        assert ring is None
        assert said[0].startswith("A353 no memory for the newest samples: File too large; a limit on files (ulimit -f)")
    else:
        assert ring is not None and not said
        ring.close()
    os.close(memory)


def test_a_kernel_without_such_memory_is_said() -> None:
    said: list[str] = []
    assert sample_ring(None, lambda _, sentence: said.append(sentence)) is None
    assert [sentence[:4] for sentence in said] == ["A353"]
