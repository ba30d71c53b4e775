// pons worlds, pons skills, pons completion: what there is.

#include <fmt/format.h>

#include "apps/cell_skills.hpp"
#include "apps/commands.hpp"
#include "apps/paths.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {
namespace {

int worlds() {
  const auto folder = worlds_folder();
  const std::vector<std::string> names = world::list(folder);
  if (names.empty()) return bad_input({"no worlds", folder.string(), "set PONS_WORLDS to a folder of worlds"});
  int code = kExitGood;
  for (const std::string& name : names) {
    const auto world = world::load(folder, name);
    if (!world) {
      fmt::print("{:<20} broken: {}\n", name, world.error().line());
      code = kExitBadInput;
      continue;
    }
    if (world->base) {
      fmt::print("{:<20} {} (base, {:.1f} m/s), {} stations, a map of {:.0f} by {:.0f} m\n", name, world->robot.name,
                 world->base->speed_m_s, world->base->stations.size(), world->map->width() * world->map->resolution_m(),
                 world->map->height() * world->map->resolution_m());
      continue;
    }
    std::size_t chutes = 0;
    for (const world::Place& place : world->places) chutes += place.kind == world::PlaceKind::kChute ? 1 : 0;
    const std::size_t arms = world->arms().size();
    fmt::print("{:<20} {}{} ({} axes), {} chutes, {} cameras\n", name,
               arms > 1 ? fmt::format("{} times ", arms) : std::string(), world->robot.name, world->robot.home.size(),
               chutes, world->cameras.size());
  }
  return code;
}

int skills(const std::string& name, const std::string& world_name) {
  const auto cell = CellSkills::make(world_name);
  if (!cell) return bad_input(cell.error());
  const task::SkillRegistry& registry = (*cell)->registry;
  if (name.empty()) {
    for (const auto& [skill_name, type] : registry.all()) fmt::print("{:<17} {}\n", skill_name, type.summary);
    return kExitGood;
  }
  const task::SkillType* type = registry.find(name);
  if (type == nullptr)
    return bad_input({"no skill '" + name + "'", "pons skills", "pons skills lists those there are"});
  fmt::print(
      "{}: {}\nholds: {}\ntimeout: {:.0f} s, attempts: {}\npauses: {}\noutputs for trees: {}\narguments in {}:\n{}\n",
      type->name, type->summary,
      type->resources.empty() ? "nothing" : fmt::format("{}", fmt::join(type->resources, ", ")), to_s(type->timeout),
      type->attempts, fmt::join(type->safe_points, "; or "),
      type->outputs.empty() ? "none" : fmt::format("{}", fmt::join(type->outputs, ", ")), (*cell)->world.name,
      type->schema.dump(2));
  return kExitGood;
}

// What a command takes it says itself, in its help.
constexpr const char* kBash = R"bash(_pons_words() {
  pons "$@" --help 2>/dev/null | sed -nE 's/^  (-[a-z],)?(-?-?[a-z][a-z-]*).*/\2/p'
}
_pons() {
  local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command=${COMP_WORDS[1]}
  local -a asked=()
  case $before in
    --world) COMPREPLY=($(compgen -W "$(pons worlds 2>/dev/null | cut -d' ' -f1)" -- "$current")); return ;;
    --manifest|--journal|--report|--log|--picture|--socket|--out|--merge|submit|check|compact|upgrade) COMPREPLY=($(compgen -f -- "$current")); return ;;
    run|sweep|body|bridge) COMPREPLY=($(compgen -W "$(pons worlds 2>/dev/null | cut -d' ' -f1)" -- "$current")); return ;;
    skills) COMPREPLY=($(compgen -W "$(pons skills 2>/dev/null | cut -d' ' -f1)" -- "$current")); return ;;
    completion) COMPREPLY=($(compgen -W "bash zsh" -- "$current")); return ;;
  esac
  case $command in
    task|robot|journal|book) asked=("${COMP_WORDS[@]:1:$((COMP_CWORD < 3 ? COMP_CWORD - 1 : 2))}") ;;
    *) asked=("${COMP_WORDS[@]:1:$((COMP_CWORD < 2 ? 0 : 1))}") ;;
  esac
  COMPREPLY=($(compgen -W "$(_pons_words "${asked[@]}")" -- "$current"))
}
complete -F _pons pons
)bash";

}  // namespace

void add_worlds(CLI::App& app, Chosen& chosen) {
  app.add_subcommand("worlds", "List the worlds")->callback([&chosen] { chosen = worlds; });
}

void add_skills(CLI::App& app, Chosen& chosen) {
  auto name = std::make_shared<std::string>(), world = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("skills", "List the skills, or describe one");
  command->add_option("skill", *name, "Describe this one: its arguments, timeout, resources");
  command->add_option("--world", *world, "Of this world, where places are concerned (the first)");
  command->callback([name, world, &chosen] { chosen = [name, world] { return skills(*name, *world); }; });
}

void add_completion(CLI::App& app, Chosen& chosen) {
  auto shell = std::make_shared<std::string>("bash");
  CLI::App* command = app.add_subcommand("completion", "Print shell completion: eval \"$(pons completion bash)\"");
  command->add_option("shell", *shell, "bash or zsh")->check(CLI::IsMember({"bash", "zsh"}));
  command->callback([shell, &chosen] {
    chosen = [shell] {
      if (*shell == "zsh") fmt::print("autoload -U +X bashcompinit && bashcompinit\n");
      fmt::print("{}", kBash);
      return kExitGood;
    };
  });
}

}  // namespace pons::apps
