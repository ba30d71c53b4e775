#!/usr/bin/env bash
# Builds ros2/pons_msgs and the packages of ros2/dialects/ with colcon as users do, with Debian's rosidl, and holds what
# comes of pons_msgs against the structs that Pons has of the same files. What Debian lacks is made in a workspace of the
# test's own: ROS 2's standard packages, of ros2/interfaces/, and those in tests/ros_workspace/.
#
# usage: tests/pons_msgs_test.sh TYPES OUT    TYPES: the folder that tools/ros_codecs has written; OUT: for the workspace
set -euo pipefail
cd "$(dirname "$0")/.."
say() { printf 'pons_msgs: %s\n' "$*"; }
die() { printf 'pons_msgs: error: %s\n' "$*" >&2; exit 1; }
[ $# -eq 2 ] || die "usage: tests/pons_msgs_test.sh TYPES OUT"
types=$(realpath "$1") out=$(realpath -m "$2")

command -v colcon >/dev/null || die "colcon is not installed; run tools/setup --check"
rm -rf "$out"
mkdir -p "$out/src"

# package NAME DEPENDENCY...: one of interfaces, as ROS 2 has it.
package() {
  local name=$1 folder=$out/src/$1 depend= files
  shift
  cp -r "ros2/interfaces/$name" "$folder"
  for each in "$@"; do depend+="<depend>$each</depend>"; done
  files=$(cd "$folder" && find . -type f | sort | sed 's|^\./||')
  cat >"$folder/package.xml" <<XML
<package format="3">
  <name>$name</name><version>0.1.0</version><description>For a test.</description>
  <maintainer email="authors@pons.invalid">The Pons authors</maintainer><license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend><buildtool_depend>rosidl_default_generators</buildtool_depend>
  $depend<exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
XML
  cat >"$folder/CMakeLists.txt" <<CMAKE
cmake_minimum_required(VERSION 3.8)
project($name)
foreach(each ament_cmake rosidl_default_generators $*)
  find_package(\${each} REQUIRED)
endforeach()
rosidl_generate_interfaces($name ${files//$'\n'/ } DEPENDENCIES $*)
ament_export_dependencies(rosidl_default_runtime)
ament_package()
CMAKE
}
package builtin_interfaces
package unique_identifier_msgs
package action_msgs builtin_interfaces unique_identifier_msgs
package std_msgs builtin_interfaces
package geometry_msgs builtin_interfaces std_msgs
cp -r tests/ros_workspace/* "$out/src/"
ln -s "$PWD/ros2/pons_msgs" "$PWD"/ros2/dialects/* "$out/src/"

colcon --log-base "$out/log" build --base-paths "$out/src" --build-base "$out/build" --install-base "$out/install" \
  --executor sequential --event-handlers console_direct+ \
  --cmake-args -G Ninja -DCMAKE_BUILD_TYPE=Debug -DPython3_EXECUTABLE=/usr/bin/python3 "-DPONS_INCLUDES=$PWD;$types" || die "colcon could not build it"

for name in msg/LinkCommand.msg msg/ObjectBelief.msg msg/ObjectBeliefArray.msg msg/RobotState.msg msg/TaskEvent.msg msg/TaskStatus.msg msg/TaskStatusArray.msg srv/CommandTask.srv srv/SubmitTask.srv action/ExecuteTask.action; do
  [ -e "$out/install/pons_msgs/share/pons_msgs/$name" ] || die "$name was not installed"
done
for package in ros2/dialects/*; do
  (cd "$package" && find msg -type f) | while read -r name; do
    [ -e "$out/install/${package##*/}/share/${package##*/}/$name" ] || die "${package##*/}: $name was not installed"
  done || exit 1
done
libraries=$(find "$out/install" -name '*.so' -printf '%h\n' | sort -u | paste -sd:)
LD_LIBRARY_PATH=$libraries "$out/install/pons_msgs_user/lib/pons_msgs_user/same_types" || die "rosidl reads it otherwise"
say "builds, installs, and has the fields that Pons has"
