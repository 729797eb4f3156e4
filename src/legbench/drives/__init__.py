"""Servo drives on a CAN bus: CiA 301/402 codec, cyclic link, emulated drives and wire.

The only room that imports python-can; it knows no leg, no plant, no MuJoCo. Import from the
modules; this package itself imports nothing.

What a program needs:

    config = bus_file.load_bus(path)                  # BusConfig; load_limits(path): SafetyLimits
    adapter = open_bus.adapter_of(config, interface=, channel=)          # python-can's conventions
    bus = open_bus.open_bus(config, adapter)                             # any can.BusABC
    with link.Link(bus, config, limits, stiffness=(k1, k2), read_only=, listener=) as it:
        sample = it.start(clear_faults=)    # lock, identity, configuration, settle, enable: Sample
        sample = it.move_to(posture, speed)             # guarded, before the first real cycle
        applied = it.command(motor_pos)                 # [rad], slewed and clamped
        sample = it.exchange()                          # next tick; PlantFault after a stop
    # close(): quick stop of all drives, a look whether they have no power, pre-operational, lock
    # released; a drive that keeps its power then ends the `with` by a StopError

`link.Sample`: time_ns, late_ns, skipped, motor_pos, link_pos, spring_torque, applied_pos,
statusword, fresh, temperature. `link.Link`: state (`LinkState`), fault, skipped_total,
stopped (`master.stop_report.StopReport`), open(), stop(), close(); `cycle` (axes, watches,
error_frames, late_frames), `bring_up`.

The emulated leg, in virtual time:

    network = emulated.build.emulate(config, [Behaviour(...), ...], body=, faults=, keep_log=)
    bus = bus.LockstepBus(channel, network=network)    # or can.Bus(interface="legbench", channel=)

`body(motor_positions) -> (link positions, spring torques)` moves one period [rad, N m];
`emulated.behaviour.Behaviour(start_pos=, ...)` says how faithful a drive is, `Behaviour.ideal()`
has no latency; `emulated.faults` (`FrameFault`, `NodeFault`, `Babble`) strike in windows of
virtual time, given to `emulate` or `network.inject`; `network.now_ns`, `advance(until_ns)`, `log`.
A motor position commanded after sample k is reached between the SYNCs k + 1 and k + 2 and shown
by sample k + 2: one constant cycle of delay. Order of events, all on the bus's own grid: the
body's step of a period ends, then SYNC samples it, then the targets of the last RPDOs are latched.

For commissioning:

    port = master.port.Port(bus, open_bus.timebase_of(bus), listener)
    sdo = master.sdo_port.SdoPort(port, node_id, timeout_ms=, retries=)   # read write get put
    up = master.bring_up.BringUp(port, config, on_other)   # identify identity differences configure
    cia402: describe_statusword, decode_state, next_controlword, PowerMachine
    objects: OBJECTS, name_of;  configuration.configuration(bus, node): what is written, in order
    wire: schedule, bus_load, check_load (80 %);  master.bus_log.BusLog: candump lines
    master.lock.ChannelLock.of_channel(interface, channel): taken before the interface is opened
    up.contact(): around a first question, so that a wrong bitrate is named
    interface.check_interface(config, channel): a SocketCAN interface is up, at the right bitrate
    limits.SafetyLimits.require_complete(), stopping.check_stopping: before real drives are led
    timebase: SystemTime (absolute sleeps), NetworkTime
    eds.eds_text(), eds.dcf_text(config, node);  units.AxisUnits: counts <-> rad

Modules: `codec/` (pure: frame, datatypes, nmt, emcy, pdo, sdo, sdo_client, sdo_server, slcan),
`cia402` (pure), `config`, `bus_file`, `configuration`, `objects`, `units`, `limits`, `wire`,
`emulated/` (pure), `bus` and `unix_bus` (python-can plugins), `slcan_bus` (python-can's, with a
`recv` of its own), `unix_server`, `slcan_server` and `bus_server` (the emulated leg for other
processes), `interface`, `master/` and `link` (I/O).
"""
