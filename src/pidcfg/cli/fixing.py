"""placeholder"""
def fixing(inputs, limits, rules, ctx):
    return inputs
