"""What goes to an MQTT broker, and what comes from it: the connection, JSON topics, a Sparkplug B edge node, commands."""
