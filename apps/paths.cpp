#include "apps/paths.hpp"

#include <unistd.h>
#include <cstdlib>
#include <string>
#include <system_error>

namespace pons::apps {

std::filesystem::path worlds_folder() {
  if (const char* set = std::getenv("PONS_WORLDS"); set != nullptr && *set != '\0') return set;
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  if (!error) {
    const std::filesystem::path installed = self.parent_path().parent_path() / "share" / "pons" / "worlds";
    if (std::filesystem::is_directory(installed, error)) return installed;
  }
  return PONS_SOURCE_WORLDS;
}

std::filesystem::path default_socket() {
  if (const char* runtime = std::getenv("XDG_RUNTIME_DIR"); runtime != nullptr && *runtime != '\0') {
    return std::filesystem::path(runtime) / "pons.sock";
  }
  return "/tmp/pons-" + std::to_string(getuid()) + ".sock";
}

}  // namespace pons::apps
