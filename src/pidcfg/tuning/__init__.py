"""Gains by rule: from a process or its ultimate cycle to P, I and D, and to what a vendor's registers can hold."""
