// The parts of world.yaml that have a file of their own. Loading only: they throw LoadError.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "pons/world/world.hpp"
#include "pons/world/yaml.hpp"

namespace pons::world {

enum class Arms : std::uint8_t { kOne, kSeveral };

// Of several arms without where it stands, which each says for itself.
[[nodiscard]] Robot read_robot(const YamlValue& value, const std::filesystem::path& folder, Arms arms);

// Mouths must not overlap; their resources must be among those of the world.
[[nodiscard]] std::vector<Place> read_places(const YamlValue& value, const std::vector<Resource>& resources);
// One exception chute, one tray, and somewhere to bring parcels to.
void check_destinations(const YamlValue& value, const std::vector<Place>& places);
// From `pick_x_min_m` and `pick_x_max_m`, on the belt.
void read_pick_zone(const YamlMap& map, Belt& belt);
// The stations of the arms, of a world of which all else is there; its places and its pick zone become those of all.
void read_arms(const YamlValue& value, World& world);

[[nodiscard]] Review read_review(const YamlValue& value);

// What stands between two braces of a text there; it throws where that means nothing.
using BetweenBraces = std::function<Piece(const YamlValue& text, std::string_view between)>;
[[nodiscard]] Filling read_filling(const YamlValue& value, const BetweenBraces& between);

// Skills that others serve; what they hold must be among the world's resources.
[[nodiscard]] std::vector<OutsideSkill> read_outside(const YamlValue& value, const std::vector<Resource>& resources);

// How tasks may be asked for in the words of others.
[[nodiscard]] std::vector<Dialect> read_dialects(const YamlValue& value);

// The robot of a world with a base: its two wheels. No tool, no flange, no capsules.
[[nodiscard]] Robot read_wheels(const YamlValue& value, const std::filesystem::path& folder);

// What a world with a base has beside that; `robot` gets what its drives accelerate.
[[nodiscard]] Base read_base(const YamlValue& value, Robot& robot);
[[nodiscard]] std::vector<CameraSpec> read_lidars(const YamlValue& value);
[[nodiscard]] std::vector<Station> read_stations(const YamlValue& value, const Grid& map, const Base& base);

// A name that is new among `taken`.
[[nodiscard]] std::string new_name(const YamlValue& value, std::set<std::string>& taken);

// {position: [x, y, z]} with rpy_deg (about the fixed axes x, y, z in turn), `look: down` (z down, x along world +x) or
// look_at: [x, y, z] (z towards that point, y as far down as it can).
[[nodiscard]] Pose read_pose(const YamlValue& value);

}  // namespace pons::world
