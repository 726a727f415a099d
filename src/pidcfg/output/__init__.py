"""What the public calls of `pidcfg` return: frozen results, each with the JSON that the command of its name prints."""
