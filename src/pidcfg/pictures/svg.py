"""What is done to an SVG once it is drawn: identifiers of its own, classes, words for screen readers, common fonts."""

from __future__ import annotations

import hashlib
import re
from xml.etree import ElementTree as ET

from pidcfg.pictures.style import plain

SVG, XLINK = "http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"
FONTS = "'DejaVu Sans', Verdana, 'Segoe UI', Arial, sans-serif"
"""The font that the places are made for, and wide ones that most systems have."""
REFERENCE = re.compile(r"url\(#([^)]*)\)")
CLASSES = {
    "title",
    "loop",
    "note",
    "key",
    "side",
    "axis",
    "line",
    "name",
    "strip",
    "bar",
    "label",
    "mark",
    "number",
    "level",
    "band",
}
"""First words of what `figure` calls the parts; they become classes."""


def finished(text: str, title: str, description: str) -> str:
    """The drawing as it is handed out: without metadata, and with no identifier that another drawing could have."""
    root = ET.fromstring(text)  # noqa: S314 - the drawing was made here
    salt = hashlib.sha256(f"{title}\0{text}".encode()).hexdigest()[:8]
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag in {f"{{{SVG}}}metadata", f"{{{SVG}}}style"}:
                parent.remove(child)
    used = _references(root)
    for element in root.iter():
        _name(element, f"p{salt}-", used)
    root.attrib |= {
        "role": "img",
        "aria-labelledby": f"p{salt}-title p{salt}-desc",
        "class": "pidcfg-chart",
        "style": "stroke-linejoin: round",
    }
    for place, (tag, words) in enumerate((("title", plain(title)), ("desc", description))):
        element = ET.Element(f"{{{SVG}}}{tag}", {"id": f"p{salt}-{tag}"})
        element.text = words
        root.insert(place, element)
    ET.register_namespace("", SVG)
    ET.register_namespace("xlink", XLINK)
    return ET.tostring(root, encoding="unicode") + "\n"


def _references(root: ET.Element) -> set[str]:
    """Identifiers that something refers to."""
    names: set[str] = set()
    for element in root.iter():
        for key, value in element.attrib.items():
            names |= set(REFERENCE.findall(value))
            if key in {"href", f"{{{XLINK}}}href"} and value.startswith("#"):
                names.add(value[1:])
    return names


def _name(element: ET.Element, prefix: str, used: set[str]) -> None:
    """Identifiers that are needed get the prefix, names of parts become classes, the rest goes."""
    name = element.attrib.pop("id", None)
    if name is not None and name in used:
        element.set("id", prefix + name)
    elif name is not None and name.split(" ")[0] in CLASSES:
        element.set("class", name)
    for key, value in list(element.attrib.items()):
        if key in {"href", f"{{{XLINK}}}href"} and value.startswith("#"):
            element.set(key, f"#{prefix}{value[1:]}")
        else:
            element.set(key, REFERENCE.sub(rf"url(#{prefix}\1)", value).replace("'DejaVu Sans'", FONTS))
