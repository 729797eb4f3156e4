"""The master of a bus: link, bring-up, cycle, watches and stop; it knows no emulated drive."""
