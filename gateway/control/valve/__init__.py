"""Push and pull: the directional valve that gives the regulator's pressure to one chamber or to the other."""
