"""Recordings of any form as columns: CSV, Parquet and our own, checked and on even rows."""
