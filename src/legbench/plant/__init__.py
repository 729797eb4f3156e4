"""Legs to control: one seam, one class a file."""
