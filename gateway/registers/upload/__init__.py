"""The coefficient upload: the staging block, the model as words, and whether a staged set may be used."""
