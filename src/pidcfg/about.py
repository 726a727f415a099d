"""What the project says of itself: its version, and where it lives, the one table of its addresses.

Nobody has given an address yet, so each is empty, and what would link to it does without. Fill in those that there are
and run ``python tasks.py generate``; docs/release.md tells what each of them turns on.
"""

VERSION = "0.2.0"

REPOSITORY = ""  # its page: https://example.org/plant/pidcfg
SITE = ""  # the documentation, with a slash at its end: https://example.org/pidcfg/ (D970)
INDEX = ""  # the project's page on the package index
IMAGE = ""  # in a container registry: registry.example.org/plant/pidcfg
ACTION = ""  # as a workflow uses it, and the marketplace lists it: plant/pidcfg
