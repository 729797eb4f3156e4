"""Interfaces, channel locks, real time and the time bases of a bus."""
