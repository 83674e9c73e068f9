"""Elements of XML files by their names, in any namespace, and the texts and numbers in them."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree import ElementTree

from minsnap.basics.messages import shown
from minsnap.basics.storage.text import FileName, reading
from minsnap.errors import FileError

Element = ElementTree.Element


def parse_xml(path: FileName, content: bytes, kind: str) -> Element:
    """Return the root of a file of a kind that its root is named after, such as ``gpx``.

    A document type is refused, since it could define entities without end.

    Raises
    ------
    FileError
        If it is no XML, has a document type, or another root.
    """
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise FileError(f"{path} defines a document type, which is not read: leave it out")
    with reading(path, kind.upper()):
        root = ElementTree.fromstring(content)
    if name_of(root) != kind:
        raise FileError(f"{path} is not {kind.upper()}: its root is {shown(name_of(root))}")
    return root


def name_of(element: Element) -> str:
    """Return the name of an element without its namespace."""
    return str(element.tag).rpartition("}")[2]


def elements(root: Element, name: str) -> Iterator[Element]:
    """Return all elements of a name inside of another one, and itself, in their order."""
    return (element for element in root.iter() if name_of(element) == name)


def children(root: Element, name: str) -> list[Element]:
    """Return the elements of a name directly below another one, in their order."""
    return [element for element in root if name_of(element) == name]


def texts(root: Element, name: str) -> list[str]:
    """Return the texts of all elements of a name."""
    return [(element.text or "").strip() for element in elements(root, name)]


def text_of(root: Element, name: str) -> str:
    """Return the text of the first element of a name; empty without one."""
    return next(iter(texts(root, name)), "")


def number(text: str) -> float | None:
    """Return the number that a text is, or None."""
    try:
        return None if "_" in text else float(text)
    except ValueError:
        return None


def number_of(root: Element, name: str) -> float:
    """Return the number in the first element of a name; not a number without one."""
    value = number(text_of(root, name))
    return float("nan") if value is None else value
