"""A PLC that runs, over Modbus: read, compared with its file, recorded; and the virtual PLC for others to read."""
