"""Where the project lives: the one table of its addresses.

Nobody has given one yet, so each is empty, and what would link to it does without. Fill in those that there are and run
``python tasks.py generate``; docs/release.md tells what each of them turns on.
"""

REPOSITORY = ""
"""The page of the repository, such as ``https://example.org/plant/pidcfg``."""
SITE = ""
"""The documentation site, with a slash at its end, such as ``https://example.org/pidcfg/`` (D970)."""
INDEX = ""
"""The project's page on the package index."""
IMAGE = ""
"""The image in a container registry, such as ``registry.example.org/plant/pidcfg``."""
ACTION = ""
"""What a workflow uses the action as, such as ``plant/pidcfg``; the marketplace lists it under the same name."""
