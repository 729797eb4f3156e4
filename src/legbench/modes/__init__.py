"""Modes and maps of an elastic leg: which motions are its own, and how hops return."""
