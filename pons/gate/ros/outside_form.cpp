#include "pons/gate/ros/outside_form.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "pons/gate/ros/names.hpp"

namespace pons::gate::ros {
namespace {

using wire::Json;
using world::Filling;
using world::OutsideArgument;
using world::Piece;

// ---- arguments ----

task::Json schema_of(const OutsideArgument& argument) {
  using Kind = OutsideArgument::Kind;
  switch (argument.kind) {
    case Kind::kNumber:
    case Kind::kInteger:
      return {{"type", argument.kind == Kind::kNumber ? "number" : "integer"},
              {"minimum", argument.minimum},
              {"maximum", argument.maximum}};
    case Kind::kText:
      if (!argument.choices.empty()) return {{"enum", argument.choices}};
      return {{"type", "string"}, {"maxLength", 1000}};
    case Kind::kBoolean:
      break;
  }
  return {{"type", "boolean"}};
}

task::Json preset_of(const OutsideArgument& argument) {
  const auto value = [&](const auto& preset) -> task::Json {
    if constexpr (std::is_same_v<std::decay_t<decltype(preset)>, double>) {
      if (argument.kind == OutsideArgument::Kind::kInteger) return static_cast<std::int64_t>(preset);
    }
    return preset;
  };
  return std::visit(value, *argument.preset);
}

// Some value that it may have, no whole one where it need not be whole.
task::Json sample_of(const OutsideArgument& argument) {
  if (argument.preset) return preset_of(argument);
  switch (argument.kind) {
    case OutsideArgument::Kind::kNumber:
      return std::clamp(0.5, argument.minimum, argument.maximum);
    case OutsideArgument::Kind::kInteger:
      return static_cast<std::int64_t>(std::clamp(1.0, argument.minimum, argument.maximum));
    case OutsideArgument::Kind::kText:
      return argument.choices.empty() ? "x" : argument.choices.front();
    case OutsideArgument::Kind::kBoolean:
      break;
  }
  return true;
}

// ---- what is filled in ----

Json literal(const std::string& word) {
  if (word == "true" || word == "yes") return true;
  if (word == "false" || word == "no") return false;
  const char* const end = word.data() + word.size();
  std::int64_t whole = 0;
  if (const auto [read, error] = std::from_chars(word.data(), end, whole); error == std::errc() && read == end)
    return whole;
  double real = 0;
  if (const auto [read, error] = std::from_chars(word.data(), end, real);
      error == std::errc() && read == end && std::isfinite(real))
    return real;
  return word;
}

Json filled(const Filling& filling, const task::Json& arguments) {
  switch (filling.kind) {
    case Filling::Kind::kWord:
      return literal(filling.word);
    case Filling::Kind::kMembers: {
      Json object = Json::object();
      for (const Filling& member : filling.parts) object[member.name] = filled(member, arguments);
      return object;
    }
    case Filling::Kind::kElements: {
      Json list = Json::array();
      for (const Filling& element : filling.parts) list.push_back(filled(element, arguments));
      return list;
    }
    case Filling::Kind::kText:
      break;
  }
  const Piece& first = filling.pieces.front();
  if (first.kind == Piece::Kind::kQuaternion) {
    const double half_rad = 0.5 * arguments.at(first.text).get<double>();
    return {{"x", 0.0}, {"y", 0.0}, {"z", std::sin(half_rad)}, {"w", std::cos(half_rad)}};
  }
  if (filling.pieces.size() == 1 && first.kind == Piece::Kind::kArgument) return Json(arguments.at(first.text));
  std::string text;
  for (const Piece& piece : filling.pieces) {
    const task::Json value = piece.kind == Piece::Kind::kText ? task::Json(piece.text) : arguments.at(piece.text);
    text += value.is_string() ? value.get<std::string>() : value.dump();
  }
  return text;
}

// Where what an error's way leads to stands in the file: as near as the file comes.
std::string place_of(const Filling& message, std::string_view way) {
  const Filling* at = &message;
  while (!way.empty()) {
    const std::size_t end = std::min(way.find_first_of(".[", 1), way.size());
    std::string_view step = way.substr(0, end);
    way.remove_prefix(end);
    const Filling* next = nullptr;
    if (step.starts_with('[')) {
      std::size_t index = 0;
      std::from_chars(step.data() + 1, step.data() + step.size(), index);
      if (index < at->parts.size()) next = &at->parts[index];
    } else {
      if (step.starts_with('.')) step.remove_prefix(1);
      const auto found = std::ranges::find(at->parts, step, &Filling::name);
      if (found != at->parts.end()) next = &*found;
    }
    if (next == nullptr) break;
    at = next;
  }
  return at->where;
}

// ---- fields of what comes back ----

// "a.b" of a message; nullptr: there is none.
const Json* field(const Json& message, std::string_view way) {
  const Json* at = &message;
  while (true) {
    const std::size_t dot = way.find('.');
    const auto found = at->is_object() ? at->find(way.substr(0, dot)) : at->end();
    if (!at->is_object() || found == at->end()) return nullptr;
    at = &*found;
    if (dot == way.npos) return at;
    way.remove_prefix(dot + 1);
  }
}

Expected<void> check_field(const Json& message, const world::Placed& wanted, Json::value_t type, const char* called) {
  const Json* const found = field(message, wanted.text);
  if (found == nullptr) {
    std::vector<std::string> names;
    for (const auto& [name, value] : message.items()) names.push_back(name);
    return fail(fmt::format("there is no field '{}'", wanted.text), wanted.where,
                names.empty() ? "what comes back has none" : fmt::format("there are {}", fmt::join(names, ", ")));
  }
  if (type != Json::value_t::null && found->type() != type)
    return fail(fmt::format("'{}' is {}", wanted.text, found->type_name()), wanted.where,
                fmt::format("name a field that is {}", called));
  return {};
}

constexpr std::string_view kGoal = "goal.";

}  // namespace

Expected<OutsideForm> OutsideForm::compile(const world::OutsideSkill& skill, wire::InterfaceTypes& types) {
  OutsideForm form(skill);
  if (auto name = expanded(skill.server.text, {"/", "pons"}, {}); !name)
    return fail(name.error().what, skill.server.where, name.error().mend);
  if (auto found = form.find_types(types); !found) return std::unexpected(found.error());
  if (auto good = form.check_fields(); !good) return std::unexpected(good.error());
  return form;
}

Expected<void> OutsideForm::find_types(wire::InterfaceTypes& types) {
  const auto& [type, where] = skill_.type;
  const std::string_view kind = acts() ? "/action/" : "/srv/";
  const std::size_t at = type.find(kind);
  if (at == type.npos || at == 0 || type.find('/', at + kind.size()) != type.npos)
    return fail(fmt::format("'{}' is no {}'s type", type, acts() ? "action" : "service"), where,
                fmt::format("write PACKAGE{}NAME", kind));
  using Found = std::pair<wire::KnownType*, const char*>;
  const std::vector<Found> parts = acts() ? std::vector<Found>{{&request_, "_SendGoal_Request"},
                                                               {&decision_, "_SendGoal_Response"},
                                                               {&ask_, "_GetResult_Request"},
                                                               {&reply_, "_GetResult_Response"},
                                                               {&feedback_, "_FeedbackMessage"}}
                                          : std::vector<Found>{{&request_, "_Request"}, {&reply_, "_Response"}};
  for (const auto& [found, part] : parts) {
    if (const wire::KnownType* const built = wire::known_type(type + part)) {
      *found = *built;
      continue;
    }
    auto read = types.type(type + part);
    if (!read)
      return fail(read.error().what, read.error().where.empty() ? where : read.error().where, read.error().mend);
    *found = *std::move(read);
  }
  return {};
}

// With some arguments: what is wrong whatever they are, is wrong with these.
Expected<void> OutsideForm::check_fields() const {
  task::Json sample = task::Json::object();
  for (const OutsideArgument& argument : skill_.arguments) sample[argument.name] = sample_of(argument);
  if (const auto bytes = request_.to_cdr(message(sample, {})); !bytes) {
    std::string_view way = bytes.error().where;
    if (acts() && way.starts_with(kGoal)) way.remove_prefix(kGoal.size());
    return fail(fmt::format("{}{}{}", way, way.empty() ? "" : " ", bytes.error().what), place_of(skill_.message, way),
                bytes.error().mend);
  }
  const Json result = empty_result();
  if (skill_.success) {
    if (auto good = check_field(result, *skill_.success, Json::value_t::boolean, "true or false"); !good) return good;
  }
  if (skill_.reason) {
    if (auto good = check_field(result, *skill_.reason, Json::value_t::string, "a text"); !good) return good;
  }
  if (!skill_.told) return {};
  const Json told = feedback_.empty().at("feedback");
  for (const world::Placed& wanted : *skill_.told) {
    if (auto good = check_field(told, wanted, Json::value_t::null, ""); !good) return good;
  }
  return {};
}

wire::Json OutsideForm::message(const task::Json& arguments, const GoalId& id) const {
  task::Json all = arguments;
  for (const OutsideArgument& argument : skill_.arguments) {
    // Of a tree's use not all may be known yet.
    if (!all.contains(argument.name)) all[argument.name] = argument.preset ? preset_of(argument) : sample_of(argument);
  }
  Json filling = filled(skill_.message, all);
  if (!acts()) return filling;
  return {{"goal_id", {{"uuid", id}}}, {"goal", std::move(filling)}};
}

wire::Json OutsideForm::empty_result() const {
  const Json whole = reply_.empty();
  return acts() ? whole.at("result") : whole;
}

ServiceTypes OutsideForm::service_types() const { return {request_.name, request_.hash, reply_.name, reply_.hash}; }

ActionTypes OutsideForm::action_types() const {
  return {.send_goal = {request_.name, request_.hash, decision_.name, decision_.hash},
          .get_result = {ask_.name, ask_.hash, reply_.name, reply_.hash},
          .feedback = feedback_.name,
          .feedback_hash = feedback_.hash};
}

task::Json OutsideForm::schema() const {
  task::Json properties = task::Json::object(), required = task::Json::array();
  for (const OutsideArgument& argument : skill_.arguments) {
    properties[argument.name] = schema_of(argument);
    if (argument.preset) {
      properties[argument.name]["default"] = preset_of(argument);
    } else {
      required.push_back(argument.name);
    }
  }
  return {{"type", "object"},
          {"properties", std::move(properties)},
          {"required", std::move(required)},
          {"additionalProperties", false}};
}

std::vector<std::string> OutsideForm::outputs() const {
  std::vector<std::string> names;
  const Json result = empty_result();
  for (const auto& [name, value] : result.items()) names.push_back(name);
  return names;
}

Expected<std::vector<std::byte>> OutsideForm::request(const task::Json& arguments, const GoalId& id) const {
  auto bytes = request_.to_cdr(message(arguments, id));
  if (!bytes) return std::unexpected(bytes.error());
  bytes->insert(bytes->begin(), kHeaderRoom, std::byte{});
  return bytes;
}

Expected<OutsideForm::Reply> OutsideForm::reply(std::span<const std::byte> cdr) const {
  const auto whole = reply_.to_json(cdr);
  if (!whole) return std::unexpected(whole.error());
  const Json result = acts() ? whole->at("result") : *whole;
  Reply reply{.result = task::Json(result)};
  if (skill_.success) reply.success = field(result, skill_.success->text)->get<bool>();
  if (skill_.reason) reply.reason = field(result, skill_.reason->text)->get<std::string>();
  return reply;
}

Expected<task::Json> OutsideForm::feedback(std::span<const std::byte> cdr) const {
  const auto whole = feedback_.to_json(cdr);
  if (!whole) return std::unexpected(whole.error());
  const Json& all = whole->at("feedback");
  if (!skill_.told) return task::Json(all);
  task::Json kept = task::Json::object();
  for (const world::Placed& wanted : *skill_.told) kept[wanted.text] = task::Json(*field(all, wanted.text));
  return kept;
}

}  // namespace pons::gate::ros
