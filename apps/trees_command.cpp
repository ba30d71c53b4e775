// pons trees: what trees a world has, what they may be made of, and whether one can run.

#include <fmt/format.h>

#include <memory>
#include <string>

#include "apps/cell_skills.hpp"
#include "apps/commands.hpp"
#include "pons/bridge/tree/library.hpp"
#include "pons/bridge/tree/node_kinds.hpp"

namespace pons::apps {
namespace {

namespace tree = bridge::tree;

void describe(const std::string& name, const tree::Program& program) {
  std::string skills, entries, needs;
  for (const tree::SkillUse& use : program.uses) {
    if (skills.find(use.type->name) == skills.npos) skills += (skills.empty() ? "" : ", ") + use.type->name;
  }
  for (const auto& [entry, slot] : program.root) entries += (entries.empty() ? "" : ", ") + entry;
  for (const std::string& entry : program.needs) needs += (needs.empty() ? "; to be given: " : ", ") + entry;
  fmt::print("{:<14} {} nodes; skills: {}; blackboard: {}{}\n", name, program.nodes.size(),
             skills.empty() ? "none" : skills, entries.empty() ? "nothing" : entries, needs);
  for (const std::string& difference : program.differences) fmt::print("  {}\n", difference);
}

int list(const std::string& world) {
  const auto cell = CellSkills::make(world);
  if (!cell) return bad_input(cell.error());
  tree::Library library((*cell)->registry);
  if (auto loaded = library.load((*cell)->world.folder / "trees"); !loaded) return bad_input(loaded.error());
  if (library.names().empty()) fmt::print("the world {} has no trees\n", (*cell)->world.name);
  for (const std::string& name : library.names()) describe(name, *library.find(name));
  return kExitGood;
}

int check(const std::string& file, const std::string& world) {
  const auto cell = CellSkills::make(world);
  if (!cell) return bad_input(cell.error());
  const auto document = tree::read_document(std::filesystem::path(file));
  if (!document) return bad_input(document.error());
  for (const auto& [name, root] : document->trees) {
    const auto program = tree::compile(*document, name, (*cell)->registry);
    if (!program) return bad_input(program.error());
    describe(name, **program);
  }
  return kExitGood;
}

std::string_view type_name(tree::PortType::Of of) {
  using Of = tree::PortType::Of;
  switch (of) {
    case Of::kInteger:
      return "integer";
    case Of::kUnsigned:
      return "integer from 0";
    case Of::kText:
    case Of::kValue:
      return "any value";
    case Of::kQueue:
      return "values apart by ';'";
    case Of::kBoolean:
      return "true or false";
    case Of::kStatus:
      return "SUCCESS, FAILURE or SKIPPED";
    case Of::kScript:
      return "script";
    case Of::kKey:
      return "name of an entry";
    case Of::kOut:
      return "{entry} that is written";
  }
  return "";
}

int nodes() {
  for (const tree::KindInfo& kind : tree::all_kinds()) {
    fmt::print("{}\n", kind.name);
    for (const tree::PortType& port : kind.ports) {
      const std::string standard = !port.standard.empty()                    ? fmt::format(" [{}]", port.standard)
                                   : port.need == tree::PortType::Need::kMay ? " [none]"
                                                                             : "";
      fmt::print("    {:<14} {}{}\n", port.name, type_name(port.of), standard);
    }
  }
  return kExitGood;
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '&') {
      result += "&amp;";
    } else if (c == '<') {
      result += "&lt;";
    } else if (c == '"') {
      result += "&quot;";
    } else {
      result += c;
    }
  }
  return result;
}

// The skills as Groot2 wants to know them, to be drawn with.
int model(const std::string& world) {
  const auto cell = CellSkills::make(world);
  if (!cell) return bad_input(cell.error());
  fmt::print("<root BTCPP_format=\"4\">\n  <TreeNodesModel>\n");
  for (const auto& [name, type] : (*cell)->registry.all()) {
    fmt::print("    <Action ID=\"{}\">\n", name);
    const task::Json properties = type.schema.value("properties", task::Json::object());
    for (const auto& [port, schema] : properties.items()) {
      const std::string about = task::text_of(schema, "description");
      fmt::print("      <input_port name=\"{}\">{}</input_port>\n", port, escaped(about));
    }
    for (const std::string& port : type.outputs) fmt::print("      <output_port name=\"{}\"/>\n", port);
    fmt::print("    </Action>\n");
  }
  fmt::print("  </TreeNodesModel>\n</root>\n");
  return kExitGood;
}

}  // namespace

void add_trees(CLI::App& app, Chosen& chosen) {
  auto world = std::make_shared<std::string>(), file = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("trees", "Behaviour trees: a world's own; check, draw and look things up");
  const auto of_world = [&](CLI::App* sub) {
    sub->add_option("--world", *world, "The world with these skills (the first)");
  };
  of_world(command);
  CLI::App* check_one = command->add_subcommand("check", "Say whether the trees of a file can run");
  check_one->add_option("file", *file, "BehaviorTree.CPP 4 XML, as Groot2 writes it")->required();
  of_world(check_one);
  CLI::App* draw = command->add_subcommand("model", "Print the skills as Groot2's palette (TreeNodesModel)");
  of_world(draw);
  CLI::App* kinds = command->add_subcommand("nodes", "List the nodes that are built in, with their ports");
  command->require_subcommand(0, 1);
  command->callback([=, &chosen] {
    if (check_one->parsed()) {
      chosen = [file, world] { return check(*file, *world); };
    } else if (draw->parsed()) {
      chosen = [world] { return model(*world); };
    } else if (kinds->parsed()) {
      chosen = nodes;
    } else {
      chosen = [world] { return list(*world); };
    }
  });
}

}  // namespace pons::apps
