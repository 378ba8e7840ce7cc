"""Telemetry and telecommands of a robot as CCSDS space packets with headers of ECSS PUS-C.

`structures` says which signals are in which packet, `downlink` writes the packets, `database`
describes them as XTCE for ground software, and `telecommands` reads what the ground sends.
"""
