"""What a register, a bit, a number or a code means, in plain words, from the tables that everything else uses."""
