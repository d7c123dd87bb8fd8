"""Clients for robots and PLCs from the register map, and the wiring page of a rig. Pure text: nothing is opened or sent."""

from gateway.clients.endpoint import Endpoint
from gateway.clients.exchange import ExchangeTable, MissingRegisterError
from gateway.clients.rendering import LANGUAGES, UnspeakableNameError, endpoint_of, render_client

__all__ = [
    "LANGUAGES",
    "Endpoint",
    "ExchangeTable",
    "MissingRegisterError",
    "UnspeakableNameError",
    "endpoint_of",
    "render_client",
]
