"""Benchmarks against other methods and codes; the results are the committed tables in this folder."""
