#include "tests/crash/disk.hpp"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <memory>
#include <utility>

namespace pons::tests {

namespace {

constexpr std::size_t kSector = 512;
constexpr std::uint64_t kTornSectors = 8;  // of so many that were being written one was so only down to some byte

struct Handle {
  sqlite3_file base;
  Disk* disk;
  std::string* name;
  bool goes_with_it;  // removed when it is closed
};

Handle* handle_of(sqlite3_file* file) { return reinterpret_cast<Handle*>(file); }

}  // namespace

// What SQLite calls.
struct DiskCalls {
  static Disk* disk_of(sqlite3_vfs* vfs) { return static_cast<Disk*>(vfs->pAppData); }
  static Disk::File& file_of(Handle* handle) { return handle->disk->files_[*handle->name]; }

  static int close(sqlite3_file* file) {
    Handle* const handle = handle_of(file);
    if (handle->goes_with_it) handle->disk->files_.erase(*handle->name);
    delete handle->name;
    handle->base.pMethods = nullptr;
    return SQLITE_OK;
  }
  static int read(sqlite3_file* file, void* to, int amount, sqlite3_int64 offset) {
    Handle* const handle = handle_of(file);
    if (handle->disk->off_) return SQLITE_IOERR_READ;
    const std::string& content = file_of(handle).now;
    const auto from = std::min(static_cast<std::size_t>(offset), content.size());
    const auto there = std::min(static_cast<std::size_t>(amount), content.size() - from);
    std::memcpy(to, content.data() + from, there);
    if (there == static_cast<std::size_t>(amount)) return SQLITE_OK;
    std::memset(static_cast<char*>(to) + there, 0, static_cast<std::size_t>(amount) - there);
    return SQLITE_IOERR_SHORT_READ;
  }
  static int write(sqlite3_file* file, const void* from, int amount, sqlite3_int64 offset) {
    Handle* const handle = handle_of(file);
    if (!handle->disk->begin(Disk::Operation::kWrite, *handle->name)) return SQLITE_IOERR_WRITE;
    handle->disk->write(file_of(handle),
                        {static_cast<std::size_t>(offset),
                         std::string(static_cast<const char*>(from), static_cast<std::size_t>(amount)), std::nullopt});
    return handle->disk->end(Disk::Operation::kWrite, *handle->name) ? SQLITE_OK : SQLITE_IOERR_WRITE;
  }
  static int truncate(sqlite3_file* file, sqlite3_int64 size) {
    Handle* const handle = handle_of(file);
    if (!handle->disk->begin(Disk::Operation::kCut, *handle->name)) return SQLITE_IOERR_TRUNCATE;
    handle->disk->write(file_of(handle), {0, {}, static_cast<std::size_t>(size)});
    return handle->disk->end(Disk::Operation::kCut, *handle->name) ? SQLITE_OK : SQLITE_IOERR_TRUNCATE;
  }
  static int sync(sqlite3_file* file, int) {
    Handle* const handle = handle_of(file);
    Disk* const disk = handle->disk;
    if (!disk->begin(Disk::Operation::kSync, *handle->name) || !disk->spend()) return SQLITE_IOERR_FSYNC;
    disk->sync(file_of(handle));
    return disk->asks(Disk::Operation::kSync, Disk::Moment::kAfter, *handle->name) ? SQLITE_OK : SQLITE_IOERR_FSYNC;
  }
  static int size(sqlite3_file* file, sqlite3_int64* size) {
    Handle* const handle = handle_of(file);
    if (handle->disk->off_) return SQLITE_IOERR_FSTAT;
    *size = static_cast<sqlite3_int64>(file_of(handle).now.size());
    return SQLITE_OK;
  }
  // One process: who has a file open has it for itself.
  static int lock(sqlite3_file*, int) { return SQLITE_OK; }
  static int reserved(sqlite3_file*, int* held) {
    *held = 0;
    return SQLITE_OK;
  }
  static int control(sqlite3_file*, int, void*) { return SQLITE_NOTFOUND; }
  static int sector(sqlite3_file*) { return static_cast<int>(kSector); }
  static int traits(sqlite3_file*) { return SQLITE_IOCAP_POWERSAFE_OVERWRITE; }

  static int open(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* out_flags);
  static int remove(sqlite3_vfs* vfs, const char* name, int) {
    Disk* const disk = disk_of(vfs);
    if (disk->off_) return SQLITE_IOERR_DELETE;
    if (!disk->files_.contains(name)) return SQLITE_IOERR_DELETE_NOENT;
    if (!disk->begin(Disk::Operation::kRemove, name)) return SQLITE_IOERR_DELETE;
    disk->remove(name);
    return disk->end(Disk::Operation::kRemove, name) ? SQLITE_OK : SQLITE_IOERR_DELETE;
  }
  static int access(sqlite3_vfs* vfs, const char* name, int, int* there) {
    if (disk_of(vfs)->off_) return SQLITE_IOERR_ACCESS;
    *there = disk_of(vfs)->files_.contains(name) ? 1 : 0;
    return SQLITE_OK;
  }
  static int full_path(sqlite3_vfs*, const char* name, int size, char* to) {
    sqlite3_snprintf(size, to, "%s", name);
    return SQLITE_OK;
  }
  static int randomness(sqlite3_vfs* vfs, int size, char* to) {
    for (int i = 0; i < size; ++i) to[i] = static_cast<char>(disk_of(vfs)->random_.below(256));
    return size;
  }
  static int pause(sqlite3_vfs*, int) { return 0; }
  static int now(sqlite3_vfs*, double* julian_day) {
    *julian_day = 2'460'000.5;
    return SQLITE_OK;
  }
  static int last_error(sqlite3_vfs*, int, char*) { return 0; }
};

int DiskCalls::open(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* out_flags) {
  static const sqlite3_io_methods methods = [] {
    sqlite3_io_methods m{};
    m.iVersion = 1;  // no shared memory: a journal has one owner
    m.xClose = close;
    m.xRead = read;
    m.xWrite = write;
    m.xTruncate = truncate;
    m.xSync = sync;
    m.xFileSize = size;
    m.xLock = lock;
    m.xUnlock = lock;
    m.xCheckReservedLock = reserved;
    m.xFileControl = control;
    m.xSectorSize = sector;
    m.xDeviceCharacteristics = traits;
    return m;
  }();
  Disk* const disk = disk_of(vfs);
  file->pMethods = nullptr;
  if (disk->off_) return SQLITE_CANTOPEN;
  auto owned = std::make_unique<std::string>(name != nullptr ? name : "unnamed-" + std::to_string(++disk->unnamed_));
  if (!disk->files_.contains(*owned) && (flags & SQLITE_OPEN_CREATE) == 0) return SQLITE_CANTOPEN;
  disk->files_[*owned];
  Handle* const handle = handle_of(file);
  handle->disk = disk;
  handle->name = owned.release();
  handle->goes_with_it = name == nullptr || (flags & SQLITE_OPEN_DELETEONCLOSE) != 0;
  handle->base.pMethods = &methods;
  if (out_flags != nullptr) *out_flags = flags;
  return SQLITE_OK;
}

Disk::Disk(std::uint64_t seed, Syncs syncs) : random_(seed), syncs_(syncs) {
  static std::atomic<int> count = 0;
  name_ = "pons-disk-" + std::to_string(++count);
  vfs_.iVersion = 1;
  vfs_.szOsFile = sizeof(Handle);
  vfs_.mxPathname = 256;
  vfs_.zName = name_.c_str();
  vfs_.pAppData = this;
  vfs_.xOpen = DiskCalls::open;
  vfs_.xDelete = DiskCalls::remove;
  vfs_.xAccess = DiskCalls::access;
  vfs_.xFullPathname = DiskCalls::full_path;
  vfs_.xRandomness = DiskCalls::randomness;
  vfs_.xSleep = DiskCalls::pause;
  vfs_.xCurrentTime = DiskCalls::now;
  vfs_.xGetLastError = DiskCalls::last_error;
  sqlite3_vfs_register(&vfs_, 0);
}

Disk::~Disk() { sqlite3_vfs_unregister(&vfs_); }

bool Disk::asks(Operation operation, Moment moment, const std::string& file) {
  off_ = off_ || (watch_ && !watch_(operation, moment, file));
  return !off_;
}

bool Disk::begin(Operation operation, const std::string& file) {
  return !off_ && asks(operation, Moment::kBefore, file);
}

bool Disk::end(Operation operation, const std::string& file) {
  return spend() && asks(operation, Moment::kAfter, file);
}

bool Disk::spend() {
  ++operations_;
  off_ = off_ || (off_at_ && operations_ >= *off_at_);
  return !off_;
}

void Disk::apply(std::string& content, const Change& change) {
  if (change.cut_to) {
    content.resize(*change.cut_to);
    return;
  }
  content.resize(std::max(content.size(), change.offset + change.bytes.size()));
  content.replace(change.offset, change.bytes.size(), change.bytes);
}

void Disk::write(File& file, Change change) {
  apply(file.now, change);
  file.pending.push_back(std::move(change));
}

void Disk::sync(File& file) {
  if (syncs_ == Syncs::kNever) return;
  for (const Change& change : file.pending) apply(file.durable, change);
  file.pending.clear();
  if (std::exchange(file.folder_synced, true)) return;
  removed_.clear();
  named_.clear();
  for (const auto& [name, any] : files_) named_.insert(name);
}

void Disk::remove(const std::string& name) {
  auto gone = files_.extract(name);
  if (named_.contains(name)) removed_.insert_or_assign(name, std::move(gone.mapped()));
}

std::string Disk::after_power_off(const File& file) {
  std::string content = file.durable;
  // How much the disk had got round to: nothing, all, or some.
  const std::uint64_t mood = random_.below(3);
  for (const Change& change : file.pending) {
    if (change.cut_to) {
      if (mood == 1 || (mood == 2 && random_.below(2) == 0)) apply(content, change);
      continue;
    }
    for (std::size_t at = 0; at < change.bytes.size();) {
      const std::size_t end = std::min(change.bytes.size(), at + kSector - (change.offset + at) % kSector);
      const bool kept = mood == 1 || (mood == 2 && random_.below(2) == 0);
      const bool torn = kept && mood == 2 && random_.below(kTornSectors) == 0;
      const std::size_t whole = torn ? at + random_.below(end - at) : end;
      losses_.lost += kept ? 0 : 1;
      losses_.torn += torn ? 1 : 0;
      if (kept) apply(content, {change.offset + at, change.bytes.substr(at, whole - at), std::nullopt});
      at = end;
    }
  }
  return content;
}

std::string Disk::content(const std::string& name) const {
  const auto found = files_.find(name);
  return found == files_.end() ? std::string() : found->second.now;
}

void Disk::put(const std::string& name, std::string content) {
  files_[name] = {.now = content, .durable = std::move(content), .pending = {}, .folder_synced = true};
  named_.insert(name);
}

void Disk::next_user() {
  off_ = false;
  off_at_.reset();
}

void Disk::restart() {
  std::map<std::string, File> found;
  const auto keep = [&](const std::string& name, const File& file) {
    std::string content = after_power_off(file);
    found[name] = {.now = content, .durable = content, .pending = {}, .folder_synced = true};
  };
  for (const auto& [name, file] : removed_) {
    if (random_.below(2) == 0) keep(name, file);
  }
  for (const auto& [name, file] : files_) {
    if (named_.contains(name) || random_.below(2) == 0) keep(name, file);
  }
  files_ = std::move(found);
  removed_.clear();
  named_.clear();
  for (const auto& [name, any] : files_) named_.insert(name);
  off_ = false;
  off_at_.reset();
}

}  // namespace pons::tests
