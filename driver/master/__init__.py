"""The master of the drives.

pump, exchange, watch          one hold on the bus: what is due, the cycle, and what else is heard
sdo_client, sdo_jobs, objects  the drives' objects, several drives at once, typed by their EDS
profile, scale                 what a make of drives is like; counts to rad and N·m
configuration, faults, homing  what a drive must hold, tell and know before it runs
axis, session, group           one drive, a master's time with its drives, and all axes as one
scan, stop                     for a person at the machine
"""
