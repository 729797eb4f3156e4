"""Bus file, budget, EDS and what is written into drives, checked before it is used; pure."""
