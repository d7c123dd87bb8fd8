"""What the tests of the clients share: the texts, a model, and what a gateway has seen."""

from typing import Any

from gateway.clients import Endpoint, render_client
from gateway.profiles import load_register_map
from tests.clients.gateway_at_hand import GatewayAtHand

MAP = load_register_map("force-v1")
WHERE = Endpoint("192.168.125.20", 502, 1)
LANGUAGES = ("rapid", "scl", "st", "urscript", "python", "c")
TEXTS = {language: render_client(MAP, language, WHERE) for language in LANGUAGES}
TEXTS |= dict.fromkeys(("twincat", "codesys"), TEXTS["st"])  # its two transports
MODEL: dict[str, Any] = {
    "order": 2,
    "range_low": 0.0,
    "range_high": 8.0,
    "rising_b": [0.0, 20.25, 60.1],
    "rising_w": [1.0, 0.53, 1.0],
    "falling_b": [0.5, 30.7, 60.3],
    "falling_w": [1.0, 0.5, 1.0],
    "force_low": 0.75,
    "force_high": 59.9,
    "blend_span": 3.3,
}


def commands(gateway: GatewayAtHand) -> list[tuple[int, ...]]:
    """What was commanded, the heartbeat left out; equal neighbours once."""
    found: list[tuple[int, ...]] = []
    for words in gateway.words:
        plain = (*words[:4], *words[5:])
        if not found or found[-1] != plain:
            found.append(plain)
    return found


def command(control: int, counts: int) -> tuple[int, ...]:
    return (control, counts, *([0] * 10))


def cycles(client: Any, count: int = 5) -> None:
    for _ in range(count):
        client.cycle()
