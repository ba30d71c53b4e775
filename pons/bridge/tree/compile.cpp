// Document to Program. What BehaviorTree.CPP finds out while it ticks (a port that is missing, a script that is none, a
// name that means nothing) is found out here.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "pons/bridge/tree/differences.hpp"
#include "pons/bridge/tree/entry_uses.hpp"
#include "pons/bridge/tree/markup.hpp"
#include "pons/bridge/tree/node_kinds.hpp"
#include "pons/bridge/tree/program.hpp"
#include "pons/task/json_text.hpp"

namespace pons::bridge::tree {
namespace {

using task::excerpt;

constexpr std::size_t kMostDepth = 256;  // nodes inside one another, through all SubTrees
constexpr std::size_t kMostPath = 160;   // of a name for people: SubTrees are as deep as that

// FNV-1a (Fowler, Noll, Vo).
void stir(std::uint64_t& hash, std::string_view text) {
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  hash = (hash ^ 0xffU) * 0x100000001b3U;
}

// Of "a/b/c/", only its end where it is long: each node has its own.
std::string shortened(std::string path) {
  if (path.size() <= kMostPath) return path;
  const std::size_t cut = path.find('/', path.size() - kMostPath);
  return "…" + path.substr(std::min(cut, path.size() - 1));
}

class Compiler {
 public:
  Compiler(const Document& document, const task::SkillRegistry& skills, const TreeSize& most)
      : document_(document), skills_(skills), most_(most) {}

  Expected<std::shared_ptr<const Program>> compile(std::string_view main);

 private:
  // A blackboard: of the main tree, or of one SubTree.
  struct Scope {
    std::int32_t parent = -1;
    std::string path;  // "weigh/"
    bool remaps_all = false;
    std::map<std::string, std::string, std::less<>> remaps;
    std::map<std::string, std::int32_t, std::less<>> own;
    // Whether a name that is not its own yet means an entry of another blackboard.
    [[nodiscard]] bool leads_out(std::string_view name) const {
      return name.starts_with('@') || remaps.contains(name) || (remaps_all && !name.starts_with('_'));
    }
  };

  void tell_unset();
  Expected<void> tree(std::string_view id, std::int32_t scope, const std::string& where);
  Expected<void> node(const Element& element, std::int32_t scope);
  Expected<void> subtree(const Element& element, std::int32_t scope);
  Expected<void> give(Scope& inner, std::string_view name, const std::string& value);
  Expected<void> ports(const Element& element, const KindInfo& info, std::int32_t scope, Node& node);
  Expected<Port> port(const Element& element, const PortType& type, const std::string& text, std::int32_t scope,
                      const KindInfo& info, Node& node);
  Expected<void> conditions(const Element& element, std::int32_t scope, Node& node);
  Expected<void> skill(const Element& element, std::int32_t scope, const task::SkillType& type, Node& node);
  Expected<task::Schema> schema_of(const task::SkillType& type, const std::string& where);
  Expected<void> claim(SkillUse& use, const std::string& where);
  Expected<std::int32_t> script(const std::string& text, std::int32_t scope, const std::string& where);
  Expected<std::int32_t> slot(std::int32_t scope, std::string_view name);
  Expected<std::int32_t> slot_of_port(std::int32_t scope, std::string_view name, const std::string& where);
  Expected<void> charge(std::size_t bytes, const std::string& where);
  std::unexpected<Error> unknown(const Element& element) const;

  Scope& at(std::int32_t scope) { return scopes_[static_cast<std::size_t>(scope)]; }

  const Document& document_;
  const task::SkillRegistry& skills_;
  const TreeSize most_;
  Program program_;
  std::vector<Scope> scopes_;
  std::vector<std::string> within_;  // the trees that this one stands in
  std::size_t depth_ = 0;
  Differences::Above above_;
  Differences differences_;
  EntryUses uses_;
  std::map<const task::SkillType*, task::Schema> schemas_;
  std::size_t bytes_ = 0;
};

Expected<std::shared_ptr<const Program>> Compiler::compile(std::string_view main) {
  if (main.empty()) main = document_.main;
  if (main.empty()) {
    return fail("nothing says which of the trees is meant", {}, "name it, or write main_tree_to_execute into <root>");
  }
  program_.fingerprint = 0xcbf29ce484222325U;
  scopes_.emplace_back();
  if (auto done = tree(main, 0, {}); !done) return std::unexpected(done.error());
  program_.root = scopes_[0].own;
  tell_unset();
  differences_.look(uses_);
  program_.differences = differences_.take();
  return std::make_shared<const Program>(std::move(program_));
}

Expected<void> Compiler::tree(std::string_view id, std::int32_t scope, const std::string& where) {
  const auto found = document_.trees.find(id);
  if (found == document_.trees.end()) {
    std::string names;
    for (const auto& [name, root] : document_.trees) names += (names.empty() ? "" : ", ") + excerpt(name, 32);
    return fail(fmt::format("there is no tree '{}'", excerpt(id)), where, "the trees are " + excerpt(names, 300));
  }
  if (std::ranges::find(within_, id) != within_.end())
    return fail(fmt::format("the tree '{}' is in itself", excerpt(id)), where, "use Repeat, or a Loop");
  within_.emplace_back(id);
  auto done = node(found->second, scope);
  within_.pop_back();
  return done;
}

// A long text in a tree that is there a thousand times is a thousand long texts.
Expected<void> Compiler::charge(std::size_t bytes, const std::string& where) {
  bytes_ += bytes;
  if (bytes_ <= most_.bytes) return {};
  return fail(fmt::format("the tree's attributes have more than {} bytes, SubTrees in full", most_.bytes), where,
              "divide it");
}

std::unexpected<Error> Compiler::unknown(const Element& element) const {
  if (const auto why = why_not(element.tag); !why.empty())
    return fail(fmt::format("there is no node '{}' here", element.tag), element.where, std::string(why));
  return fail(fmt::format("'{}' is no node and no skill", excerpt(element.tag)), element.where,
              "pons trees nodes lists the nodes, pons skills the skills");
}

Expected<void> Compiler::node(const Element& element, std::int32_t scope) {
  if (program_.nodes.size() >= most_.nodes)
    return fail(fmt::format("the tree has more than {} nodes", most_.nodes), element.where, "divide it");
  if (depth_ >= kMostDepth)
    return fail(fmt::format("more than {} nodes inside one another", kMostDepth), element.where, "flatten them");
  ++depth_;
  stir(program_.fingerprint, element.tag);
  stir(program_.fingerprint, element.id);
  if (auto fits = charge(element.id.size(), element.where); !fits) return fits;
  for (const auto& [name, value] : element.attributes) {
    stir(program_.fingerprint, name);
    stir(program_.fingerprint, value);
    if (auto fits = charge(name.size() + value.size(), element.where); !fits) return fits;
  }
  const KindInfo* const info = find_kind(element.tag);
  const task::SkillType* const type = info == nullptr ? skills_.find(element.tag) : nullptr;
  if (info == nullptr && type == nullptr) return unknown(element);

  const auto index = program_.nodes.size();
  const std::string* const name = element.attribute("name");
  program_.names.push_back(at(scope).path + excerpt(name != nullptr ? *name : element.tag));
  program_.nodes.push_back({.kind = info != nullptr ? info->kind : Kind::kSkill});
  Node made = program_.nodes.back();
  made.children = static_cast<std::int32_t>(element.children.size());
  differences_.look(element, made.kind, above_);
  above_.count(made.kind, element, 1);
  if (auto done = conditions(element, scope, made); !done) return done;
  const auto fewest = info != nullptr ? info->fewest_children : 0, most = info != nullptr ? info->most_children : 0;
  if (made.children < fewest || made.children > most) {
    const std::string wanted = fewest == most ? fmt::to_string(fewest)
                               : most > 3     ? fmt::format("{} or more", fewest)
                                              : fmt::format("{} or {}", fewest, most);
    return fail(fmt::format("a {} has {} children, this one {}", element.tag, wanted, made.children), element.where,
                "add or remove some");
  }
  Expected<void> done;
  if (type != nullptr) {
    done = skill(element, scope, *type, made);
  } else if (made.kind == Kind::kSubTree) {
    made.children = 1;
    done = subtree(element, scope);
  } else {
    done = ports(element, *info, scope, made);
    for (const Element& child : element.children) {
      if (done) done = node(child, scope);
    }
  }
  --depth_;
  above_.count(made.kind, element, -1);
  made.end = static_cast<std::int32_t>(program_.nodes.size());
  stir(program_.fingerprint, "end");
  program_.nodes[index] = made;
  return done;
}

// ---- blackboards ----

// An entry of the main tree may be given by whoever asks for it; one of a SubTree's own by nobody.
void Compiler::tell_unset() {
  std::map<std::int32_t, std::string_view> roots;
  for (const auto& [name, slot] : program_.root) roots.emplace(slot, name);
  for (const auto& [slot, where] : uses_.unset()) {
    if (const auto root = roots.find(slot); root != roots.end()) {
      program_.needs.emplace_back(root->second);
    } else {
      const std::string& name = program_.entries[static_cast<std::size_t>(slot)].name;
      differences_.add(where, fmt::format("nothing sets '{}', which is read here", excerpt(name, kMostPath)));
    }
  }
}

// As Blackboard::getEntry finds it there: its own entries first, then what was remapped, then, if all is, the parent's.
Expected<std::int32_t> Compiler::slot(std::int32_t scope, std::string_view name) {
  if (name.starts_with('@')) {
    if (name.find('@', 1) != name.npos || name.size() == 1)
      return fail(fmt::format("'{}' is no name of an entry", excerpt(name)));
    return slot(0, name.substr(1));
  }
  if (name.empty()) return fail("an entry has a name");
  Scope& here = at(scope);
  if (const auto own = here.own.find(name); own != here.own.end()) return own->second;
  if (here.leads_out(name)) {
    const auto remapped = here.remaps.find(name);
    const auto found = slot(here.parent, remapped != here.remaps.end() ? std::string_view(remapped->second) : name);
    if (found) here.own.emplace(name, *found);  // the way is long where SubTrees are deep
    return found;
  }
  if (program_.entries.size() >= kMaxSlots)
    return fail(fmt::format("the blackboards have more than {} entries", kMaxSlots));
  const auto made = static_cast<std::int32_t>(program_.entries.size());
  program_.entries.push_back({.name = here.path + std::string(name)});
  here.own.emplace(name, made);
  return made;
}

Expected<std::int32_t> Compiler::slot_of_port(std::int32_t scope, std::string_view name, const std::string& where) {
  auto found = slot(scope, name);
  if (!found) {
    found.error().where = where;
    return found;
  }
  program_.entries[static_cast<std::size_t>(*found)].exists = true;
  return found;
}

Expected<void> Compiler::subtree(const Element& element, std::int32_t scope) {
  Scope inner;
  inner.parent = scope;
  const std::string* const name = element.attribute("name");
  inner.path = shortened(fmt::format("{}{}/", at(scope).path, excerpt(name != nullptr ? *name : element.id)));
  for (const auto& [key, value] : element.attributes) {
    if (key == "name" || key.starts_with('_')) continue;
    if (auto given = give(inner, key, value); !given) return given;
  }
  if (const std::string* const all = element.attribute("_autoremap")) {
    const auto on = boolean_of(*all);
    if (!on) return fail("_autoremap is true or false", element.where, "write one of them");
    inner.remaps_all = number_of(*on) != 0;
  }
  if (const auto model = document_.models.find(element.id); model != document_.models.end() && !inner.remaps_all) {
    for (const ModelPort& port : model->second) {
      if (inner.remaps.contains(port.name) || inner.own.contains(port.name)) continue;
      if (!port.value) {
        return fail(fmt::format("the port '{}' of '{}' is not given", excerpt(port.name), excerpt(element.id)),
                    element.where, "give it, or give it a default in <TreeNodesModel>");
      }
      if (auto fits = charge(port.name.size() + port.value->size(), element.where); !fits) return fits;
      if (auto given = give(inner, port.name, *port.value); !given) return given;
    }
  }
  scopes_.push_back(std::move(inner));
  return tree(element.id, static_cast<std::int32_t>(scopes_.size() - 1), element.where);
}

// A constant is the SubTree's own.
Expected<void> Compiler::give(Scope& inner, std::string_view name, const std::string& value) {
  stir(program_.fingerprint, name);
  stir(program_.fingerprint, value);
  // "=" alone is a port's own name, and to a SubTree a text.
  if (const auto entry = entry_in(value, name); !entry.empty() && value != "=") {
    inner.remaps.emplace(name, entry);
    return {};
  }
  if (program_.entries.size() >= kMaxSlots)
    return fail(fmt::format("the blackboards have more than {} entries", kMaxSlots));
  inner.own.emplace(name, static_cast<std::int32_t>(program_.entries.size()));
  program_.entries.push_back({inner.path + std::string(name), value_of_literal(value), true});
  uses_.constant(static_cast<std::int32_t>(program_.entries.size() - 1), program_.entries.back().initial);
  return {};
}

// ---- what a node is given ----

Expected<std::int32_t> Compiler::script(const std::string& text, std::int32_t scope, const std::string& where) {
  if (!entry_in(text, "").empty())
    return fail("a script that is read from the blackboard is not run", where, "write the script itself");
  auto parsed = Script::parse(text, [&](std::string_view name) -> Expected<int> {
    if (name.contains('.')) return fail(fmt::format("'{}' is no name of an entry", task::excerpt(name)));
    return slot(scope, name);
  });
  if (!parsed) {
    parsed.error().where = where;
    return std::unexpected(parsed.error());
  }
  uses_.by(*parsed, text, where);
  program_.scripts.push_back(*std::move(parsed));
  return static_cast<std::int32_t>(program_.scripts.size() - 1);
}

Expected<void> Compiler::conditions(const Element& element, std::int32_t scope, Node& node) {
  Conditions found;
  bool any = false;
  for (const auto& [name, text] : element.attributes) {
    const auto named = std::ranges::find(condition_names(), name, &ConditionName::name);
    if (named == condition_names().end()) {
      if (auto good = differences_.look_at_attribute(name, element.where); !good) return good;
      continue;
    }
    const auto made = script(text, scope, element.where);
    if (!made) return std::unexpected(made.error());
    found.*named->script = *made;
    any = true;
  }
  if (!any) return {};
  node.conditions = static_cast<std::int32_t>(program_.conditions.size());
  program_.conditions.push_back(found);
  return {};
}

Expected<void> Compiler::ports(const Element& element, const KindInfo& info, std::int32_t scope, Node& node) {
  for (const auto& [name, text] : element.attributes) {
    const bool known = std::ranges::find(info.ports, name, &PortType::name) != info.ports.end();
    if (!known && name != "name" && !name.starts_with('_'))
      return fail(fmt::format("a {} has no port '{}'", info.name, excerpt(name)), element.where,
                  "pons trees nodes shows its ports");
  }
  std::vector<Port> made;
  for (const PortType& type : info.ports) {
    const std::string* const given = element.attribute(type.name);
    if (given == nullptr && type.standard.empty()) {
      if (type.need == PortType::Need::kMust)
        return fail(fmt::format("the port '{}' of this {} is missing", type.name, info.name), element.where, "add it");
      made.emplace_back();
      continue;
    }
    const auto read = port(element, type, given != nullptr ? *given : std::string(type.standard), scope, info, node);
    if (!read) return std::unexpected(read.error());
    made.push_back(*read);
  }
  if (node.kind == Kind::kSetBlackboard) uses_.set_to(made[1].slot, made[0], element.where);
  node.ports = static_cast<std::int32_t>(program_.ports.size());
  program_.ports.insert(program_.ports.end(), made.begin(), made.end());
  return {};
}

Expected<Port> Compiler::port(const Element& element, const PortType& type, const std::string& text, std::int32_t scope,
                              const KindInfo& info, Node& node) {
  using Of = PortType::Of;
  const std::string_view entry = entry_in(text, type.name);
  const auto wrong = [&](std::string_view what) {
    return fail(fmt::format("the port '{}' of this {} is '{}': {}", type.name, info.name, excerpt(text), what),
                element.where, "pons trees nodes shows its ports");
  };
  if (type.of == Of::kScript) {
    const auto made = script(text, scope, element.where);
    if (!made) return std::unexpected(made.error());
    node.index = *made;
    return Port{};
  }
  if (type.of == Of::kKey) {
    if (node.kind == Kind::kSetBlackboard && !entry.empty()) return wrong("write the entry's name without braces");
    const auto found = slot(scope, entry.empty() ? std::string_view(text) : entry);
    if (!found) return wrong(found.error().what);
    if (!entry.empty()) program_.entries[static_cast<std::size_t>(*found)].exists = true;
    if (node.kind == Kind::kUnsetBlackboard) {
      differences_.look_at_key(element, !entry.empty(), at(scope).leads_out(text));
    } else if (!entry.empty()) {
      uses_.watch(*found);
    }
    return Port{.slot = *found};
  }
  if (type.of == Of::kQueue) {
    Loop loop{.of = info.loop, .fixed = {}};
    if (entry.empty()) loop.fixed = queue_of(text, info.loop);
    if (entry.empty() && !loop.fixed) return wrong("no values of this Loop's type, apart by ';'");
    node.index = static_cast<std::int32_t>(program_.loops.size());
    program_.loops.push_back(std::move(loop));
  }
  if (!entry.empty()) {
    if (type.of == Of::kBoolean || type.of == Of::kStatus) return wrong("it must be a constant");
    const auto found = slot_of_port(scope, entry, element.where);
    if (!found) return std::unexpected(found.error());
    uses_.port(*found, type, info.loop, element.where);
    return Port{.slot = *found};
  }
  Port made;
  std::optional<Value> value = Value(text);
  if (type.of == Of::kInteger || type.of == Of::kUnsigned) {
    const auto integer = integer_of(*value);
    const bool fits = integer && *integer >= (type.of == Of::kUnsigned ? 0 : INT32_MIN) && *integer <= INT32_MAX;
    value = fits ? std::optional<Value>(*integer) : std::nullopt;
  } else if (type.of == Of::kBoolean) {
    value = boolean_of(text);
  } else if (type.of == Of::kStatus) {
    value = status_of(text);
  } else if (type.of == Of::kOut) {
    return wrong("write the entry to write to, in braces");
  }
  if (!value) return wrong("it cannot be read");
  if (node.kind == Kind::kTryCatch && number_of(*value) != 0)
    return wrong("what is halted leaves the world safe by itself here; write false");
  made.literal = *std::move(value);
  return made;
}

// ---- skills ----

Expected<void> Compiler::skill(const Element& element, std::int32_t scope, const task::SkillType& type, Node& node) {
  SkillUse use;
  use.type = &type;
  use.name = program_.names.back();
  const auto schema = schema_of(type, element.where);
  if (!schema) return std::unexpected(schema.error());
  static const Json kNone = Json::object();
  const auto given = type.schema.find("properties");
  const Json& properties = given == type.schema.end() ? kNone : *given;
  for (const auto& [name, text] : element.attributes) {
    if (name == "name" || name.starts_with('_')) continue;
    const std::string_view entry = entry_in(text, name);
    const bool is_output = std::ranges::find(type.outputs, name) != type.outputs.end();
    if (!is_output && !properties.contains(name)) {
      return fail(fmt::format("the skill '{}' has no port '{}'", type.name, excerpt(name)), element.where,
                  fmt::format("pons skills {} shows its ports", type.name));
    }
    if (is_output && entry.empty()) {
      return fail(fmt::format("the output '{}' of '{}' is a constant", name, type.name), element.where,
                  "write the entry to write to, in braces");
    }
    if (entry.empty()) {
      auto value = argument_of(Value(text), properties.at(name));
      if (!value) {
        return fail(fmt::format("the port '{}' of '{}': {}", name, type.name, value.error().what), element.where,
                    value.error().mend);
      }
      use.arguments[name] = *std::move(value);
      continue;
    }
    const auto found = slot_of_port(scope, entry, element.where);
    if (!found) return std::unexpected(found.error());
    if (is_output) {
      use.outputs.push_back({name, *found});
      uses_.output(*found);
    } else {
      uses_.argument(*found, properties.at(name), element.where);
      use.bound.push_back({name, properties.at(name), *found});
    }
  }
  if (use.bound.empty()) {
    if (auto fits = schema->check(use.arguments); !fits)
      return fail(fits.error().line(), element.where, fmt::format("pons skills {} shows its ports", type.name));
  } else {
    use.schema = *schema;
  }
  if (auto claimed = claim(use, element.where); !claimed) return claimed;
  node.index = static_cast<std::int32_t>(program_.uses.size());
  program_.uses.push_back(std::move(use));
  return {};
}

// Compiled once for a tree that uses it a thousand times.
Expected<task::Schema> Compiler::schema_of(const task::SkillType& type, const std::string& where) {
  const auto known = schemas_.find(&type);
  if (known != schemas_.end()) return known->second;
  auto schema = task::Schema::compile(type.schema);
  if (!schema) {
    return fail(fmt::format("the skill '{}' cannot be used: {}", type.name, schema.error().line()), where,
                "mend the skill");
  }
  return schemas_.emplace(&type, *std::move(schema)).first->second;
}

Expected<void> Compiler::claim(SkillUse& use, const std::string& where) {
  for (const std::string& resource : use.type->resources) {
    auto& all = program_.resources;
    const auto found = std::ranges::find(all, resource) - all.begin();
    if (found >= 64) return fail("its skills need more than 64 resources", where, "divide it");
    if (found == std::ssize(all)) all.push_back(resource);
    use.resources |= std::uint64_t{1} << found;
  }
  return {};
}

}  // namespace

Expected<std::shared_ptr<const Program>> compile(const Document& document, std::string_view main,
                                                 const task::SkillRegistry& skills, const TreeSize& most) {
  return Compiler(document, skills, most).compile(main);
}

}  // namespace pons::bridge::tree
