// Where things lie when nobody says.
#pragma once

#include <filesystem>

namespace pons::apps {

// $PONS_WORLDS, else worlds/ beside the installed program, else the source tree's.
[[nodiscard]] std::filesystem::path worlds_folder();
// $XDG_RUNTIME_DIR/pons.sock, else /tmp/pons-<user id>.sock.
[[nodiscard]] std::filesystem::path default_socket();

}  // namespace pons::apps
