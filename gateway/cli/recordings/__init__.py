"""What the verb `recordings` tells, and what it does to the files."""
