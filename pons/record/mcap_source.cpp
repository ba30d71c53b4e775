#include "pons/record/mcap_source.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "pons/record/posix.hpp"

namespace pons::record {
namespace {

class File : public Source {
 public:
  File(std::filesystem::path path, Descriptor file, std::uint64_t size)
      : path_(std::move(path)), file_(std::move(file)), size_(size) {}
  [[nodiscard]] std::uint64_t size() const override { return size_; }
  [[nodiscard]] std::string name() const override { return path_.string(); }
  [[nodiscard]] Expected<void> read(std::uint64_t at, std::span<std::byte> into) const override {
    while (!into.empty()) {
      const ssize_t got = ::pread(file_.number(), into.data(), into.size(), static_cast<off_t>(at));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) return cannot("read", path_, errno);
      if (got == 0) return fail("the file became shorter while it was read", name(), "leave it alone until it is read");
      at += static_cast<std::uint64_t>(got);
      into = into.subspan(static_cast<std::size_t>(got));
    }
    return {};
  }

 private:
  std::filesystem::path path_;
  Descriptor file_;
  std::uint64_t size_;
};

class InMemory : public Source {
 public:
  InMemory(std::span<const std::byte> bytes, std::string name) : bytes_(bytes), name_(std::move(name)) {}
  [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }
  [[nodiscard]] std::string name() const override { return name_; }
  [[nodiscard]] Expected<void> read(std::uint64_t at, std::span<std::byte> into) const override {
    if (!into.empty()) std::memcpy(into.data(), bytes_.subspan(at, into.size()).data(), into.size());
    return {};
  }

 private:
  std::span<const std::byte> bytes_;
  std::string name_;
};

}  // namespace

Expected<std::unique_ptr<Source>> open_file(const std::filesystem::path& path) {
  Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));  // a pipe is not waited for
  if (!file.open() && errno == ENOENT)
    return fail("there is no such file", path.string(), "name a recording: FILE.mcap");
  if (!file.open()) return cannot("open the file", path, errno);
  struct stat now{};
  if (::fstat(file.number(), &now) != 0) return cannot("open the file", path, errno);
  if (!S_ISREG(now.st_mode)) return fail("is not a regular file", path.string(), "name a recording: FILE.mcap");
  return std::make_unique<File>(path, std::move(file), static_cast<std::uint64_t>(now.st_size));
}

std::unique_ptr<Source> open_bytes(std::span<const std::byte> bytes, std::string name) {
  return std::make_unique<InMemory>(bytes, std::move(name));
}

Expected<std::span<const std::byte>> Window::view(std::uint64_t at, std::uint64_t count) {
  if (at < begin_ || at + count > begin_ + bytes_.size()) {
    const std::uint64_t left = source_.size() - at;
    bytes_.clear();
    begin_ = at;
    const std::size_t take = std::min<std::uint64_t>(left, std::max<std::uint64_t>(count, kStep));
    if (auto read = source_.read(at, {bytes_.grow(take), take}); !read) {
      bytes_.clear();
      return std::unexpected(read.error());
    }
  }
  return bytes_.span().subspan(at - begin_, count);
}

}  // namespace pons::record
