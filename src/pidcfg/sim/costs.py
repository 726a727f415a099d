"""What a loop-step takes in CPython, in µs by vendor; `pidcfg.sim.engine.choose` decides by it.

Measured with the shipped examples and written by ``python tasks.py bench --write-costs``.
"""

LOOP_STEPS = {
    "dl06": 7,
    "click": 8,
    "ezlogix": 6,
    "nextopid": 24,
    "dpide": 7,
    "generic": 3,
}
