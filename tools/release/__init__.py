"""What makes a release: its files, what stands in them, and whether they agree."""
