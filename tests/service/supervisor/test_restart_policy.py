"""How often control is started again, and how long each start waits: ends count for a minute, failed starts until READY."""

from gateway.processes.exit_cause import EndCause
from gateway.service.supervisor.restart_policy import MOST_RESTARTS, WINDOW_S, RestartPolicy


def test_ends_of_long_ago_are_forgotten() -> None:
    """A gateway that is left alone may lose control five times in each minute, and must not stay off for it."""
    policy = RestartPolicy()
    for k in range(500):
        policy.came_up()
        assert policy.count(k * WINDOW_S / MOST_RESTARTS, EndCause.DIED) == 0.0
    assert policy.causes == {EndCause.DIED: MOST_RESTARTS}
    assert policy.count(499.5 * WINDOW_S / MOST_RESTARTS, EndCause.DIED) is None


def test_what_never_becomes_ready_is_given_time() -> None:
    policy, now_s, pauses_s = RestartPolicy(), 0.0, []
    for _ in range(9):
        now_s += WINDOW_S / (MOST_RESTARTS - 1)
        pauses_s.append(policy.count(now_s, EndCause.NOT_STARTED))
    assert pauses_s == [0.0, 0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 4.0, 4.0]
    policy.came_up()
    assert [policy.count(now_s + WINDOW_S, EndCause.DIED) for _ in range(3)] == [0.0, 0.0, 0.25]
