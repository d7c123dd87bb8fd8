"""Whether the parts of a rig fit together: one file per part that is looked at."""
