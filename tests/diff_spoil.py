"""Every settable key of random files changed by itself: whether `pidcfg.diff` shows it, and nothing that is the same.

``python tests/diff_spoil.py [FILES] [VENDOR…]`` prints, for each vendor, how many changes there were, how many went
unseen between two files, a file and a listing (also one of which something else is refused), and two listings, and how
often a file differed from its own words.
"""

from __future__ import annotations

import random
import sys
from collections import Counter
from copy import deepcopy
from dataclasses import dataclass, field
from itertools import pairwise

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

import click_strategies
import dl06_strategies
import dpide_strategies
import ezlogix_strategies
import neutral_strategies
import nextopid_strategies
import pidcfg
from pidcfg.encoders.contract import encoder_of
from pidcfg.encoders.decoding import read_listing
from pidcfg.encoders.listing import UnwritableError
from pidcfg.text.paths import dotted_text, has_key, value_at
from pidcfg.text.reader import DEFAULT
from pidcfg.text.writer import yaml_text
from pidcfg.vendors import VENDORS

STRATEGIES = {
    "dl06": dl06_strategies.configurations(),
    "click": click_strategies.configurations(),
    "ezlogix": ezlogix_strategies.configurations(),
    "dpide": dpide_strategies.configurations(),
    "nextopid": nextopid_strategies.configurations(),
    "generic": neutral_strategies.neutral_files(),
}


@dataclass
class Score:
    """What became of the changes of one vendor."""

    changes: int = 0
    keys: set = field(default_factory=set)
    unseen: Counter = field(default_factory=Counter)
    """By comparison and key."""
    apart: Counter = field(default_factory=Counter)
    """Changes that are told as live, operated or missing."""
    more: Counter = field(default_factory=Counter)
    """Other keys that a change brings with it."""
    untrue: Counter = field(default_factory=Counter)
    """Rows of which nothing differs, and files that differ from their own words."""
    compared: Counter = field(default_factory=Counter)
    same: Counter = field(default_factory=Counter)
    """Changes that the PLC holds the same words for."""


def plain(vendor, config):
    """A configuration as the data of its file."""
    image = encoder_of(vendor).encode(config).image
    return vendor.load("decode")(image.words, image.settings, image.plc).data


def paths(data, above=()):
    """Every leaf of plain data; a pair is a leaf."""
    items = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in items:
        here = (*above, key)
        if isinstance(value, dict) or (isinstance(value, list) and value and isinstance(value[0], dict)):
            yield from paths(value, here)
        else:
            yield here


def changed(data, other, path):
    """The data with one key as the other data have it, or without it; None: they do not differ there."""
    if value_at(data, path) == value_at(other, path):
        return None
    spoilt = deepcopy(data)
    above = spoilt
    for step, below in pairwise(path):
        if isinstance(above, dict) and step not in above:
            above[step] = [] if isinstance(below, int) else {}
        elif isinstance(above, list) and step >= len(above):
            return None
        above = above[step]
    if isinstance(above, list):
        return None
    if has_key(other, path):
        above[path[-1]] = deepcopy(value_at(other, path))
    else:
        del above[path[-1]]
    return spoilt


def listings(checked):
    """The encodings of a configuration that can be read back, by their names."""
    for name in checked.vendor.load("format_names"):
        try:
            result = pidcfg.encode(checked.document, name, allow_errors=True)
        except (ValueError, UnwritableError):
            continue
        if len(result.files) == 1 and name not in {"symbols", "modbus-map"}:
            yield name, result.text.encode(result.kind.encoding)


def spoil(score, vendor, configs, rng, changes):
    """One file against a copy in which one key is another's."""
    one, two = (plain(vendor, config) for config in configs)
    every = sorted({*paths(one), *paths(two)}, key=str)
    rng.shuffle(every)
    before = pidcfg.check_text(yaml_text(one))
    own(score, before)
    for path in every[:changes]:
        other = changed(one, two, path)
        if other is None:
            continue
        after = pidcfg.check_text(yaml_text(other))
        result = pidcfg.diff(before.document, after.document)
        if not result.ok:
            continue
        images = [(c.encoding.image.words, c.encoding.image.settings, c.encoding.image.plc) for c in (before, after)]
        if images[0] == images[1]:
            score.same[named(path)] += 1
        else:
            judge(score, path, before, after, result, rng)


def own(score, checked):
    """A file against its own words in every format: nothing differs, nothing is left out."""
    for name, listing in listings(checked):
        result = pidcfg.diff(checked.document, listing, names=(None, f"x.{name}"))
        score.compared[f"own {name}"] += 1
        told = [r for r in result.loops if not r.same or r.operated or (r.left_out and is_whole(checked, name))]
        if not result.ok or told:
            score.untrue[
                f"own {name}: {[(d.key, d.before, d.after) for r in told for d in r.differences] or told}"
            ] += 1


def written_in_part(score, before, after, name, olds, news):
    """What `encode` writes with ``changed_from``, over the old listing, is the new one."""
    kind = before.vendor.load("formats")[name]
    if not kind.may_be_partial:
        return
    score.compared[f"own part {name}"] += 1
    part = pidcfg.encode(after.document, name, changed_from=olds[name], live=True, allow_errors=True)
    texts = (olds[name], next(iter(part.files.values()), "").encode(kind.encoding), news[name])
    old, changed, new = ({} if not text else read_listing(text, before.vendor, DEFAULT, name).words for text in texts)
    if {**{key: raw for key, raw in old.items() if key in new}, **changed} != new:
        score.untrue[f"part {name}: {differing_keys(before, after)}"] += 1


def differing_keys(before, after):
    """The keys that two files differ in."""
    return [d.key for loop in pidcfg.diff(before.document, after.document).loops for d in loop.differences]


def is_whole(checked, name):
    """Whether a format holds every word, also those that the PLC writes."""
    return checked.vendor.load("formats")[name].is_complete


def judge(score, path, before, after, result, rng):
    """One change between files, between a file and a listing both ways, and between listings."""
    key = named(path)
    score.changes += 1
    score.keys.add(".".join(str(s) for s in path if not isinstance(s, int)))
    see(score, "file/file", key, result)
    for d in (d for loop in result.loops for d in loop.differences):
        if d.before == d.after and d.word_before == d.word_after:
            score.untrue[f"{key}: {d.key}"] += 1
        elif not overlap(d.key, key):
            score.more[f"{key} → {d.key}"] += 1
    olds, news = dict(listings(before)), dict(listings(after))
    name = rng.choice(sorted(olds.keys() & news.keys()))
    both = (f"a.{name}", f"b.{name}")
    written_in_part(score, before, after, name, olds, news)
    is_beside = not any(overlap(d.key, key) and d.address for loop in result.loops for d in loop.differences)
    if is_beside and b'"loop": ' not in news[name]:
        score.apart[f"{name}: {key} has no place in this format"] += 1
        return
    see(score, f"file/{name}", key, pidcfg.diff(before.document, news[name], names=(None, both[1])))
    see(score, f"{name}/file", key, pidcfg.diff(olds[name], after.document, names=(both[0], None)))
    see(score, f"{name}/{name}", key, pidcfg.diff(olds[name], news[name], names=both, like=before.document))
    refused = beside_refused(news[name])
    if refused != news[name]:
        result = pidcfg.diff(before.document, refused, names=(None, both[1]))
        see(score, f"file/{name} of which more is refused", key, result)
        if not any(
            d.key == NOTHING and d.note.startswith("no value") for loop in result.loops for d in loop.differences
        ):
            score.unseen[f"file/{name}: {NOTHING}, which is refused"] += 1


def beside_refused(text):
    """A listing in which also a setting of the first loop is refused, where it has settings in a line."""
    for encoding in ("utf-8", "utf-16"):
        line = '# loop: {"'.encode(encoding).removeprefix(b"\xff\xfe")
        spoilt = f'# loop: {{"{NOTHING}": 1, "'.encode(encoding).removeprefix(b"\xff\xfe")
        if line in text:
            return text.replace(line, spoilt, 1)
    return text


def named(path):
    """A path below its loop as differences name it."""
    return dotted_text(path[2:]) if path[0] in {"loops", "blocks"} else dotted_text(path[path[0] == "signals" :])


def overlap(key, other):
    """Whether two keys are one, or one is a part of the other."""
    return key == other or key.startswith(f"{other}.") or other.startswith(f"{key}.")


def see(score, comparison, key, result):
    """Counts whether a comparison shows a key."""
    score.compared[comparison] += 1
    if not result.ok:
        score.unseen[f"{comparison}: {key}: {result.findings[0].message}"] += 1
        return
    rows = [d.key for loop in result.loops for d in loop.differences]
    apart = [d.key for loop in result.loops for d in loop.operated] + [
        k for loop in result.loops for k in (*loop.left_out, *loop.missing)
    ]
    section = key.rpartition(".")[0]
    names = (key, f"plc.{key}", f"{key}_enabled", f"{section}.enabled", *ALIASES.get(key, ()), *executed(key, result))
    if any(overlap(name, row) for name in names for row in rows) or moved_or_renamed(key, result):
        return
    if any(overlap(name, row) for name in names for row in apart):
        score.apart[f"{comparison.replace('file', 'F')}: {key}"] += 1
    elif key == TABLE and comparison != "file/file":
        score.apart[f"{comparison}: a listing without {key} says nothing of it"] += 1
    elif key.startswith("state.") and ("nickname" in comparison or "cdv" in comparison):
        score.apart[f"{comparison}: {key} has no place in this format"] += 1
    elif not any(loop.differences for loop in result.loops):
        score.unseen[f"{comparison}: {key}"] += 1
    else:
        score.unseen[f"{comparison}: {key} (but {sorted(set(rows))[:3]})"] += 1


def executed(key, result):
    """A move as differences name it: they count moves in the order of their execution, those at the start first."""
    if not key.startswith("moves."):
        return
    number, _, rest = key.removeprefix("moves.").partition(".")
    for config, _ in result.sources or ():
        order = sorted(range(len(config.moves)), key=lambda i: config.moves[i].at != "start")
        if int(number) in order:
            yield f"plc.moves.{order.index(int(number))}.{rest}".removesuffix(".")


def moved_or_renamed(key, result):
    """Whether a name, or a place, is told of a loop as a whole."""
    return key == "name" and any(loop.status in {"renamed", "added"} for loop in result.loops)


NOTHING = "nothing"
"""A setting that no vendor has."""
TABLE = "ramp_soak.steps"
"""A table that a file may leave alone."""
ALIASES = {"cascade_from": ("remote_setpoint",), "remote_setpoint": ("cascade_from",)}


def score_of(key, files, changes=12, number=1):
    """The score of one vendor over so many random files, of each so many keys."""
    score, rng, vendor = Score(), random.Random(number), VENDORS[key]

    @seed(number)
    @settings(
        max_examples=files,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(st.tuples(STRATEGIES[key], STRATEGIES[key]))
    def run(configs):
        if all(len(config.loops) for config in configs):
            spoil(score, vendor, configs, rng, changes)

    run()
    return score


def report(key, score):
    """What became of the changes of a vendor, in words."""
    own = sum(n for name, n in score.compared.items() if name.startswith("own"))
    yield (
        f"\n{key}: {score.changes} changes of {len(score.keys)} keys, {score.compared.total() - own} comparisons, "
        f"{score.unseen.total()} unseen, {score.apart.total()} told apart, {score.same.total()} with the same words; "
        f"{own} files against own words, {score.untrue.total()} untrue"
    )
    for title in ("unseen", "untrue", "apart", "more"):
        yield from (f"  {title}: {name} × {count}" for name, count in getattr(score, title).most_common(MOST))


MOST = 12


def main(args):
    """Prints the score of each vendor."""
    for key in args[1:] or STRATEGIES:
        sys.stdout.write("\n".join(report(key, score_of(key, int(args[0]) if args else 60))) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
