"""Names: what the symbols of ISPSoft make of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.dpide.symbols import D256, identifier, unusable
from pidcfg.validate.ideas.duplicates import in_words, sharing
from pidcfg.validate.rule import Findings, info, per_loop

if TYPE_CHECKING:
    from pidcfg.validate.rules.dpide.context import DpideContext, LoopView


@per_loop
@info("DP771", D256, "no symbols for ISPSoft can be made of the name: {reason}")
def name_without_symbols(view: LoopView) -> Findings:
    """The name of a loop gives no symbols.

    Why: a symbol has at most 34 letters, digits and underscores and does not begin with a digit.
    `pidcfg encode --format symbols` refuses the file; every other format works.

    Fix: rename the loop with at most 28 characters, beginning with a letter, if the symbol table is wanted.
    """
    reason = unusable(view.name)
    if reason is not None:
        yield view.at("name", reason=reason)


@info("DP772", D256, "its symbols would be those of {others}, such as {symbol}")
def symbols_collide(context: DpideContext) -> Findings:
    """Two loops have the same symbols.

    Why: blanks and signs become underscores, and ISPSoft does not tell capital from small letters; `A-1` and `a_1` are
    one. `pidcfg encode --format symbols` refuses the file.

    Fix: rename one of them, if the symbol table is wanted.
    """
    usable = [view for view in context.loops if unusable(view.name) is None]
    for _, view, names in sharing((identifier(view.name, "SV").casefold(), view) for view in usable):
        others = [name for name in names if name != view.name]
        if others:
            finding = view.at("name", others=in_words(others), symbol=identifier(view.name, "SV"))
            yield finding.shared_with(*others)
