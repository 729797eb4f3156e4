"""Servo drives on a CAN bus after CiA 301 and CiA 402, real or emulated.

The room imports python-can; it knows no leg, no plant, no MuJoCo. This package itself imports
nothing: import from the modules.

| folder | holds |
|---|---|
| `protocol` | frames, SDO, PDO, NMT, emergencies, the power state machine; pure |
| `setup` | bus file, schedule, EDS, what is written into a drive, checks of all of it; pure |
| `transport` | interfaces, channel locks, real time, time bases |
| `master` | the cyclic link, bring-up, watches, the stop; imports nothing of `emulated` |
| `emulated` | drives, their network, the lock-step bus, servers for other processes |

A program that leads drives:

    config = load_bus(path)                                       # setup.bus_file
    bus = open_bus(config, adapter_of(config))                    # transport.open_bus
    with Link(bus, config, limits, stiffness=(k1, k2)) as link:   # master.link
        sample = link.start()                  # identity, configuration, settle, enable
        sample = link.move_to(posture)         # guarded, before the first cycle of a run
        applied = link.command(motor_pos)      # [rad], clamped and slewed
        sample = link.exchange()               # next tick; PlantFault after a stop

Leaving the `with` stops all drives, looks whether their power is gone, parks them and releases the
channel; a drive that keeps its power ends it by a StopError.

The emulated leg in virtual time:

    network = emulate(config, [Behaviour(...), ...], body=body, faults=faults)   # emulated.build
    bus = LockstepBus(channel, network=network)                                  # emulated.bus

`body(motor_positions) -> (link_positions, spring_torques)` moves one period [rad, N m]. A motor
position commanded after sample k is reached between the SYNCs k + 1 and k + 2 and shown by sample
k + 2: one constant cycle of delay.
"""
