#include "pons/record/file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>

#include "pons/record/posix.hpp"

namespace pons::record {
namespace {

namespace fs = std::filesystem;

std::string part_ending() { return fmt::format(".{}.part", ::getpid()); }

// 0, or the errno of what went wrong.
[[nodiscard]] int write_and_sync(const fs::path& path, std::string_view bytes) {
  const Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0666));
  if (!file.open()) return errno;
  keep_mode(path);  // before there is anything to be read in it
  while (!bytes.empty()) {
    const ssize_t written = ::write(file.number(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return ::fsync(file.number()) == 0 ? 0 : errno;
}

}  // namespace

std::unexpected<Error> cannot(std::string_view what, const fs::path& where, int error) {
  std::string mend = "choose another path";
  if (error == ENOSPC || error == EDQUOT) mend = "free some space or choose another path";
  if (error == EFBIG) mend = "raise the limit of a file's size (ulimit -f) or write smaller files";
  if (error == EACCES || error == EPERM) mend = "change the folder's permissions or choose another path";
  if (error == EROFS) mend = "choose a path on a file system that is not read-only";
  if (error == EIO) mend = "look after the disk: the kernel's log says more";
  return fail(fmt::format("cannot {}: {}", what, std::generic_category().message(error)), where.string(), mend);
}

fs::path part_of(const fs::path& path) { return path.native() + part_ending(); }

fs::path whole_of(const fs::path& part) {
  const std::string ending = part_ending(), &name = part.native();
  return name.ends_with(ending) ? name.substr(0, name.size() - ending.size()) : name;
}

fs::path behind_links(const fs::path& path) {
  constexpr int kHops = 16;  // a ring of links has no end
  fs::path target = path;
  std::error_code error;
  for (int hop = 0; hop < kHops && fs::is_symlink(target, error); ++hop) {
    const fs::path next = fs::read_symlink(target, error);
    if (error) return path;
    target = next.is_absolute() ? next : target.parent_path() / next;
  }
  return target;
}

void keep_mode(const fs::path& part) {
  constexpr mode_t kAll = 0777, kAllButGroup = 0707;
  constexpr auto kSameOwner = static_cast<uid_t>(-1);
  struct stat was{};
  if (::stat(whole_of(part).c_str(), &was) != 0 || !S_ISREG(was.st_mode)) return;
  const bool same_group =
      ::chown(part.c_str(), was.st_uid, was.st_gid) == 0 || ::chown(part.c_str(), kSameOwner, was.st_gid) == 0;
  // Another group is not to have what that one had.
  ::chmod(part.c_str(), was.st_mode & (same_group ? kAll : kAllButGroup));
}

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

// A rename lives in the folder: until the folder is synced, a power cut can undo it.
int sync_folder(const fs::path& folder) {
  const Descriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!directory.open()) return errno;
  // Some file systems cannot sync a folder (EINVAL); theirs is then as good as it gets.
  return ::fsync(directory.number()) == 0 || errno == EINVAL ? 0 : errno;
}

Expected<void> check_writable(const fs::path& path) {
  if (path.empty() || !path.has_filename()) {
    return fail("no file name", path.string(), "give the path of a file, not of a folder");
  }
  const fs::path target = behind_links(path);
  const fs::path folder = folder_of(target);
  std::error_code error;
  const fs::file_status status = fs::status(target, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    return fail(fs::is_directory(status) ? "is a folder" : "is not a regular file", path.string(),
                "give the path of a file");
  }
  if (!fs::is_directory(folder, error)) {
    return fail("the folder does not exist", folder.string(), "create it or choose another path");
  }
  if (::access(folder.c_str(), W_OK | X_OK) != 0) return cannot("write into this folder", folder, errno);
  return {};
}

Expected<void> write_whole(const fs::path& path, std::string_view bytes) {
  if (auto writable = check_writable(path); !writable) return writable;
  const fs::path target = behind_links(path);
  const fs::path part = part_of(target);
  if (const int error = write_and_sync(part, bytes); error != 0) {
    ::unlink(part.c_str());
    return cannot("write", path, error);
  }
  if (::rename(part.c_str(), target.c_str()) != 0) {
    const int error = errno;
    ::unlink(part.c_str());
    return cannot("replace the file", path, error);
  }
  if (const int error = sync_folder(folder_of(target)); error != 0) return cannot("sync the folder", path, error);
  return {};
}

Expected<nlohmann::ordered_json> read_json(const fs::path& path) {
  std::error_code error;
  std::ifstream in(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  if (!in || !fs::is_regular_file(path, error))
    return fail("cannot be read", path.string(), "see that it is there and may be read");
  auto json = nlohmann::ordered_json::parse(text, nullptr, false);
  if (json.is_discarded())
    return fail("is cut or no JSON", path.string(), "let what writes it write it again; it is written whole");
  return json;
}

}  // namespace pons::record
