"""The wiring page of a rig: serial lines with their pins and switches, the network, and what to set in each robot or PLC."""

from gateway.clients.wiring.page import wiring_page
from gateway.clients.wiring.section import TEXT_WIDTH, Section, render_page

__all__ = ["TEXT_WIDTH", "Section", "render_page", "wiring_page"]
