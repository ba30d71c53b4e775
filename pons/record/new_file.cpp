#include "pons/record/new_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

#include "pons/record/file.hpp"
#include "pons/record/posix.hpp"

namespace pons::record {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPiece = std::size_t{64} * 1024;

std::unexpected<Error> taken(const fs::path& path) {
  return fail("there is such a file already", path.string(), std::string(kAllowIt));
}

// 0, or an errno.
int rename_to(const fs::path& part, const fs::path& path, Overwrite overwrite) {
  if (overwrite == Overwrite::kNever) {
    if (::renameat2(AT_FDCWD, part.c_str(), AT_FDCWD, path.c_str(), RENAME_NOREPLACE) == 0) return 0;
    if (errno != EINVAL) return errno;  // of file systems that cannot promise it
    if (::access(path.c_str(), F_OK) == 0) return EEXIST;
  }
  return ::rename(part.c_str(), path.c_str()) == 0 ? 0 : errno;
}

}  // namespace

Expected<fs::path> begin_file(const fs::path& path, Overwrite overwrite) {
  if (auto writable = check_writable(path); !writable) return std::unexpected(writable.error());
  std::error_code ignored;
  if (overwrite == Overwrite::kNever && fs::exists(fs::symlink_status(path, ignored))) return taken(path);
  fs::path part = part_of(behind_links(path));
  ::unlink(part.c_str());  // of a process that had this number and was killed
  return part;
}

Expected<void> check_is_not(const fs::path& recording, const fs::path& path) {
  std::error_code not_there;
  if (!fs::equivalent(recording, path, not_there)) return {};
  return fail("is the recording itself, which would be lost", path.string(), "choose another name");
}

Expected<void> end_file(const fs::path& part, const fs::path& path, Overwrite overwrite) {
  const fs::path target = whole_of(part);
  keep_mode(part);
  if (const int error = rename_to(part, target, overwrite); error != 0) {
    ::unlink(part.c_str());
    if (error == EEXIST) return taken(path);
    return cannot("rename the file", path, error);
  }
  if (const int error = sync_folder(folder_of(target)); error != 0) return cannot("sync the folder", path, error);
  return {};
}

Expected<NewText> NewText::create(const fs::path& path, Overwrite overwrite) {
  const auto part = begin_file(path, overwrite);
  if (!part) return std::unexpected(part.error());
  auto file = OutputFile::create(*part);
  if (!file) return std::unexpected(file.error());
  keep_mode(*part);  // before there is anything to be read in it
  return NewText(path, overwrite, std::move(*file));
}

NewText::~NewText() {
  if (file_ && !file_->path().empty()) ::unlink(file_->path().c_str());
}

Expected<void> NewText::add(std::string_view text) {
  waiting_ += text;
  return waiting_.size() < kPiece ? Expected<void>{} : flush();
}

Expected<void> NewText::flush() {
  auto appended = file_->append(std::as_bytes(std::span(waiting_)));
  waiting_.clear();
  return appended;
}

Expected<void> NewText::settle() {
  if (auto flushed = flush(); !flushed) return flushed;
  return file_->sync();
}

Expected<void> NewText::end() {
  if (auto settled = settle(); !settled) return settled;
  const fs::path part = file_->path();
  file_.reset();
  return end_file(part, path_, overwrite_);
}

}  // namespace pons::record
