#include "pons/rt/shared_memory.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <utility>

namespace pons::rt {
namespace {

constexpr std::uint64_t kMagic = 0x31'6d'68'73'73'6e'6f'70;  // "ponsshm1"
constexpr std::size_t kPage = 4096;                          // the header has one to itself: the object is aligned

struct Header {
  std::uint64_t magic = 0, version = 0, bytes = 0;
};

// Each side locks a byte of its own.
constexpr off_t kByteOf[] = {0, 1};
off_t byte_of(SharedMemory::Role role) { return kByteOf[static_cast<std::size_t>(role)]; }

struct flock byte_lock(SharedMemory::Role role) {
  struct flock lock{};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = byte_of(role);
  lock.l_len = 1;
  return lock;
}
// Open file description locks: they belong to the opened file, not to the thread or process.
bool take(int file, SharedMemory::Role role) {
  struct flock lock = byte_lock(role);
  return fcntl(file, F_OFD_SETLK, &lock) == 0;
}
bool is_taken(int file, SharedMemory::Role role) {
  struct flock lock = byte_lock(role);
  return fcntl(file, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
}

constexpr const char* kFolder = "/dev/shm";
std::string path_of(const std::string& name) { return fmt::format("{}/pons.{}", kFolder, name); }

std::unexpected<Error> system_error(const std::string& path) {
  const bool forbidden = errno == EACCES || errno == EPERM;
  return fail(std::strerror(errno), path,
              forbidden ? "another user's process made it: run both sides as one user, or choose another name"
                        : "is /dev/shm mounted, writable, and not full?");
}

// Whether the name's file is the one that is open: an owner that went away may have been followed by another.
bool is_at(const std::string& path, int file) {
  struct stat named{}, opened{};
  return stat(path.c_str(), &named) == 0 && fstat(file, &opened) == 0 && named.st_ino == opened.st_ino;
}

}  // namespace

SharedMemory::~SharedMemory() {
  if (bytes_ != nullptr) munmap(bytes_ - kPage, mapped_);
  if (file_ < 0) return;
  if (role_ == Role::kOwner && is_at(path_of(name_), file_)) unlink(path_of(name_).c_str());
  close(file_);
}

void SharedMemory::swap(SharedMemory& other) noexcept {
  std::swap(role_, other.role_);
  std::swap(name_, other.name_);
  std::swap(file_, other.file_);
  std::swap(mapped_, other.mapped_);
  std::swap(bytes_, other.bytes_);
}

Expected<SharedMemory> SharedMemory::make(const std::string& name, const Layout& layout) {
  if (auto good = check_name(name); !good) return std::unexpected(good.error());
  const std::string path = path_of(name);
  if (const int old = ::open(path.c_str(), O_RDWR | O_CLOEXEC); old >= 0) {
    const bool taken = is_taken(old, Role::kOwner);
    close(old);
    if (taken) return fail("another process owns it", path, "end that one, or choose another name");
  } else if (errno != ENOENT) {
    return system_error(path);
  }
  SharedMemory memory;
  memory.role_ = Role::kOwner;
  memory.name_ = name;
  // Without a name: nobody can come upon it, and nothing of it stays if this process is killed before publish().
  memory.file_ = ::open(kFolder, O_RDWR | O_TMPFILE | O_CLOEXEC, 0600);
  if (memory.file_ < 0) return system_error(kFolder);
  const std::size_t whole = kPage + layout.bytes;
  // Reserved now: a full /dev/shm would otherwise kill the process at its first touch.
  if (const int error = posix_fallocate(memory.file_, 0, static_cast<off_t>(whole)); error != 0) {
    errno = error;
    return system_error(path);
  }
  if (!take(memory.file_, Role::kOwner)) return system_error(path);
  void* const start = mmap(nullptr, whole, PROT_READ | PROT_WRITE, MAP_SHARED, memory.file_, 0);
  if (start == MAP_FAILED) return system_error(path);
  memory.mapped_ = whole;
  memory.bytes_ = static_cast<std::byte*>(start) + kPage;
  const Header header{kMagic, layout.version, layout.bytes};
  std::memcpy(start, &header, sizeof header);
  return memory;
}

Expected<void> SharedMemory::publish() {
  const std::string path = path_of(name_);
  const std::string opened = fmt::format("/proc/self/fd/{}", file_);
  const auto link = [&] { return linkat(AT_FDCWD, opened.c_str(), AT_FDCWD, path.c_str(), AT_SYMLINK_FOLLOW) == 0; };
  if (link()) return {};
  if (errno != EEXIST) return system_error(path);
  // A dead owner's memory makes room; that of another maker, who was faster, does not.
  if (const int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC); file >= 0) {
    const bool taken = is_taken(file, Role::kOwner);
    close(file);
    if (taken) return fail("another process owns it", path, "end that one, or choose another name");
  }
  if (unlink(path.c_str()) != 0 && errno != ENOENT) return system_error(path);
  if (!link()) return system_error(path);
  return {};
}

Expected<SharedMemory> SharedMemory::open(const std::string& name, const Layout& layout) {
  if (auto good = check_name(name); !good) return std::unexpected(good.error());
  const std::string path = path_of(name);
  SharedMemory memory;
  memory.name_ = name;
  memory.file_ = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (memory.file_ < 0) {
    if (errno == ENOENT)
      return fail("nobody owns it", path, "start its owner first (a robot's: pons body --link NAME)");
    return system_error(path);
  }
  struct stat status{};
  if (fstat(memory.file_, &status) != 0) return system_error(path);
  const auto size = static_cast<std::size_t>(status.st_size);
  Header header;
  if (size < kPage || pread(memory.file_, &header, sizeof header, 0) != sizeof header || header.magic != kMagic)
    return fail("is not shared memory of Pons, or not whole", path, "remove it, and start its owner again");
  if (header.version != layout.version || header.bytes != layout.bytes || size != kPage + layout.bytes)
    return fail(fmt::format("is of version {:x} with {} bytes, not {:x} with {}", header.version, header.bytes,
                            layout.version, layout.bytes),
                path, "run both sides from one build");
  if (!is_taken(memory.file_, Role::kOwner)) return fail("its owner has died", path, "start its owner again");
  if (!take(memory.file_, Role::kUser)) return fail("another process uses it", path, "end that one first");
  void* const start = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, memory.file_, 0);
  if (start == MAP_FAILED) return system_error(path);
  memory.mapped_ = size;
  memory.bytes_ = static_cast<std::byte*>(start) + kPage;
  return memory;
}

Expected<void> SharedMemory::check_name(const std::string& name) {
  constexpr std::size_t kLongest = 200;
  const bool plain = std::ranges::all_of(
      name, [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.'; });
  if (plain && !name.empty() && name.size() <= kLongest) return {};
  return fail(fmt::format("'{}' is no name for shared memory", name), "shared memory",
              fmt::format("use 1 to {} letters, digits, '-', '_' and '.'", kLongest));
}

bool SharedMemory::is_owned(const std::string& name) {
  const int file = check_name(name) ? ::open(path_of(name).c_str(), O_RDWR | O_CLOEXEC) : -1;
  if (file < 0) return false;
  const bool owned = is_taken(file, Role::kOwner);
  close(file);
  return owned;
}

bool SharedMemory::other_lives() const {
  return file_ >= 0 && is_taken(file_, role_ == Role::kOwner ? Role::kUser : Role::kOwner);
}

}  // namespace pons::rt
