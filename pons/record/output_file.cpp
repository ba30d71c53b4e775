#include "pons/record/output_file.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace pons::record {

Expected<OutputFile> OutputFile::create(const std::filesystem::path& path) {
  Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.open()) return OutputFile(path, std::move(file));
  const int error = errno;
  if (error == EEXIST)
    return fail("there is such a file already", whole_of(path).string(), "choose another name or move it away");
  if (error == ENOENT) {
    const std::filesystem::path folder = folder_of(path);
    std::error_code unknown;
    // One of the system's own, as /proc is.
    if (std::filesystem::is_directory(folder, unknown))
      return fail("no file can be made in this folder", folder.string(), "choose another one");
    return fail("the folder does not exist", folder.string(), "create it or choose another path");
  }
  return cannot("create the file", whole_of(path), error);
}

int OutputFile::keep_room(std::uint64_t end) {
  rlimit most{};
  if (::getrlimit(RLIMIT_FSIZE, &most) == 0 && most.rlim_cur != RLIM_INFINITY && end > most.rlim_cur) return EFBIG;
  int error = EINTR;
  while (error == EINTR) {
    const bool kept = ::fallocate(file_.number(), FALLOC_FL_KEEP_SIZE, static_cast<off_t>(size_),
                                  static_cast<off_t>(end - size_)) == 0;
    error = kept ? 0 : errno;
  }
  // A part of it may be kept, too.
  keeps_room_ = keeps_room_ || error == 0 || error == ENOSPC || error == EDQUOT;
  // Of file systems that cannot keep room: whether there is some, the write tells.
  return error == ENOSPC || error == EDQUOT || error == EFBIG ? error : 0;
}

void OutputFile::give_back_spare() {
  if (keeps_room_ && ::ftruncate(file_.number(), static_cast<off_t>(size_)) == 0) keeps_room_ = false;
}

Expected<void> OutputFile::append(std::span<const std::byte> bytes, std::uint64_t spare) {
  struct stat now{};
  if (::fstat(file_.number(), &now) == 0 && now.st_nlink == 0)
    return fail("the file was removed while it was written", whole_of(path_).string(),
                "leave a recording alone until it ends");
  const std::uint64_t end = size_ + bytes.size();
  if (spare > 0) {
    if (const int error = keep_room(end + spare); error != 0) return cannot("write", whole_of(path_), error);
  }
  while (!bytes.empty()) {
    const ssize_t written = ::write(file_.number(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      const int error = errno;
      // What lies there now is a part of something. Should it stay, then the file has a damaged end, which readers
      // know.
      if (::ftruncate(file_.number(), static_cast<off_t>(size_)) == 0)
        ::lseek(file_.number(), static_cast<off_t>(size_), SEEK_SET);
      return cannot("write", whole_of(path_), error);
    }
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  size_ = end;
  return {};
}

Expected<void> OutputFile::sync() {
  if (::fdatasync(file_.number()) != 0) return cannot("sync", whole_of(path_), errno);
  return {};
}

}  // namespace pons::record
