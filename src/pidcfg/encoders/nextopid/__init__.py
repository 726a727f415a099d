"""NextoPID: function blocks and their wires as named parameters, Structured Text and PLCopen XML."""
