"""Drives that behave as real ones do, and the wire between them, in virtual time; no I/O.

Not modelled: a motor without power stays where it is (its gear locks itself), the load of the
spring does not move a motor, current and heat; max torque, torque and velocity offsets and homing
acceleration are kept without an effect. SDO block transfer, node guarding, LSS, TIME and
multiplexed PDOs are not there; profile, velocity and torque modes neither.
"""
