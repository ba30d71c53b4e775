// Interface files in folders of this computer: types of messages that Pons was not built with. Any thread.
#pragma once

#include <filesystem>
#include <vector>

#include "pons/wire/interface_types.hpp"

namespace pons::gate::ros {

// Types whose files lie in one of these folders, as PACKAGE/{msg,srv,action}/NAME.{msg,srv,action}: the first that has
// it. A message that Pons was built with is that one, whatever lies there. Files of more than 1 MiB are refused.
[[nodiscard]] wire::InterfaceTypes interface_types(std::vector<std::filesystem::path> folders);

}  // namespace pons::gate::ros
