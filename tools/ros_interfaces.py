"""ROS 2 interface files (.msg, .srv, .action): what they define, and the RIHS01 hashes of the types they become.

The hash of a type is the SHA-256 of its description, and of all that it refers to, in the JSON of REP-2011's type
descriptions. A service becomes three messages, an action three and two services and one more message, as rosidl makes
them."""

import hashlib
import json
import re
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

PRIMITIVES = {"int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8, "uint64": 9,
              "float32": 10, "float64": 11, "char": 3, "bool": 15, "byte": 16, "string": 17}
NESTED, BOUNDED_STRING = 1, 21
ARRAY, BOUNDED_SEQUENCE, SEQUENCE = 48, 96, 144  # added to what an element is
EMPTY = "structure_needs_at_least_one_member"    # of a struct without fields, which IDL does not know
UUID, TIME = "unique_identifier_msgs/msg/UUID", "builtin_interfaces/msg/Time"
EVENT_INFO = "service_msgs/msg/ServiceEventInfo"

TYPE = re.compile(r"(?P<base>[A-Za-z]\w*(?:/\w+){0,2})(?:<=(?P<bound>\d+))?"
                  r"(?:\[(?P<most><=)?(?P<count>\d*)\])?$")
LINE = re.compile(r"(?P<type>\S+)\s+(?P<name>[A-Za-z]\w*)\s*(?P<rest>.*)$")


class Bad(Exception):
    """What is wrong with an interface file, and where."""


@dataclass(frozen=True)
class Type:
    base: str                 # "float64", "string", "geometry_msgs/msg/Point"
    bound: int = 0            # of a string; 0: none
    kind: int = 0             # ARRAY, BOUNDED_SEQUENCE or SEQUENCE; 0: one value
    count: int = 0            # of an array, or at most

    @property
    def nested(self):
        return "/" in self.base

    def described(self):
        element = NESTED if self.nested else BOUNDED_STRING if self.bound else PRIMITIVES[self.base]
        return {"type_id": element + self.kind, "capacity": self.count, "string_capacity": self.bound,
                "nested_type_name": self.base if self.nested else ""}


@dataclass(frozen=True)
class Field:
    name: str
    type: Type
    default: object = None


@dataclass(frozen=True)
class Constant:
    name: str
    type: str
    value: object


@dataclass(frozen=True)
class Message:
    name: str                 # "sensor_msgs/msg/JointState"
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...] = ()

    def described(self):
        return {"type_name": self.name,
                "fields": [{"name": each.name, "type": each.type.described()} for each in self.fields]}


@dataclass(frozen=True)
class Service:
    """Also what an action is as a whole: a name, and members that are messages or services."""
    name: str
    members: tuple[tuple[str, str], ...]  # name, type

    def described(self):
        return {"type_name": self.name,
                "fields": [{"name": name, "type": Type(of).described()} for name, of in self.members]}


@dataclass
class Interface:
    """All that one file becomes."""
    name: str                 # "std_srvs/srv/SetBool"
    path: Path
    messages: list[Message]
    services: list[Service] = field(default_factory=list)

    @cached_property
    def refers_to(self):
        own = {each.name for each in self.messages}
        return sorted({each.type.base for message in self.messages for each in message.fields
                       if each.type.nested and each.type.base not in own})


def message(name, fields, constants=()):
    return Message(name, tuple(fields) or (Field(EMPTY, Type("uint8")),), tuple(constants))


def service(name, request, response):
    event = message(f"{name}_Event", [
        Field("info", Type(EVENT_INFO)), Field("request", Type(request.name, 0, BOUNDED_SEQUENCE, 1)),
        Field("response", Type(response.name, 0, BOUNDED_SEQUENCE, 1))])
    members = (("request_message", request.name), ("response_message", response.name), ("event_message", event.name))
    return [request, response, event], Service(name, members)


def action(name, goal, result, feedback):
    goal_id = Field("goal_id", Type(UUID))
    sent, send_goal = service(f"{name}_SendGoal",
                              message(f"{name}_SendGoal_Request", [goal_id, Field("goal", Type(goal.name))]),
                              message(f"{name}_SendGoal_Response",
                                      [Field("accepted", Type("bool")), Field("stamp", Type(TIME))]))
    got, get_result = service(f"{name}_GetResult", message(f"{name}_GetResult_Request", [goal_id]),
                              message(f"{name}_GetResult_Response",
                                      [Field("status", Type("int8")), Field("result", Type(result.name))]))
    told = message(f"{name}_FeedbackMessage", [goal_id, Field("feedback", Type(feedback.name))])
    whole = Service(name, (("goal", goal.name), ("result", result.name), ("feedback", feedback.name),
                           ("send_goal_service", send_goal.name), ("get_result_service", get_result.name),
                           ("feedback_message", told.name)))
    return [goal, result, feedback, *sent, *got, told], [send_goal, get_result, whole]


def value_of(text, base, where):
    if base == "string":
        return text[1:-1] if len(text) > 1 and text[0] == text[-1] and text[0] in "\"'" else text
    if base == "bool":
        if text.lower() not in ("true", "false", "1", "0"):
            raise Bad(f"{where}: '{text}' is neither true nor false")
        return text.lower() in ("true", "1")
    try:
        return float(text) if base.startswith("float") else int(text, 0)
    except ValueError:
        raise Bad(f"{where}: '{text}' is no {base}") from None


def type_of(text, package, where):
    found = TYPE.match(text)
    if not found:
        raise Bad(f"{where}: '{text}' is no type")
    base = found["base"]
    if base == "wstring":
        raise Bad(f"{where}: wstring: what its bytes are, the vendors do not agree about")
    if base not in PRIMITIVES:
        parts = base.split("/")
        base = "/".join([package, "msg", base] if len(parts) == 1 else
                        [parts[0], "msg", parts[1]] if len(parts) == 2 else parts)
    elif "/" in text:
        raise Bad(f"{where}: '{text}' is no type")
    bound = int(found["bound"] or 0)
    if bound and base != "string":
        raise Bad(f"{where}: only a string has a bound of its own")
    if not text.endswith("]"):
        return Type(base, bound)
    count = int(found["count"] or 0)
    kind = BOUNDED_SEQUENCE if found["most"] else ARRAY if found["count"] else SEQUENCE
    if kind != SEQUENCE and count == 0:
        raise Bad(f"{where}: an array has at least one element")
    return Type(base, bound, kind, count)


def without_comment(line):
    quote = ""
    for at, char in enumerate(line):
        if quote:
            quote = "" if char == quote else quote
        elif char in "\"'":
            quote = char
        elif char == "#":
            return line[:at].strip()
    return line.strip()


def part(name, lines, package):
    """One message, from (where, text) lines."""
    fields, constants = [], []
    for where, line in lines:
        found = LINE.match(line)
        if not found:
            raise Bad(f"{where}: '{line}' is neither a field nor a constant")
        kind, rest = type_of(found["type"], package, where), found["rest"].strip()
        if rest.startswith("="):
            if kind.nested or kind.kind:
                raise Bad(f"{where}: a constant is a number, a truth value or a string")
            constants.append(Constant(found["name"], kind.base, value_of(rest[1:].strip(), kind.base, where)))
        elif not rest:
            fields.append(Field(found["name"], kind))
        elif kind.nested:
            raise Bad(f"{where}: only numbers, truth values and strings have a default")
        elif kind.kind:
            if not (rest.startswith("[") and rest.endswith("]")):
                raise Bad(f"{where}: the default of several is written [1, 2, …]")
            texts = [each.strip() for each in rest[1:-1].split(",") if each.strip()]
            fields.append(Field(found["name"], kind, [value_of(each, kind.base, where) for each in texts]))
        else:
            fields.append(Field(found["name"], kind, value_of(rest, kind.base, where)))
    names = [each.name for each in fields + constants]
    for each in names:
        if names.count(each) > 1:
            raise Bad(f"{lines[0][0].split(':')[0]}: {name} has two '{each}'")
    return message(name, fields, constants)


def load(path):
    """The interface of a file …/PACKAGE/{msg,srv,action}/NAME.{msg,srv,action}."""
    kind, package = path.parent.name, path.parent.parent.name
    if path.suffix != f".{kind}":
        raise Bad(f"{path}: a {path.suffix} file lies in a folder {path.suffix[1:]}/, not {kind}/")
    parts = [[]]
    for number, text in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        line = without_comment(text)
        if line == "---":
            parts.append([])
        elif line:
            parts[-1].append((f"{path}:{number}", line))
    wanted = {"msg": 1, "srv": 2, "action": 3}[kind]
    if len(parts) != wanted:
        raise Bad(f"{path}: a .{kind} file has {wanted} parts, divided by ---; it has {len(parts)}")
    name = f"{package}/{kind}/{path.stem}"
    if kind == "msg":
        return Interface(name, path, [part(name, parts[0], package)])
    ends = ("Request", "Response") if kind == "srv" else ("Goal", "Result", "Feedback")
    made = [part(f"{name}_{end}", lines, package) for end, lines in zip(ends, parts)]
    if kind == "srv":
        messages, whole = service(name, *made)
        return Interface(name, path, messages, [whole])
    return Interface(name, path, *action(name, *made))


def load_all(folders):
    """By name; each of them and all that it refers to."""
    interfaces = {}
    for folder in folders:
        paths = sorted(path for path in folder.glob("*/*/*") if path.suffix in (".msg", ".srv", ".action"))
        if not paths:
            raise Bad(f"{folder}: holds no PACKAGE/msg/NAME.msg, PACKAGE/srv/NAME.srv or PACKAGE/action/NAME.action")
        for path in paths:
            interface = load(path)
            if interface.name in interfaces:
                raise Bad(f"{path}: {interfaces[interface.name].path} defines {interface.name}, too")
            interfaces[interface.name] = interface
    for interface in interfaces.values():
        for other in interface.refers_to:
            if other not in interfaces:
                raise Bad(f"{interface.path}: no {other}; it would be {other}.msg in one of the folders")
    return interfaces


def hashes(interfaces):
    """Of all messages, services and actions, by name: "RIHS01_…"."""
    types = {each.name: each.described() for interface in interfaces.values()
             for each in (*interface.messages, *interface.services)}

    def needed(name, found):
        for each in types[name]["fields"]:
            other = each["type"]["nested_type_name"]
            if other and other not in found:
                found.add(other)
                needed(other, found)
        return found

    def hashed(name):
        text = json.dumps({"type_description": types[name],
                           "referenced_type_descriptions": [types[other] for other in sorted(needed(name, set()))]})
        return "RIHS01_" + hashlib.sha256(text.encode()).hexdigest()

    return {name: hashed(name) for name in types}
