#include "pons/record/output_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

namespace pons::record {

Expected<OutputFile> OutputFile::create(const std::filesystem::path& path) {
  Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.open()) return OutputFile(path, std::move(file));
  const int error = errno;
  if (error == EEXIST)
    return fail("there is such a file already", whole_of(path).string(), "choose another name or move it away");
  if (error == ENOENT)
    return fail("the folder does not exist", folder_of(path).string(), "create it or choose another path");
  return cannot("create the file", whole_of(path), error);
}

Expected<void> OutputFile::append(std::span<const std::byte> bytes) {
  struct stat now{};
  if (::fstat(file_.number(), &now) == 0 && now.st_nlink == 0)
    return fail("the file was removed while it was written", whole_of(path_).string(),
                "leave a recording alone until it ends");
  const std::uint64_t end = size_ + bytes.size();
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
