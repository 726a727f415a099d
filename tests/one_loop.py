"""One DL06 loop, as the tests of messages spoil it."""

PLANT = """\
pidcfg: 1
vendor: dl06
plc: {loop_table: V2000, reset_decimals: 1}
loops:
  - name: A
    sample_rate: 2
    action: direct
    tuning: {gain: 2.5, reset: 100}
    pv: {range: [0, 400], unit: degC}
    setpoint: {value: 85}
"""
