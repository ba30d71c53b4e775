// What is known of the things that tasks name.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "pons/task/task.hpp"

namespace pons::task {

struct Facts {
  std::vector<std::string> names;  // of all that may be known: "destination", "mass_kg"
  // {"destination":"chute_3"}; an object without what is not known now.
  std::function<Json(std::string_view thing)> of;
  std::map<std::string, std::vector<std::string>, std::less<>> words = {};  // that a fact is one of; others are any
};

}  // namespace pons::task
