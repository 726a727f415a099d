"""The vendors' virtual controllers."""
