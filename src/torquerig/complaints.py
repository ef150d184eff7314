"""What is wrong with a configuration, in one sentence that names table.key."""

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from functools import cache
from typing import Any, Final

from pydantic import ValidationError

from torquerig.schema import Rig
from torquerig.toml_text import write

Location = tuple[int | str, ...]

_WORDS: Final = {
    "boolean": "true or false",
    "integer": "a whole number",
    "number": "a number",
    "object": "a table",
    "string": "a text",
}


def complaint(error: ValidationError, data: Mapping[str, Any]) -> tuple[str, str]:
    """The first thing that is wrong.

    Args:
        error: What the validation found.
        data: What was validated.

    Returns:
        The dotted key it is about, and the sentence.
    """
    details = error.errors()
    unknown = [detail for detail in details if detail["type"] == "extra_forbidden"]
    first = (unknown or details)[0]
    location = _inside(first["loc"], data)
    key = ".".join(map(str, location))
    match first["type"]:
        case "extra_forbidden":
            return key, _unknown(location)
        case "missing":
            return key, f"{'.'.join(map(str, first['loc']))} is missing{_allowed(_schema_at(first['loc']))}"
        case _:
            value = _value_at(location, data)
            shown = "a table" if isinstance(value, Mapping) else write(value)
            return key, f"{key} = {shown} cannot be{_allowed(_schema_at(location))}"


def suggestion(name: str, known: Iterable[str]) -> str:
    """The known name nearest to an unknown one, as the end of a sentence.

    Args:
        name: What was asked for.
        known: What there is.

    Returns:
        ", did you mean ...?", or the list of all when none is near.
    """
    names = list(known)
    near = get_close_matches(name, names, n=1, cutoff=0.6)
    return f"; did you mean {near[0]}?" if near else f"; there are {', '.join(names)}"


def _unknown(location: Location) -> str:
    """The sentence about a key or table that nobody knows."""
    *table, name = map(str, location)
    known = _schema_at(location[:-1]).get("properties", {})
    prefix = ".".join([*table, ""])
    what = "setting" if table else "table"
    return f"{prefix}{name} is not a {what}{suggestion(f'{prefix}{name}', [prefix + key for key in known])}"


def _inside(location: Location, data: object) -> Location:
    """The part of an error's location that is in the data: what follows names a branch of a union."""
    path: list[int | str] = []
    for part in location:
        try:
            data = data[part]  # type: ignore[index]  # whatever has no such part ends the way
        except (LookupError, TypeError):
            break
        path.append(part)
    return tuple(path)


def _value_at(location: Location, data: Any) -> object:  # noqa: ANN401  (TOML's values are of any type)
    """The value at a location."""
    for part in location:
        data = data[part]
    return data


@cache
def _schema() -> dict[str, Any]:
    """The JSON schema of the whole configuration."""
    return Rig.model_json_schema(by_alias=True)


def _resolve(node: dict[str, Any]) -> dict[str, Any]:
    """A node of the schema with its reference followed."""
    reference = node.get("$ref")
    return _schema()["$defs"][reference.rpartition("/")[2]] if reference else node


def _schema_at(location: Location) -> dict[str, Any]:
    """The node of the schema that describes a location; empty where there is none."""
    node: dict[str, Any] = _schema()
    for part in location:
        node = _resolve(node)
        if isinstance(part, int):
            items = node.get("prefixItems", [])
            node = items[part] if part < len(items) else node.get("items", {})
        else:
            extra = node.get("additionalProperties")
            node = node.get("properties", {}).get(part) or (extra if isinstance(extra, dict) else {})
    return _resolve(node)


def _allowed(node: dict[str, Any]) -> str:
    """What a node of the schema allows, as the end of a sentence."""
    words = _describe(node)
    return f": it must be {words}" if words else ""


def _describe(node: dict[str, Any]) -> str:
    """What a node of the schema allows, in words."""
    node = _resolve(node)
    if "anyOf" in node:
        return " or ".join(words for words in map(_describe, node["anyOf"]) if words)
    if "enum" in node or "const" in node:
        allowed = ", ".join(map(write, node.get("enum", [node.get("const")])))
        return f"one of {allowed}" if "enum" in node else allowed
    kind = str(node.get("type"))
    if kind == "string" and "description" in node:
        return str(node["description"])
    if kind == "array" and "items" in node:
        return f"a list{_range(node)}: each {_describe(node['items'])}"
    if kind == "array":
        items = node.get("prefixItems", [{}])
        return f"a list of {len(items)}: each {_describe(items[0])}"
    return _WORDS.get(kind, "") + _range(node)


def _range(node: dict[str, Any]) -> str:
    """The bounds of a number, in words."""
    bounds = {
        "minimum": "at least",
        "exclusiveMinimum": "above",
        "maximum": "at most",
        "exclusiveMaximum": "below",
        "minLength": "of a length of at least",
        "minItems": "of at least",
        "maxItems": "of at most",
    }
    words = [f"{word} {node[name]:g}" for name, word in bounds.items() if name in node]
    return f" {' and '.join(words)}" if words else ""
