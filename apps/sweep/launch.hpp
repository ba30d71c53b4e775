// How a run's command gets to the computer that makes it.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"

namespace pons::apps {

// What {} and its kin stand for in one start.
struct Start {
  std::vector<std::string> command;
  std::size_t number = 0;  // of the run in its sweep, from 1
  int slot = 0;            // of those that go on at once, from 1: no two have the same
};

// A line for /bin/sh of a person's template:
//   {}        the command, its words quoted for that shell
//   {quoted}  the same as a single word, for whatever has another shell take it apart: ssh, sh -c
//   {number}  of the run, {slot}
// Other braces are left as they are.
[[nodiscard]] std::string filled(std::string_view launch, const Start& start);

// Errors: neither {} nor {quoted} is there; a shell does not find the program that the template begins with.
[[nodiscard]] Expected<void> check_launch(const std::string& launch);

}  // namespace pons::apps
