"""Shell completion of the word that is being typed."""
