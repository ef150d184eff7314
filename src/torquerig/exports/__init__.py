"""Files that other people's programs read: a DBC of the drives' frames, a pcap of a record's bus log."""
