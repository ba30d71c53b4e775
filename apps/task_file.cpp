#include "apps/task_file.hpp"

#include <filesystem>
#include <fstream>
#include <iostream>

#include "pons/task/json_text.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;

constexpr std::streamsize kLargestTask = 64 * 1024;

Expected<std::string> read_text(const std::string& file) {
  std::string text;
  std::ifstream opened;
  if (file != "-") {
    std::error_code ignored;
    if (fs::is_directory(file, ignored)) return fail("is a folder", file, "name a JSON file, or - for standard input");
    opened.open(file, std::ios::binary);
    if (!opened) return fail("cannot be read", file, "name a JSON file, or - for standard input");
  }
  std::istream& in = file == "-" ? std::cin : opened;
  text.resize(static_cast<std::size_t>(kLargestTask) + 1);
  in.read(text.data(), kLargestTask + 1);
  if (in.gcount() > kLargestTask) return fail("larger than 64 KiB", file, "a task is a short JSON object");
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

}  // namespace

Expected<task::Json> read_task(const std::string& file) {
  const auto text = read_text(file);
  if (!text) return std::unexpected(text.error());
  auto task = task::parse_json(*text);
  if (task) return task;
  return fail(task.error().line(), file, "a task is {\"id\":…,\"steps\":[{\"skill\":…,\"arguments\":{…}}]}");
}

}  // namespace pons::apps
