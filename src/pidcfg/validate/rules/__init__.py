"""The rules, one module a topic; the list of a vendor's rules is explicit."""

from __future__ import annotations

from types import ModuleType

from pidcfg.text.diagnostics import number_of
from pidcfg.validate.rule import Rule


def collect(*modules: ModuleType) -> dict[str, Rule]:
    """The rules of some modules by code, in order; two with one code are a bug."""
    rules = [value for module in modules for value in vars(module).values() if isinstance(value, Rule)]
    table = {rule.code: rule for rule in sorted(rules, key=lambda rule: number_of(rule.code))}
    if len(table) != len(rules):
        raise RuntimeError(f"two rules share a code: {sorted(rule.code for rule in rules)}")
    return table
