"""Setting up a cell: the rig file that `init` writes, what serial ports answer, what a profile says, certificates."""
