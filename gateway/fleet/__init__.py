"""Fit and diagnosis over many recordings of many cells."""
