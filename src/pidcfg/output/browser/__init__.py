"""Pages that carry pidcfg with them: the engine in a browser, without a server."""
