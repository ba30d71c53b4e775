#include "pons/wire/interface_types.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <boost/hash2/sha2.hpp>
#include <utility>

#include "pons/wire/dynamic.hpp"
#include "pons/wire/from_json.hpp"

namespace pons::wire {
namespace {

// "std_srvs/srv/SetBool" of "std_srvs/srv/SetBool_Request": no interface's own name has a '_'.
std::string interface_of(std::string_view name) {
  const std::size_t slash = name.rfind('/');
  return std::string(name.substr(0, slash == name.npos ? slash : name.find('_', slash)));
}

template <typename T>
DynamicValue blank_value(const FieldType& type, T one = {}) {
  if (type.count == FieldCount::kOne) return {std::move(one)};
  if (type.count == FieldCount::kArray) return {Fixed<T>(type.elements, one)};
  return {std::vector<T>()};
}

DynamicValue blank_value(const FieldType& type, const std::shared_ptr<const DynamicMessage>& nested) {
  switch (type.base) {
    case FieldBase::kBool:
      return blank_value<bool>(type);
    case FieldBase::kInt8:
      return blank_value<std::int8_t>(type);
    case FieldBase::kByte:
    case FieldBase::kUint8:
      return blank_value<std::uint8_t>(type);
    case FieldBase::kInt16:
      return blank_value<std::int16_t>(type);
    case FieldBase::kUint16:
      return blank_value<std::uint16_t>(type);
    case FieldBase::kInt32:
      return blank_value<std::int32_t>(type);
    case FieldBase::kUint32:
      return blank_value<std::uint32_t>(type);
    case FieldBase::kInt64:
      return blank_value<std::int64_t>(type);
    case FieldBase::kUint64:
      return blank_value<std::uint64_t>(type);
    case FieldBase::kFloat32:
      return blank_value<float>(type);
    case FieldBase::kFloat64:
      return blank_value<double>(type);
    case FieldBase::kString:
      return blank_value<std::string>(type);
    case FieldBase::kNested:
      break;
  }
  if (type.count == FieldCount::kOne) return {*nested};
  if (type.count == FieldCount::kArray) return {Fixed<DynamicMessage>(type.elements, *nested)};
  return {DynamicSequence(nested)};
}

// ---- REP-2011 ----

std::string described(const FieldLine& field) {
  const FieldType& type = field.type;
  constexpr int kBoundedString = 21;
  const int element = type.most_chars > 0 ? kBoundedString : static_cast<int>(type.base);
  return fmt::format(
      R"({{"name": "{}", "type": {{"type_id": {}, "capacity": {}, "string_capacity": {}, "nested_type_name": "{}"}}}})",
      field.name, element + static_cast<int>(type.count), type.elements, type.most_chars, type.nested);
}

std::string described(const MessageLines& message) {
  std::vector<std::string> fields;
  for (const FieldLine& field : message.fields) fields.push_back(described(field));
  return fmt::format(R"({{"type_name": "{}", "fields": [{}]}})", message.name, fmt::join(fields, ", "));
}

std::string hash_of(const std::string& described, const std::map<std::string, std::string, std::less<>>& refers_to) {
  std::vector<std::string_view> referred;
  for (const auto& [name, text] : refers_to) referred.push_back(text);
  const std::string text = fmt::format(R"({{"type_description": {}, "referenced_type_descriptions": [{}]}})", described,
                                       fmt::join(referred, ", "));
  boost::hash2::sha2_256 hash;
  hash.update(text.data(), text.size());
  return "RIHS01_" + to_string(hash.result());
}

// ---- a type ----

KnownType known_type_of(const std::string& name, std::string hash, const std::shared_ptr<const DynamicMessage>& blank) {
  auto to_json = [name, blank](std::span<const std::byte> cdr) -> Expected<Json> {
    DynamicMessage message = *blank;
    CdrReader reader(cdr);
    DynamicMessage::each_field(message, reader);
    reader.end();
    if (reader.failed()) return std::unexpected(reader.error(name));
    return wire::to_json(message);
  };
  auto to_cdr = [blank](const Json& json) -> Expected<std::vector<std::byte>> {
    DynamicMessage message = *blank;
    if (auto taken = from_json(json, message); !taken) return std::unexpected(taken.error());
    std::vector<std::byte> bytes;
    if (auto put = encode(message, bytes); !put) return std::unexpected(put.error());
    return bytes;
  };
  auto empty = [blank] { return wire::to_json(*blank); };
  return {name, std::move(hash), std::move(to_json), std::move(to_cdr), std::move(empty)};
}

}  // namespace

Expected<KnownType> InterfaceTypes::type(const std::string& name) {
  const auto found = made(name);
  if (!found) return std::unexpected(found.error());
  const auto& [blank, described, refers_to] = **found;
  return known_type_of(name, hash_of(described, refers_to), blank);
}

Expected<const MessageLines*> InterfaceTypes::lines(const std::string& name) {
  const std::string interface = interface_of(name);
  auto file = files_.find(interface);
  if (file == files_.end()) {
    const auto text = find_(interface);
    if (!text) return std::unexpected(text.error());
    auto read = read_interface(interface, *text);
    if (!read) return std::unexpected(read.error());
    file = files_.emplace(interface, *std::move(read)).first;
  }
  const auto found = std::ranges::find(file->second, name, &MessageLines::name);
  if (found == file->second.end()) return fail(fmt::format("{} has no part {}", interface, name));
  return &*found;
}

Expected<const InterfaceTypes::Made*> InterfaceTypes::made(const std::string& name) {
  if (const auto found = made_.find(name); found != made_.end()) return &found->second;
  if (std::ranges::find(making_, name) != making_.end())
    return fail(fmt::format("{} contains itself", name), {}, "a message holds messages of other types");
  const auto message = lines(name);
  if (!message) return std::unexpected(message.error());
  making_.push_back(name);
  auto one = make(**message);
  making_.pop_back();
  if (!one) return std::unexpected(one.error());
  return &made_.emplace(name, *std::move(one)).first->second;
}

Expected<InterfaceTypes::Made> InterfaceTypes::make(const MessageLines& message) {
  auto fields = std::make_shared<std::vector<DynamicField>>();
  auto blank = std::make_shared<DynamicMessage>(fields);
  Made result{.blank = blank, .described = described(message)};
  std::size_t size = 0;
  for (const FieldLine& line : message.fields) {
    const FieldType& type = line.type;
    const Made* nested = nullptr;
    if (type.base == FieldBase::kNested) {
      const auto found = made(type.nested);
      if (!found) {
        Error error = found.error();
        if (error.where.empty()) error.where = line.where;
        return std::unexpected(std::move(error));
      }
      nested = *found;
      result.refers_to.emplace(type.nested, nested->described);
      result.refers_to.insert(nested->refers_to.begin(), nested->refers_to.end());
    }
    // Before it takes the memory.
    const std::size_t each = nested == nullptr ? sizeof(double) : encoded_size(*nested->blank);
    size += type.count == FieldCount::kArray ? type.elements * each : each;
    if (size > kLargest)
      return fail(fmt::format("{} takes more than {} KiB with nothing in it", message.name, kLargest >> 10U),
                  line.where, "make a sequence of an array: [] in place of a number");
    fields->push_back({line.name});
    if (type.count == FieldCount::kBoundedSequence) fields->back().most = AtMost{type.elements};
    if (type.most_chars > 0) fields->back().most = AtMost{type.most_chars};
    blank->values.push_back(blank_value(type, nested == nullptr ? nullptr : nested->blank));
    if (line.preset.is_null()) continue;
    if (const auto taken = from_json({{line.name, line.preset}}, *blank); !taken)
      return fail(fmt::format("its default: {} {}", taken.error().where, taken.error().what), line.where,
                  taken.error().mend);
  }
  return result;
}

}  // namespace pons::wire
