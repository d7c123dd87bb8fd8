"""The residual watch: a process that compares the newest minutes of a run with the rig's model and names a change."""
