#include "pons/gate/ros/interface_folders.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>

#include "pons/wire/schema.hpp"

namespace pons::gate::ros {
namespace {

constexpr std::size_t kLongestFile = std::size_t{1} << 20U;

// "std_srvs/srv/SetBool" -> "std_srvs/srv/SetBool.srv"; empty: it names no file in any folder.
std::string file_of(std::string_view interface) {
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '/';
  };
  const std::size_t first = interface.find('/'), last = interface.rfind('/');
  if (!std::ranges::all_of(interface, fits) || last == interface.npos || last <= first + 1) return {};
  return fmt::format("{}.{}", interface, interface.substr(first + 1, last - first - 1));
}

Expected<wire::InterfaceText> read_file(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  wire::InterfaceText file{std::string(kLongestFile + 1, '\0'), path.string()};
  stream.read(file.text.data(), static_cast<std::streamsize>(file.text.size()));
  file.text.resize(static_cast<std::size_t>(stream.gcount()));
  if (stream.bad() || (file.text.empty() && !stream.eof()))
    return fail("it cannot be read", file.where, "check the rights of the file");
  if (file.text.size() > kLongestFile) return fail("it is longer than 1 MiB", file.where, "no interface file is");
  return file;
}

Expected<wire::InterfaceText> find_file(const std::string& interface,
                                        const std::vector<std::filesystem::path>& folders) {
  if (const std::string_view built = wire::definition(interface); !built.empty())
    return wire::InterfaceText{std::string(built), interface};
  const std::string file = file_of(interface);
  if (file.empty())
    return fail(fmt::format("'{}' is no name of a type", interface), {}, "write PACKAGE/msg, srv or action/NAME");
  std::error_code code;
  for (const std::filesystem::path& folder : folders) {
    if (std::filesystem::is_regular_file(folder / file, code)) return read_file(folder / file);
  }
  const std::string what = fmt::format("Pons does not know the type '{}'", interface);
  if (folders.empty()) return fail(what, {}, fmt::format("name a folder with {} in the world's `interfaces`", file));
  std::vector<std::string> names;
  for (const std::filesystem::path& folder : folders) names.push_back(folder.string());
  return fail(what, {}, fmt::format("there is no {} in {}", file, fmt::join(names, ", ")));
}

}  // namespace

wire::InterfaceTypes interface_types(std::vector<std::filesystem::path> folders) {
  return wire::InterfaceTypes(
      [folders = std::move(folders)](const std::string& interface) { return find_file(interface, folders); });
}

}  // namespace pons::gate::ros
