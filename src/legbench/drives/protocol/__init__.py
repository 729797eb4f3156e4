"""CiA 301 and CiA 402 as pure functions: frames, SDO, PDO, NMT, emergencies, power states."""
