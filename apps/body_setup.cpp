#include "apps/body_setup.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

namespace pons::apps {
namespace {

constexpr double kLongest_s = 1e6, kFurthest_rad = 100;

std::optional<double> number(std::string_view text, double low, double high) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value >= low) || !(value <= high)) return {};
  return value;
}

Expected<sim::Visit> visit_of(std::string_view text, const world::World& world) {
  const std::size_t at = text.rfind('@'), plus = at == std::string_view::npos ? at : text.find('+', at);
  const auto bad = [&] {
    return fail("is no visit", fmt::format("--visit {}", text), "write ZONE@FROM+FOR, in seconds");
  };
  if (plus == std::string_view::npos) return bad();
  const auto from_time = number(text.substr(at + 1, plus - at - 1), 0, kLongest_s);
  const auto stays = number(text.substr(plus + 1), 0, kLongest_s);
  if (!from_time || !stays || *stays == 0) return bad();
  const auto zone = std::ranges::find(world.zones, text.substr(0, at), &world::Zone::name);
  if (zone == world.zones.end()) {
    std::vector<std::string> names;
    for (const world::Zone& known : world.zones) names.push_back(known.name);
    return fail(fmt::format("there is no zone '{}' in {}", text.substr(0, at), world.name),
                fmt::format("--visit {}", text),
                names.empty() ? "that world has no zones" : fmt::format("choose from {}", fmt::join(names, ", ")));
  }
  return sim::Visit{static_cast<std::size_t>(zone - world.zones.begin()), Time(from_s(*from_time)), from_s(*stays)};
}

Expected<AxisVector> arm_at(const std::string& text, const world::World& world) {
  const Eigen::Index axes = world.robot.home.size();
  AxisVector position = AxisVector::Zero(axes);
  std::string_view rest = text;
  for (Eigen::Index i = 0; i < axes; ++i) {
    const std::size_t comma = rest.find(',');
    const auto value = number(rest.substr(0, comma), -kFurthest_rad, kFurthest_rad);
    const bool last = comma == std::string_view::npos;
    if (!value || last != (i + 1 == axes))
      return fail("is no place for the arm", "--arm-at " + text,
                  fmt::format("write {} numbers with commas between, in rad", axes));
    position[i] = *value;
    rest = last ? std::string_view{} : rest.substr(comma + 1);
  }
  return position;
}

}  // namespace

void add_body_setup_options(CLI::App& command, BodySetupOptions& options) {
  command.add_option("--visit", options.visits,
                     "ZONE@FROM+FOR: somebody is in that zone from then on, for so long (s)");
  command.add_option("--arm-at", options.arm_at, "Where the arm is found: an angle an axis, rad, with commas (home)");
  add_faults_option(command, options.faults);
}

void add_faults_option(CLI::App& command, std::string& faults) {
  command.add_option("--faults", faults,
                     "What goes wrong: none, a plan of a folder faults (of the world's own or the one beside the "
                     "worlds), or a file (none)");
}

Expected<BodySetup> body_setup(const BodySetupOptions& options, std::uint64_t seed, const world::World& world) {
  BodySetup setup{.seed = seed};
  auto faults = world::load_faults(world, options.faults);
  if (!faults) return std::unexpected(faults.error());
  setup.faults = std::move(*faults);
  for (const std::string& text : options.visits) {
    const auto visit = visit_of(text, world);
    if (!visit) return std::unexpected(visit.error());
    setup.visits.push_back(*visit);
  }
  if (options.arm_at.empty()) return setup;
  if (world.arms().size() > 1)
    return fail("says where one arm is found", "--arm-at " + options.arm_at,
                fmt::format("leave it out: {} has {} arms", world.name, world.arms().size()));
  const auto position = arm_at(options.arm_at, world);
  if (!position) return std::unexpected(position.error());
  setup.arm_at = *position;
  return setup;
}

}  // namespace pons::apps
