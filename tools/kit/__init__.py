"""The kit for computers without a network: how it is made, tried and started."""
