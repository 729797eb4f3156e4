"""CiA 301 on the wire, pure: bytes in, words out, and back; no clock, no I/O."""
