"""What a loop-step takes in CPython, in µs by vendor; `pidcfg.sim.engine.choose` decides by it.

Measured with the shipped examples and written by ``python tasks.py bench --write-costs``.
"""

LOOP_STEPS = {
    "dl06": 7,
    "click": 7,
    "ezlogix": 8,
    "nextopid": 35,
    "dpide": 14,
    "generic": 6,
}
