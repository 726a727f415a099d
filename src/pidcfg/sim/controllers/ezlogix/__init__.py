"""The virtual EZLogix PLC."""
