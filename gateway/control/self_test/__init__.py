"""The self-test that a robot asks for: cell, force, response and both serial lines, within a stated force and 20 s."""
