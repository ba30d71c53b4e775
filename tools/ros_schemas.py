"""The "ros2msg" text of each type: what recordings keep beside messages, so that others can read them (MCAP's registry of
schema encodings; rosbag2's plugin writes the same). Each definition is kept once; pons/wire/schema.cpp puts together
those that a type needs."""

import re

from ros_interfaces import ARRAY, BOUNDED_SEQUENCE, EMPTY

FORM_OF_A_VERSION = "_humble"  # an ending that is ours: two forms of one package, which has one name on the wire


def wire_package(package):
    return package.removesuffix(FORM_OF_A_VERSION)


def label(name):
    """As a definition names it: "geometry_msgs/Point"."""
    package, _, short = name.split("/")
    return f"{wire_package(package)}/{short}"


def written(value, base):
    if base == "bool":
        return "true" if value else "false"
    return f'"{value}"' if base == "string" else repr(value)


def field_line(field):
    kind = field.type
    text = label(kind.base) if kind.nested else kind.base
    if kind.bound:
        text += f"<={kind.bound}"
    if kind.kind:
        text += f"[{kind.count}]" if kind.kind == ARRAY else f"[<={kind.count}]" if kind.kind == BOUNDED_SEQUENCE else "[]"
    if field.default is None:
        return f"{text} {field.name}"
    several = isinstance(field.default, list)
    value = ", ".join(written(each, kind.base) for each in field.default) if several else written(field.default, kind.base)
    return f"{text} {field.name} [{value}]" if several else f"{text} {field.name} {value}"


def made_text(message):
    """Of a part of a service or an action, for which there is no file."""
    lines = [f"{each.type} {each.name}={written(each.value, each.type)}" for each in message.constants]
    lines += [field_line(each) for each in message.fields if each.name != EMPTY]
    return "".join(line + "\n" for line in lines)


def file_text(interface):
    """A .msg file as it is, but for a package's name that is ours."""
    text, package = interface.path.read_text(encoding="utf-8"), interface.name.split("/")[0]
    if wire_package(package) != package:
        text = re.sub(rf"(?<![\w/]){package}/", f"{wire_package(package)}/", text)
    return text


def raw(text):
    mark = "msg"
    while f"){mark}\"" in text:
        mark += "_"
    return f'R"{mark}({text}){mark}"'


def all_schemas(interfaces):
    rows = []
    for interface in interfaces.values():
        for each in interface.messages:
            text = file_text(interface) if interface.name == each.name else made_text(each)
            needs = sorted({field.type.base for field in each.fields if field.type.nested}, key=label)
            rows.append((each.name, label(each.name), text, " ".join(needs)))
    listed = ",\n".join(f'    {{"{name}", "{short}", {raw(text)},\n     "{needs}"}}' for name, short, text, needs in sorted(rows))
    return f"""// What each message's interface file says, for pons/wire/schema.cpp. Made by tools/ros_codecs.
#pragma once

#include <array>
#include <string_view>

namespace pons::wire {{

struct Definition {{
  std::string_view name;   // "geometry_msgs/msg/PoseStamped", ours
  std::string_view label;  // "geometry_msgs/PoseStamped", as it is named on the wire
  std::string_view text;
  std::string_view needs;  // the names, ours, of the types of its fields, with a space between, in the order of their labels
}};

// By name.
inline constexpr std::array kDefinitions = std::to_array<Definition>({{
{listed}}});

}}  // namespace pons::wire
"""
