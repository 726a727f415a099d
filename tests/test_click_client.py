"""Our CLICK values written to a simulated PLC by real Modbus clients, and read back from it, bit for bit."""

from __future__ import annotations

import csv
import socket
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

pytest.importorskip("pyclickplc")
from hypothesis import HealthCheck, Phase, given, settings
from pyclickplc import BANKS, ClickClient, ClickServer, MemoryDataProvider
from pymodbus.client import AsyncModbusTcpClient

from apart import apart
from click_strategies import configurations
from pidcfg.encoders.click.files import FORMATS
from pidcfg.encoders.click.image import encode
from pidcfg.encoders.codecs import single_bits
from pidcfg.encoders.maps.click import BLOCKS, SPACE
from pidcfg.schemas.click import ClickFile
from pidcfg.text.source import read_document

ROOT = Path(__file__).parents[1]
FILES = sorted(
    path for path in (ROOT / "examples" / "click").glob("*.yaml") if not path.name.endswith(".scenario.yaml")
)
STARTER = ROOT / "src" / "pidcfg" / "cli" / "starters" / "click.yaml"
HOST = "127.0.0.1"
FEW = settings(
    max_examples=6,
    deadline=None,
    phases=[Phase.generate],
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)  # each example starts a server and sends hundreds of telegrams


def image_of(path: Path):
    """The image of a configuration file."""
    return encode(ClickFile.model_validate(read_document(path.read_bytes(), path.name).data)).image


def free_port() -> int:
    """A port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind((HOST, 0))
        return probe.getsockname()[1]


@asynccontextmanager
async def simulated():
    """The memory of a simulated PLC, and its port."""
    memory, port = MemoryDataProvider(), free_port()
    async with ClickServer(memory, host=HOST, port=port):
        yield memory, port


def native(cell):
    """A cell as pyclickplc has values: a switch is a bool, a DS a signed number, a DF a float."""
    return float(cell.value) if cell.address.startswith("DF") else cell.value


async def by_address(image) -> dict[int, int]:
    """Writes every cell by its address, and reads the blocks of every loop as ranges."""
    async with simulated() as (_, port), ClickClient(HOST, port) as plc:
        for cell in image.cells:
            await plc.addr.write(cell.address, native(cell))
        found = {}
        for entry in image.settings:
            for key, (_, table) in BLOCKS.items():
                first = SPACE.parse(entry[key])
                last = SPACE.name(first + table.size - 1)
                for address, value in (await plc.addr.read(f"{entry[key]}-{last}")).items():
                    found[SPACE.parse(address)] = SPACE.kind(first).read(value)
        return found


async def by_register(text: str) -> dict[int, int]:
    """Writes the rows of our Modbus map one by one, and tells what the PLC then holds."""
    async with simulated() as (memory, port):
        client = AsyncModbusTcpClient(HOST, port=port)
        assert await client.connect()
        addresses = set()
        for row in csv.DictReader(line for line in text.splitlines() if not line.startswith("#")):
            register, value = int(row["register"]), int(row["value"])
            if row["table"] == "coil":
                answer = await client.write_coil(register, bool(value))
            else:
                answer = await client.write_register(register, value)
            assert not answer.isError(), row
            addresses.add(row["address"])
        client.close()
        return {SPACE.parse(a): SPACE.kind(SPACE.parse(a)).read(memory.read(a)) for a in addresses}


@pytest.mark.parametrize("path", [STARTER, *FILES], ids=lambda path: path.name)
def test_a_client_reads_back_what_we_encoded(path):
    image = image_of(path)
    assert apart(by_address(image)) == image.words


@pytest.mark.parametrize("path", [STARTER, *FILES], ids=lambda path: path.name)
def test_the_modbus_map_written_register_by_register_is_the_same_memory(path):
    image = image_of(path)
    assert apart(by_register(FORMATS["modbus"].write(image, ()))) == image.words


@FEW
@given(configurations())
def test_any_configuration_reaches_the_plc_bit_for_bit(config):
    image = encode(config).image
    assert apart(by_address(image)) == image.words
    assert apart(by_register(FORMATS["modbus"].write(image, ()))) == image.words


def test_a_float_in_the_wrong_word_order_would_be_seen():
    """The comparison has teeth: the words of DF106 exchanged are another number."""
    image = image_of(STARTER)
    text = FORMATS["modbus"].write(image, ())
    gain = next(c for c in image.cells if c.field == "proportional_gain")
    low, high = gain.raw & 0xFFFF, gain.raw >> 16
    lines = text.splitlines(keepends=True)
    at = next(i for i, line in enumerate(lines) if ",proportional_gain, low word" in line.replace('"', ""))
    lines[at] = lines[at].replace(f",{low},", f",{high},")
    lines[at + 1] = lines[at + 1].replace(f",{high},", f",{low},")
    found = apart(by_register("".join(lines)))
    assert found[gain.number] == high | low << 16 != gain.raw
    assert {n: raw for n, raw in found.items() if n != gain.number} == {
        n: raw for n, raw in image.words.items() if n != gain.number
    }


def test_the_address_space_is_that_of_the_simulated_plc():
    for bank in SPACE.banks:
        assert (BANKS[bank.prefix].min_addr, BANKS[bank.prefix].max_addr) == (bank.first, bank.last)


def test_extreme_floats_survive_the_way():
    """The largest, the smallest normal and a negative zero's neighbour, through one register pair."""

    async def exchange(raws):
        async with simulated() as (_, port), ClickClient(HOST, port) as plc:
            found = []
            for raw in raws:
                await plc.df.write(500, SPACE.kind(SPACE.parse("DF500")).show(raw))
                found.append(single_bits(await plc.df[500]))
            return found

    raws = [0x7F7FFFFF, 0xFF7FFFFF, 0x00800000, 0x80000001, 0x3DCCCCCD]
    assert apart(exchange(raws)) == raws
