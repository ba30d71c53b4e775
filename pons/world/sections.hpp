// The parts of world.yaml that have a file of their own. Loading only: they throw LoadError.
#pragma once

#include <filesystem>

#include "pons/world/world.hpp"
#include "pons/world/yaml.hpp"

namespace pons::world {

[[nodiscard]] Robot read_robot(const YamlValue& value, const std::filesystem::path& folder);

[[nodiscard]] Review read_review(const YamlValue& value);

// {position: [x, y, z]} with rpy_deg (about the fixed axes x, y, z in turn), `look: down` (z down, x along world +x) or
// look_at: [x, y, z] (z towards that point, y as far down as it can).
[[nodiscard]] Pose read_pose(const YamlValue& value);

}  // namespace pons::world
