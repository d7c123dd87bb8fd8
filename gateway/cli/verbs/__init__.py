"""One file per verb; imported when that verb is called."""
