"""Care for the recordings of a state directory: what happened in each, which are kept, which go when there are too many."""
