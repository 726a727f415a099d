"""A sample as the scenario that it is: data with the drawn numbers in place, and its text."""

from __future__ import annotations

import pickle
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

from pidcfg.certification.draw import DrawError, drawn, seed_of
from pidcfg.certification.plain_yaml import block_yaml
from pidcfg.document import Plain
from pidcfg.paths import put, steps
from pidcfg.scenario.load import read_scenario
from pidcfg.schemas.scenario_fields import whole

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.document import Document
    from pidcfg.scenario.load import Loaded
    from pidcfg.scenario.vary import Uncertainty
    from pidcfg.schemas.scenario import Scenario
    from pidcfg.sim.plc import Plc


class UnusableSampleError(Exception):
    """A sample that cannot run, and why."""


@dataclass(frozen=True, slots=True)
class Batch:
    """A scenario and what varies in it: everything that a sample is made of."""

    document: Document
    varies: Sequence[Uncertainty]
    seed: int
    plc: bytes = b""
    """A new PLC as `pickle` keeps it, which is read many times as fast as words are decoded; empty: each is loaded."""

    def numbers(self, sample: int) -> list[float]:
        """The drawn numbers of a sample; raises `UnusableSampleError`."""
        try:
            return [drawn(what, self.seed, sample) for what in self.varies]
        except DrawError as error:
            raise UnusableSampleError(str(error)) from None

    def new_plc(self, loaded: Loaded) -> Plc:
        """A PLC at its program-to-run transition; the same for all samples, since no key of ``plc`` varies."""
        return cast("Plc", pickle.loads(self.plc)) if self.plc else loaded.plc()  # noqa: S301 - our own bytes

    def data(self, sample: int, numbers: Sequence[float]) -> dict[str, Any]:
        """The scenario of a sample as plain data."""
        data: dict[str, Any] = dict(whole(self.document.data))  # type: ignore[call-overload]  # a mapping, as it is loaded
        texts = {what: Plain(what.written(number)) for what, number in zip(self.varies, numbers, strict=True)}
        data["scenario"] = f"{data['scenario']} (sample {sample})"
        data["seed"] = Plain(seed_of(self.seed, sample))
        if "plants" in data:
            data["plants"] = _plants(data["plants"], texts)
        loops: dict[str, dict[str, Plain]] = {}
        for what, text in texts.items():
            if what.of == "loops":
                loops.setdefault(what.name, {})[what.key] = text
        events = [{"at": Plain(0), "loop": Plain(name), "set": keys} for name, keys in loops.items()]
        if events:
            data["events"] = [*events, *data.get("events", ())]
        if "expect" in data:
            data["expect"] = [{key: v for key, v in one.items() if key != "share"} for one in data["expect"]]
        data.pop("vary", None)
        return data

    def scenario(self, sample: int, numbers: Sequence[float]) -> Scenario:
        """A sample as it runs; raises `UnusableSampleError`."""
        data = self.data(sample, numbers)
        scenario, findings = read_scenario(replace(self.document, data=data, problems=()))
        if scenario is None:
            raise UnusableSampleError("; ".join(finding.message for finding in findings))
        return scenario

    def text(self, sample: int, numbers: Sequence[float]) -> str:
        """A sample as the file that `pidcfg simulate` runs in the same way."""
        name = self.document.file.rpartition("/")[2]
        head = f"# Sample {sample} of pidcfg certify with seed {self.seed}, from {name}.\n"
        return head + block_yaml(self.data(sample, numbers))


def _plants(plants: Any, texts: Mapping[Uncertainty, Plain]) -> Any:
    """The plants, by key or as a list, with the drawn numbers."""
    keyed = isinstance(plants, dict)
    copies = [(name, dict(plant)) for name, plant in (plants.items() if keyed else enumerate(plants))]
    for what, text in texts.items():
        for name, plant in copies:
            if what.of == "plants" and what.name == str(name if keyed else plant.get("name")):
                if isinstance(plant.get(what.key.partition(".")[0]), list):
                    plant[what.key.partition(".")[0]] = list(plant[what.key.partition(".")[0]])
                put(plant, steps(what.key), text)
    return dict(copies) if keyed else [plant for _, plant in copies]
