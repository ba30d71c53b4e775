#include "pons/record/rotation.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <map>
#include <system_error>
#include <vector>

#include "pons/record/mcap_source.hpp"
#include "pons/record/posix.hpp"

namespace pons::record {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kEnding = ".mcap";

// A person's NAME_20260131120000.mcap is no number's, and there is one after each.
constexpr std::uint64_t kMost = 999'999'999;

enum class Begins : std::uint8_t { kSo, kNot, kNothing };

// What is shorter and so far equal was cut before anything of its own was in it: a process was killed that began it.
Begins begins(const fs::path& path, std::span<const std::byte> beginning) {
  const auto file = open_file(path);
  if (!file) return Begins::kNot;
  std::vector<std::byte> there(std::min<std::uint64_t>((*file)->size(), beginning.size()));
  if (!(*file)->read(0, there) || !std::ranges::equal(there, beginning.first(there.size()))) return Begins::kNot;
  return there.size() == beginning.size() ? Begins::kSo : Begins::kNothing;
}

}  // namespace

std::optional<std::uint64_t> Rotation::number_of(std::string_view file, std::string_view name, FirstFile first) {
  if (!file.starts_with(name) || !file.ends_with(kEnding)) return std::nullopt;
  file.remove_suffix(kEnding.size());
  if (first == FirstFile::kPlain && file == name) return 0;
  if (file.size() < name.size() + 2 || file[name.size()] != '_') return std::nullopt;
  file.remove_prefix(name.size() + 1);
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(file.data(), file.data() + file.size(), number);
  if (error != std::errc() || end != file.data() + file.size() || number > kMost) return std::nullopt;
  // No file is called NAME_007, nor NAME_0 where that is NAME.
  if (fmt::format("{}", number) != file || (number == 0 && first == FirstFile::kPlain)) return std::nullopt;
  return number;
}

Expected<Rotation> Rotation::open(const fs::path& folder, const std::string& name, FirstFile first,
                                  std::span<const std::byte> beginning) {
  if (name.empty() || name.find('/') != std::string::npos)
    return fail("no name for a recording", name, "give it one that can be a part of a file's");
  Rotation rotation(folder.empty() ? fs::path(".") : folder, name, first);
  std::error_code error;
  std::map<std::uint64_t, fs::path> there;
  for (fs::directory_iterator each(rotation.folder_, error), end; !error && each != end; each.increment(error)) {
    if (const auto number = number_of(each->path().filename().string(), name, first)) there[*number] = each->path();
  }
  if (error == std::errc::no_such_file_or_directory)
    return fail("the folder does not exist", rotation.folder_.string(), "create it or choose another one");
  if (error) return cannot("read the folder", rotation.folder_, error.value());
  for (const auto& [number, path] : there) {
    rotation.next_ = number + 1;
    if (beginning.empty()) continue;
    const Begins how = begins(path, beginning);
    if (how == Begins::kNot)
      return fail("is there already, and not of this recording", path.string(),
                  "name another file for the recording, or move that one away");
    std::error_code vanished;
    const std::uint64_t size = fs::file_size(path, vanished);
    if (how == Begins::kSo && !vanished) rotation.add(path, size);
  }
  rotation.found_ = rotation.files_.size();
  rotation.added_bytes_ = 0;
  return rotation;
}

fs::path Rotation::next_path() {
  const std::uint64_t number = next_++;
  if (number == 0 && first_ == FirstFile::kPlain) return folder_ / fmt::format("{}{}", name_, kEnding);
  return folder_ / fmt::format("{}_{}{}", name_, number, kEnding);
}

void Rotation::add(const fs::path& path, std::uint64_t bytes) {
  files_.push_back({path, bytes});
  bytes_ += bytes;
  added_bytes_ += bytes;
}

Expected<void> Rotation::make_room(std::uint64_t needed, std::uint64_t quota) {
  while (!files_.empty() && bytes_ + needed > quota) {
    if (auto removed = remove_oldest(); !removed) return removed;
  }
  return {};
}

Expected<void> Rotation::remove_oldest() {
  const File& oldest = files_.front();
  if (::unlink(oldest.path.c_str()) != 0 && errno != ENOENT) return cannot("remove the file", oldest.path, errno);
  bytes_ -= oldest.bytes;
  if (found_ > 0) {
    --found_;
  } else {
    added_bytes_ -= oldest.bytes;
  }
  files_.pop_front();
  ++removed_;
  return {};
}

Rotation::Added Rotation::added() const {
  if (files_.size() == found_) return {};
  return {files_.size() - found_, added_bytes_, files_[found_].path, files_.back().path};
}

}  // namespace pons::record
