"""From one vendor's configuration to another's, through the neutral loop; what is lost is told."""
