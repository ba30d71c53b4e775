#!/usr/bin/env python3
"""Makes packages of those ROS 2 interfaces that have no wheel, with the wheels' own generators, gcc and g++, and puts
them where the wheels have theirs: into the virtual environment whose interpreter runs this.

usage: messages.py SOURCE...     SOURCE: a folder of msg/, srv/, action/, called as its package"""

import logging
import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy
from rosidl_adapter.action import convert_action_to_idl
from rosidl_adapter.msg import convert_msg_to_idl
from rosidl_adapter.srv import convert_srv_to_idl
from rosidl_generator_c.cli import GenerateC
from rosidl_generator_py.cli import GeneratePython
from rosidl_typesupport_c.cli import GenerateCTypesupport
from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport
from rosidl_typesupport_introspection_c.cli import GenerateIntrospectionCTypesupport

PREFIX = Path(sys.prefix)
SITE = Path(sysconfig.get_path("purelib"))
CODE = PREFIX / "pons-messages"
CONVERT = {"msg": convert_msg_to_idl, "srv": convert_srv_to_idl, "action": convert_action_to_idl}
# What rmw_fastrtps_cpp asks a type for: its bytes, and its description.
SUPPORTS = ("rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c")
RUNTIME = ("rosidl_runtime_c", "rosidl_typesupport_c", "rosidl_typesupport_fastrtps_c",
           "rosidl_typesupport_fastrtps_cpp", "rosidl_typesupport_introspection_c", "rmw", "rcutils", "fastcdr")


def generate(source: Path) -> list[Path]:
    """The package's sources in C and C++; its Python files are put in their place."""
    name, code, interfaces = source.name, CODE / "idl" / source.name, []
    for kind, convert in CONVERT.items():
        (code / kind).mkdir(parents=True, exist_ok=True)
        for path in sorted((source / kind).glob(f"*.{kind}")):
            idl = convert(source, name, path.relative_to(source), code / kind)
            interfaces.append(f"{code}:{idl.relative_to(code)}")
    known = [str(PREFIX / "share")]
    # Each in a folder of its own: of some files the names are the same.
    made = [path for generator in (GenerateC("c"), GenerateFastRTPSCTypesupport("fastrtps_c"),
                                   GenerateIntrospectionCTypesupport("introspection_c"),
                                   GenerateCTypesupport("dispatch", typesupport_implementations=SUPPORTS))
            for path in generator.generate(name, interfaces, known, CODE / generator.name / name)]
    made += GeneratePython("py", typesupport_implementations=["rosidl_typesupport_c"]).generate(
        name, interfaces, known, SITE / name)
    (SITE / name / "__init__.py").touch()
    return sorted({Path(path) for path in made if Path(path).suffix in (".c", ".cpp")})


def build(name: str, sources: list[Path]) -> None:
    """One library. ROS 2 looks for a type's parts in several, by name: each is a link to it."""
    includes = [*CODE.iterdir(), SITE, sysconfig.get_path("include"), numpy.get_include(), PREFIX / "include",
                *(PREFIX / "include").iterdir()]
    objects = [CODE / "idl" / name / f"{number}.o" for number, _ in enumerate(sources)]
    flags = " ".join(["-c", "-O0", "-w", "-fPIC", *(f"-I{each}" for each in includes)])
    compilers = {".c": "gcc", ".cpp": "g++ -std=c++17"}
    rules = "".join(f"{made}: {path}\n\t@{compilers[path.suffix]} {flags} {path} -o {made}\n"
                    for made, path in zip(objects, sources))
    subprocess.run(["make", "--file=-", f"--jobs={os.cpu_count()}", *objects], input=rules, text=True, check=True)
    # Of the packages that it may use types of.
    others = [each for each in (PREFIX / "lib").glob("lib*__rosidl_*.so")
              if each.stem.endswith(("_c", "_py")) and not each.name.startswith(f"lib{name}__")]
    library = PREFIX / "lib" / f"lib{name}__{SUPPORTS[0]}.so"
    library.unlink(missing_ok=True)
    subprocess.run(["g++", "-shared", *objects, "-Wl,--as-needed", *others,
                    f"-L{PREFIX / 'lib'}", *(f"-l{each}" for each in RUNTIME), "-o", library], check=True)
    for link in (PREFIX / "lib" / f"lib{name}__{SUPPORTS[1]}.so",
                 SITE / name / f"{name}_s__rosidl_typesupport_c{sysconfig.get_config_var('EXT_SUFFIX')}"):
        link.unlink(missing_ok=True)
        link.symlink_to(library)


def main() -> int:
    os.environ["AMENT_PREFIX_PATH"] = str(PREFIX)
    logging.disable()  # wheels name each generator twice, which is said each time
    for source in sys.argv[1:]:
        build(Path(source).name, generate(Path(source).resolve()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
