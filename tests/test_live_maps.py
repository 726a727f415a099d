"""Modbus maps that the user states: an EZLogix, whose manual prints none, and a CLICK behind a gateway."""

import re

import pytest

import pidcfg
from live_rig import CLICK, ROOT, Desk, Registers, run, words_of
from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.maps.click import SPACE as CLICK_SPACE
from pidcfg.encoders.maps.ezlogix import SPACE
from pidcfg.encoders.modbus_map import read_map
from pidcfg.live.errors import PlcError

OVEN = ROOT / "examples/ezlogix/oven.yaml"
MAP = "symbol,table,register,type\nR1,holding,1000,uint16\n# the discretes\nS1,coil,200,bool\nR140,input,7\n"
GATEWAY = "C1,discrete,0,bool\nDS1,input,5000,int16\nDF1,holding,0,float32,high-first\n"


@pytest.fixture(scope="module")
def desk():
    desk = Desk()
    yield desk
    desk.close()


def test_an_ezlogix_is_pulled_and_compared_by_its_map(desk, tmp_path):
    words = words_of(OVEN, read_map(MAP, SPACE))
    assert ("holding", 1000 + 100) in words
    assert ("input", 7) in words
    with desk.plc(Registers(words)) as url:
        assert pidcfg.compare(OVEN, url, map=MAP).same
        result = pidcfg.pull(url, like=OVEN, map=MAP)
        held = {cell.number: cell.raw for cell in result.image.cells}
        assert held == pidcfg.encode(OVEN).image.words
        assert pidcfg.encode(result.text).image.words == held
        (tmp_path / "map.csv").write_text(MAP, "utf-8")
        assert run("compare", OVEN, "--plc", url, "--map", tmp_path / "map.csv").exit_code == 0
    gain = next(c for c in pidcfg.encode(OVEN).image.cells if c.field == "proportional_gain")
    place = read_map(MAP, SPACE).place(gain.number)
    with desk.plc(Registers(words | {(place.table, place.register): gain.raw + 100})) as url:
        (finding,) = pidcfg.compare(OVEN, url, map=MAP).findings
    assert gain.address in finding.message


def test_words_in_the_other_order(desk):
    with desk.plc(Registers(words_of(CLICK, read_map(GATEWAY, CLICK_SPACE)))) as url:
        assert pidcfg.compare(CLICK, url, map=GATEWAY).same
        assert not pidcfg.compare(CLICK, url, map=GATEWAY.replace("high-first", "low-first")).same


def test_a_map_and_its_way_back():
    for text, space in ((MAP, SPACE), (GATEWAY, CLICK_SPACE)):
        numbering = read_map(text, space)
        for row in numbering.rows:
            for number in range(row.start, row.start + 5):
                place = numbering.place(number)
                for part in range(place.width):
                    assert numbering.find(place.table, place.register + part) == (number, place.shift(part) // 16)
    assert read_map(MAP, SPACE).find("coil", 199) is None


def test_without_a_map_there_is_one_error_that_shows_one():
    with pytest.raises(ValueError, match=re.escape("rows like R1,holding,0,uint16 and S1,coil,0,bool")):
        pidcfg.compare(OVEN, "modbus://127.0.0.1:1")
    with pytest.raises(ValueError, match="parameters by name"):
        pidcfg.compare(ROOT / "examples/dpide/oven.yaml", "modbus://127.0.0.1:1", map=MAP)
    with pytest.raises(PlcError, match="the map does not say where S"):
        pidcfg.compare(OVEN, "modbus://127.0.0.1:1", map="R1,holding,0")
    with pytest.raises(PlcError, match="beyond the last register"):
        pidcfg.compare(OVEN, "modbus://127.0.0.1:1", map="R1,holding,65500\nS1,coil,0")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "no row"),
        ("R1,holding", "2 cells"),
        ("D0,holding,0", "not an address"),
        ("R1,register,0", "none of coil"),
        ("R1,holding,x", "no register"),
        ("R1,holding,70000", "no register"),
        ("R1,holding,65536", "no register"),
        ("R1,holding,0,float32", "uint16 or int16"),
        ("R1,coil,0", "which coil registers do not"),
        ("S1,holding,0", "which holding registers do not"),
        ("R1,holding,0,uint16,sideways", "low-first"),
        ("R1,holding,0\nR1,holding,5", "again"),
    ],
)
def test_maps_that_are_none(text, said):
    with pytest.raises(ListingError, match=said):
        read_map(text, SPACE)
