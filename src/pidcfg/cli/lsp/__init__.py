"""The language server: findings, words and names of a file while it is written."""

RUN_COMMAND, WORDS_COMMAND = "pidcfg.run", "pidcfg.words"
"""The commands that stand above a scenario and above a loop."""
