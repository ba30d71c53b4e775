#include "pons/record/rotation.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <map>
#include <string_view>
#include <system_error>

#include "pons/record/posix.hpp"

namespace pons::record {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kEnding = ".mcap";

// Of "NAME_12.mcap" 12; of "NAME.mcap" 0, where the first is called so.
std::optional<std::uint64_t> number_of(std::string_view file, std::string_view name, FirstFile first) {
  if (!file.starts_with(name) || !file.ends_with(kEnding)) return std::nullopt;
  file.remove_suffix(kEnding.size());
  if (first == FirstFile::kPlain && file == name) return 0;
  if (file.size() < name.size() + 2 || file[name.size()] != '_') return std::nullopt;
  file.remove_prefix(name.size() + 1);
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(file.data(), file.data() + file.size(), number);
  if (error != std::errc() || end != file.data() + file.size()) return std::nullopt;
  return number;
}

}  // namespace

Expected<Rotation> Rotation::open(const fs::path& folder, const std::string& name, FirstFile first) {
  if (name.empty() || name.find('/') != std::string::npos)
    return fail("no name for a recording", name, "give it one that can be a part of a file's");
  Rotation rotation(folder.empty() ? fs::path(".") : folder, name, first);
  std::error_code error;
  std::map<std::uint64_t, File> found;
  for (fs::directory_iterator each(rotation.folder_, error), end; !error && each != end; each.increment(error)) {
    std::error_code vanished;
    const auto number = number_of(each->path().filename().string(), name, first);
    const std::uint64_t size = number ? fs::file_size(each->path(), vanished) : 0;
    if (number && !vanished) found.emplace(*number, File{each->path(), size});
  }
  if (error == std::errc::no_such_file_or_directory)
    return fail("the folder does not exist", rotation.folder_.string(), "create it or choose another one");
  if (error) return cannot("read the folder", rotation.folder_, error.value());
  for (const auto& [number, file] : found) {
    rotation.add(file.path, file.bytes);
    rotation.next_ = number + 1;
  }
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
  files_.pop_front();
  ++removed_;
  return {};
}

}  // namespace pons::record
