"""Figures for a plant's systems: Prometheus, MQTT, OPC UA, each in a process of its own."""
