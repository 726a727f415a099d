"""Names of tags that the template makes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.ezlogix.tags import TAG
from pidcfg.encoders.maps.ezlogix import VARIABLES
from pidcfg.refs import Decision
from pidcfg.schemas.ezlogix import tag_name
from pidcfg.validate.rule import Findings, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.ezlogix.context import EzlogixContext

D182 = Decision(
    182,
    "what can be a tag",
    "A letter, then letters, digits and underscores; capital and small letters are one. Names that break this, or that "
    "two loops would share, are a warning: the tag list cannot be written, the loop itself works.",
    "The manual says what a tag's name tells, and not of which characters it may be.",
)


@warning("EZ411", D182, "{tag!r} is not usable as a tag: letters, digits and _ only, a letter first")
def name_not_usable_in_tags(context: EzlogixContext) -> Findings:
    """The name of a loop cannot stand in the names of its tags.

    Why: the template in `plc.tag_names` puts the loop's name into every tag. Names such as FIC-101 or `Oven 1` are
    common on drawings, but the tag list cannot be written with them.

    Fix: write the name with letters, digits and underscores, or use {loop} in place of {name} in the template.
    """
    variable = next(iter(VARIABLES.values()))
    for view in context.loops:
        tag = tag_name(context.config.plc.tag_names, view.index + 1, view.name, variable)
        if not TAG.fullmatch(tag):
            yield view.at("name", tag=tag)


@warning("EZ412", D182, "the tag {tag} of this loop is also one of loop {other}")
def tags_collide(context: EzlogixContext) -> Findings:
    """The template makes the same tag for two loops.

    Why: one name cannot stand for two registers, so the tag list cannot be written. Capital and small letters are not
    told apart: `Oven` and `OVEN` have all tags in common.

    Fix: rename one of the loops, or use {loop} in the template.
    """
    template = context.config.plc.tag_names
    owners: dict[str, dict[str, str]] = {}
    for view in context.loops:
        for variable in VARIABLES.values():
            tag = tag_name(template, view.index + 1, view.name, variable)
            owners.setdefault(tag.casefold(), {}).setdefault(view.name, tag)
    for view in context.loops:
        groups = [group for group in owners.values() if view.name in group]
        pairs = {other: group[view.name] for group in reversed(groups) for other in group if other != view.name}
        for other, tag in pairs.items():
            yield view.at("name", tag=tag, other=other).shared_with(other)
