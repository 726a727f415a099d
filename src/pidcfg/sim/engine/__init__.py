"""What runs a scenario: kernels, plants, events, and who steps them."""
