"""One folder per section of the help, one file per verb; imported when that verb is called."""
