"""Codecs of devices whose sentences are templates, in text or as Modbus RTU frames: each role, both ends of its wire."""
