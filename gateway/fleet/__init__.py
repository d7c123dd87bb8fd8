"""Fit and diagnosis over many recordings of many cells: one row each, whoever computed it, and which cells drift.

`tasks` finds the recordings, `engines` has a function run over them (here, in processes, on a Dask cluster), `kept_rows` keeps
what is finished, `drift` judges a cell's days, `page` is the report. What is computed of one recording comes in as a function.
"""
