"""Many runs as one table: found in a folder, filtered and sorted by any figure or setting.

What is measured of a run is kept in an index that notices by itself which runs have changed.
Importing this package costs nothing; runs are loaded when the index does not know them yet.
"""
