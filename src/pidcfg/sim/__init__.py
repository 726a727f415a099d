"""The virtual PLC and the plants: encoded words and a scenario in, a trend, metrics and verdicts out."""
