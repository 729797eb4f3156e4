"""Bringing drives into service: who is there, what they hold, small guarded motions, timing.

Each module does one thing on a `Session` and returns a frozen value; the command line prints it.
"""
