"""From one vendor's configuration to another's, through the neutral loop; what is lost on the way is reported."""
