"""What a shell is told about a word that is being typed."""
