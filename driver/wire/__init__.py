"""Pure codecs and tables of CANopen (CiA 301) and the drive profile (CiA 402): no I/O, no clock, no state.

frame, cob         a classic CAN frame, its worst-case length on the wire, and the identifiers of the connection set
nmt, sync, emcy    network management and heartbeat, SYNC, emergencies
sdo, pdo           service and process data
cia402             the power state machine: statusword, controlword, transitions
dictionary         the object dictionary out of an EDS

Decoders take whatever the wire brings and never raise: None means "not of this kind, or malformed". Encoders raise
ValueError at once when their caller errs.
"""
