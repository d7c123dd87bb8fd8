"""The running gateway's recordings: begun and ended on command, kept going, and pruned."""
