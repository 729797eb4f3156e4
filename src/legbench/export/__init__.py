"""Recordings as files of other programs, whole and exact: CSV, Parquet, MAT and MCAP.

`formats.export` writes any of them. Each goes through a run in windows, so that an hour needs no
more memory than a minute, and each carries the units of its columns and the names of the phases.
"""
