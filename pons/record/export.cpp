#include "pons/record/export.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "pons/record/new_file.hpp"
#include "pons/record/posix.hpp"
#include "pons/record/ros_types.hpp"
#include "pons/task/json_text.hpp"

namespace pons::record {
namespace {

namespace fs = std::filesystem;
using wire::Json;

constexpr std::size_t kLinesAtOnce = std::size_t{16} * 1024;

// Arrays and objects in messages that are JSON already: more than anybody means, and far from taking the stack.
constexpr std::size_t kDeepest = 256;

Expected<Json> json_itself(std::span<const std::byte> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (task::nests_deeper(text, kDeepest)) return fail(fmt::format("it is nested deeper than {} levels", kDeepest));
  Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) return fail("it is no JSON");
  return json;
}

// How messages of each channel become JSON; what cannot is left out.
class Readers {
 public:
  Readers(const Contents& contents, const Query& query, Exported& exported) {
    for (const auto& [id, channel] : contents.channels) {
      if (query.topics && !query.topics->contains(channel.topic)) continue;
      if (channel.message_encoding == "json") {
        readers_[id] = &json_itself;
      } else if (const auto type = known_type_of(contents, channel)) {
        readers_[id] = (*type)->to_json;
      } else {
        exported.left_out[channel.topic] = type.error().what;
      }
    }
  }
  // nullptr: its channel is left out.
  using Read = std::function<Expected<Json>(std::span<const std::byte>)>;
  [[nodiscard]] const Read* of(std::uint16_t channel) const {
    const auto found = readers_.find(channel);
    return found == readers_.end() ? nullptr : &found->second;
  }

 private:
  std::map<std::uint16_t, Read> readers_;
};

using Put = std::function<Expected<void>(const mcap::Message&, const mcap::Channel&, const Json&)>;

Expected<Exported> each_json(const McapReader& reader, const Query& query, const Put& put) {
  for (const std::string& topic : query.topics.value_or(std::set<std::string, std::less<>>{})) {
    const auto is_it = [&](const auto& channel) { return channel.second.topic == topic; };
    if (std::ranges::none_of(reader.contents().channels, is_it))
      return fail("there is no such topic in the recording", topic, "pons recording info shows those that there are");
  }
  Exported exported;
  const Readers readers(reader.contents(), query, exported);
  Expected<void> done;
  const auto read = reader.each_message(query, [&](const mcap::Message& message, const mcap::Channel& channel) {
    const Readers::Read* const to_json = readers.of(channel.id);
    if (to_json == nullptr) return true;
    const auto json = (*to_json)(message.data);
    if (!json) {
      ++exported.unreadable;
      if (!exported.first_unreadable)
        exported.first_unreadable = Error{
            fmt::format("message {} of {} cannot be read: {}", message.sequence, channel.topic, json.error().line()),
            reader.source().name(), ""};
      return true;
    }
    ++exported.messages;
    done = put(message, channel, *json);
    return done.has_value();
  });
  if (!read) return std::unexpected(read.error());
  if (!done) return std::unexpected(done.error());
  exported.damage = *read;
  return exported;
}

// What the recording says of each message, in columns before its own, none of which can have such a name: messages have
// fields `sequence`, but none has a field `record` that has one of these.
constexpr std::string_view kRecordNames = "record.log_time_ns,record.publish_time_ns,record.sequence";

// RFC 4180.
std::string cell(const Json& json) {
  std::string text = json.is_string() ? json.get<std::string>() : json.is_null() ? "" : wire::line_of(json);
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char each : text) quoted += each == '"' ? std::string("\"\"") : std::string(1, each);
  return quoted + '"';
}

// The leaves, each by its way.
void flatten(const Json& json, const std::string& way, std::string& names, std::string& cells) {
  if (json.is_object()) {
    for (const auto& [name, value] : json.items()) flatten(value, way.empty() ? name : way + "." + name, names, cells);
    return;
  }
  names += ',' + cell(way);
  cells += ',' + cell(json);
}

// Those that a path lacks: made, and removed again where nothing came into them.
class NewFolders {
 public:
  static Expected<NewFolders> make(const fs::path& path) {
    NewFolders folders;
    std::error_code error;
    for (fs::path each = path; !each.empty() && !fs::exists(each, error); each = each.parent_path())
      folders.made_.push_back(each);
    fs::create_directories(path, error);
    if (error) return cannot("make the folder", path, error.value());
    return folders;
  }
  ~NewFolders() {
    for (const fs::path& each : made_) ::rmdir(each.c_str());  // the innermost first
  }
  NewFolders(NewFolders&&) = default;
  NewFolders& operator=(NewFolders&&) = delete;

 private:
  NewFolders() = default;

  std::vector<fs::path> made_;
};

class Tables {
 public:
  Tables(fs::path recording, fs::path folder, Overwrite overwrite)
      : recording_(std::move(recording)), folder_(std::move(folder)), overwrite_(overwrite) {}

  Expected<void> put(const mcap::Message& message, const mcap::Channel& channel, const Json& json) {
    std::string names, cells;
    // What JSON an application puts into messages may differ from one to the next.
    if (channel.message_encoding == "json")
      flatten(Json{{"message", wire::line_of(json)}}, "", names, cells);
    else
      flatten(json, "", names, cells);
    auto there = tables_.find(std::pair(channel.topic, channel.schema));
    if (there == tables_.end()) {
      const fs::path path = folder_ / name_for(channel.topic);
      if (auto another = check_is_not(recording_, path); !another) return another;
      auto file = NewText::create(path, overwrite_);
      if (!file) return std::unexpected(file.error());
      there = tables_.emplace(std::pair(channel.topic, channel.schema), std::move(*file)).first;
      auto headed = there->second.add(fmt::format("{}{}\r\n", kRecordNames, names));
      if (!headed) return headed;
    }
    return there->second.add(
        fmt::format("{},{},{}{}\r\n", message.log_time, message.publish_time, message.sequence, cells));
  }

  // All of them or none: a disk that is full says so before the first of them has its name.
  Expected<void> end() {
    for (auto& [key, file] : tables_) {
      if (auto settled = file.settle(); !settled) return settled;
    }
    std::vector<fs::path> named;
    for (auto& [key, file] : tables_) {
      if (auto ended = file.end(); !ended) {
        // Those that replaced others stay: there is nothing to put back.
        if (overwrite_ == Overwrite::kNever)
          std::ranges::for_each(named, [](const auto& each) { ::unlink(each.c_str()); });
        return ended;
      }
      named.push_back(file.path());
    }
    return {};
  }

 private:
  // Two topics may have names that become one, also with a number behind, or where a file system takes "A" for "a".
  std::string name_for(const std::string& topic) {
    std::string name = topic.starts_with('/') ? topic.substr(1) : topic;
    for (char& each : name) {
      const bool plain = (each >= 'a' && each <= 'z') || (each >= 'A' && each <= 'Z') || (each >= '0' && each <= '9');
      if (!plain && each != '-') each = '_';
    }
    if (name.empty()) name = "topic";
    name.resize(std::min(name.size(), kLongestName));
    const auto is_new = [this](std::string as) {
      for (char& each : as) each = each >= 'A' && each <= 'Z' ? static_cast<char>(each - 'A' + 'a') : each;
      return names_.insert(std::move(as)).second;
    };
    int& times = times_[name];
    std::string numbered;
    do {
      ++times;
      numbered = times == 1 ? name : fmt::format("{}_{}", name, times);
    } while (!is_new(numbered));
    return numbered + ".csv";
  }

  // A file system takes 255 bytes: there is room for a number, and for what a file is called before it is whole.
  static constexpr std::size_t kLongestName = 200;

  fs::path recording_, folder_;
  Overwrite overwrite_;
  std::map<std::pair<std::string, std::uint16_t>, NewText> tables_;  // by topic and schema
  std::set<std::string> names_;                                      // that are given, in small letters
  std::map<std::string, int> times_;                                 // how often each was asked for
};

}  // namespace

Expected<Exported> export_jsonl(const McapReader& reader, const Query& query, const fs::path& path,
                                Overwrite overwrite) {
  if (auto another = check_is_not(reader.source().name(), path); !another) return std::unexpected(another.error());
  auto file = NewText::create(path, overwrite);
  if (!file) return std::unexpected(file.error());
  auto exported = export_jsonl(reader, query, [&](std::string_view lines) { return file->add(lines); });
  if (!exported) return exported;
  if (auto ended = file->end(); !ended) return std::unexpected(ended.error());
  return exported;
}

Expected<Exported> export_jsonl(const McapReader& reader, const Query& query, const TakeLines& take) {
  std::string waiting;
  auto exported =
      each_json(reader, query,
                [&](const mcap::Message& message, const mcap::Channel& channel, const Json& json) -> Expected<void> {
                  const Json line{{"topic", channel.topic},
                                  {"log_time_ns", message.log_time},
                                  {"publish_time_ns", message.publish_time},
                                  {"sequence", message.sequence},
                                  {"message", json}};
                  waiting += wire::line_of(line) + "\n";
                  return waiting.size() < kLinesAtOnce ? Expected<void>{} : take(std::exchange(waiting, {}));
                });
  if (!exported || waiting.empty()) return exported;
  if (auto taken = take(waiting); !taken) return std::unexpected(taken.error());
  return exported;
}

Expected<Exported> export_csv(const McapReader& reader, const Query& query, const fs::path& folder,
                              Overwrite overwrite) {
  const auto made = NewFolders::make(folder);
  if (!made) return std::unexpected(made.error());
  Tables tables(reader.source().name(), folder, overwrite);
  auto exported =
      each_json(reader, query, [&](const mcap::Message& message, const mcap::Channel& channel, const Json& json) {
        return tables.put(message, channel, json);
      });
  if (!exported) return exported;
  if (auto ended = tables.end(); !ended) return std::unexpected(ended.error());
  return exported;
}

}  // namespace pons::record
