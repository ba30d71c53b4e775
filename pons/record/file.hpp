// Files that are written whole or not at all, and read again.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string_view>

#include "pons/core/error.hpp"

namespace pons::record {

// Can write_whole put a file there? Asks before a long run what would otherwise fail after it. Writes nothing.
// Errors: the folder is missing or not writable; something that is not a regular file has that name.
[[nodiscard]] Expected<void> check_writable(const std::filesystem::path& path);

// Replaces the file at `path`: a reader, or a crash at any moment, sees the old file or the new one, never a part. The
// bytes are on disk when it returns. A symbolic link is followed; the mode stays. Blocks on the disk.
// Errors: those of check_writable; the disk is full or broken. The old file is untouched then, and nothing is left
// over.
[[nodiscard]] Expected<void> write_whole(const std::filesystem::path& path, std::string_view bytes);

// A file that write_whole left and nobody else. Errors: it cannot be read, or is cut or no JSON.
[[nodiscard]] Expected<nlohmann::ordered_json> read_json(const std::filesystem::path& path);

}  // namespace pons::record
