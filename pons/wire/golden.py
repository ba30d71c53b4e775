#!/usr/bin/env python3
"""Writes golden.txt: of each ROS 2 type its hash, and the bytes of a message that is filled as test_fill.hpp fills it, both
as PyPI's rosbags has them.

usage: .venv-check/bin/python -B pons/wire/golden.py [--json FILE] > pons/wire/golden.txt
       FILE is for golden.mjs, which holds the same bytes against npm's writers; golden_others.py runs both as tests"""

import argparse
import json
import sys
from pathlib import Path

import numpy
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import ros_interfaces  # noqa: E402


def text_of(kind):
    count = {ros_interfaces.ARRAY: f"[{kind.count}]", ros_interfaces.BOUNDED_SEQUENCE: f"[<={kind.count}]",
             ros_interfaces.SEQUENCE: "[]"}.get(kind.kind, "")
    return kind.base + (f"<={kind.bound}" if kind.bound else "") + count


def definition(message):
    return "".join(f"{text_of(each.type)} {each.name}\n" for each in message.fields)


def described(message):
    """As rosbags wants it. A char is a uint8, as rosidl has it."""
    def of(kind):
        element = (Nodetype.NAME, kind.base) if kind.nested else \
            (Nodetype.BASE, ("uint8" if kind.base == "char" else kind.base, kind.bound))
        if not kind.kind:
            return element
        return Nodetype.ARRAY if kind.kind == ros_interfaces.ARRAY else Nodetype.SEQUENCE, (element, kind.count)
    return [], [(each.name, of(each.type)) for each in message.fields]


def has_char(messages, name):
    return any(each.type.base == "char" or each.type.nested and has_char(messages, each.type.base)
               for each in messages[name].fields)


class Fill:
    """Values as plain Python has them: numbers, strings, lists, and dicts for messages."""

    def __init__(self, messages):
        self.messages, self.last = messages, 0

    def message(self, name):
        return {each.name: self.field(each.type) for each in self.messages[name].fields}

    def field(self, kind):
        if not kind.kind:
            return self.one(kind)
        if kind.kind == ros_interfaces.ARRAY:
            return [self.one(kind) for _ in range(kind.count)]
        self.last += 1
        count = self.last % 3
        if kind.kind == ros_interfaces.BOUNDED_SEQUENCE:
            count = min(count, kind.count)
        return [self.one(kind) for _ in range(count)]

    def one(self, kind):
        if kind.nested:
            return self.message(kind.base)
        self.last += 1
        if kind.base == "string":
            return str(self.last) + ("x" if self.last % 2 else "")
        if kind.base == "bool":
            return self.last % 2 == 1
        if kind.base.startswith("float"):
            return self.last + 0.25
        value = -self.last if self.last % 2 else self.last
        unsigned = kind.base.startswith("u") or kind.base in ("byte", "char")
        bits = 8 if kind.base in ("byte", "char") else int(kind.base.removeprefix("u").removeprefix("int"))
        value %= 1 << bits
        return value if unsigned or value < 1 << (bits - 1) else value - (1 << bits)


NUMPY = {"bool": "bool", "byte": "uint8", "char": "uint8"}


def as_rosbags(store, messages, name, value):
    def convert(kind, of):
        if kind.base == "byte" and not kind.kind:
            return of - 256 if of > 127 else of  # there it has a sign
        if kind.nested:
            return [as_rosbags(store, messages, kind.base, each) for each in of] if kind.kind else \
                as_rosbags(store, messages, kind.base, of)
        return numpy.array(of, dtype=NUMPY.get(kind.base, kind.base)) if kind.kind and kind.base != "string" else of
    fields = {each.name: convert(each.type, value[each.name]) for each in messages[name].fields}
    return store.types[name](**fields)


def for_json(value):
    """Large numbers as strings: JavaScript's are floating-point."""
    if isinstance(value, dict):
        return {name: for_json(each) for name, each in value.items()}
    if isinstance(value, list):
        return [for_json(each) for each in value]
    return str(value) if isinstance(value, int) and abs(value) > 1 << 53 else value


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    interfaces = ros_interfaces.load_all([ROOT / "ros2" / "interfaces", ROOT / "ros2" / "dialects", ROOT / "ros2"])
    messages = {each.name: each for interface in interfaces.values() for each in interface.messages}
    theirs, store = get_typestore(Stores.ROS2_JAZZY), get_typestore(Stores.EMPTY)
    store.register({each.name: described(each) for each in messages.values()})
    cases = []
    for name in sorted(messages):
        # Where they have the type themselves, by their definition of it; but their hash of a char is not rosidl's.
        by = theirs if name in theirs.types and not has_char(messages, name) else store
        value = Fill(messages).message(name)
        encoded = bytes(by.serialize_cdr(as_rosbags(by, messages, name, value), name)).hex()
        print(name, by.hash_rihs01(name), encoded)
        cases.append({"name": name, "value": for_json(value), "bytes": encoded})
    if arguments.json:
        arguments.json.write_text(json.dumps({"definitions": {each.name: definition(each) for each in messages.values()},
                                              "cases": cases}), encoding="utf-8")


if __name__ == "__main__":
    main()
