#include "pons/bridge/tree/library.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "pons/task/json_text.hpp"

namespace pons::bridge::tree {

namespace fs = std::filesystem;

namespace {

// A document knows its lines by the file's name alone.
Error in_folder(const fs::path& folder, Error error) {
  if (error.where.find('/') == error.where.npos) error.where = (folder / error.where).string();
  return error;
}

}  // namespace

Expected<void> Library::load(const fs::path& folder) {
  std::set<fs::path> files;
  std::error_code error;
  if (fs::exists(folder, error)) {
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
      if (entry->path().extension() == ".xml") files.insert(entry->path());
    }
  }
  // No answer is not "none": what is not there would end the tasks that name it.
  if (error) return fail("the folder of trees cannot be read: " + error.message(), folder.string(), "mend its rights");
  decltype(programs_) programs;
  std::map<std::string, std::string> files_of;
  for (const fs::path& file : files) {
    const auto document = read_document(file);
    if (!document) return std::unexpected(in_folder(folder, document.error()));
    for (const auto& [name, root] : document->trees) {
      // What another file includes is that file's as well.
      const auto [known, added] = files_of.emplace(name, root.where);
      if (!added && known->second == root.where) continue;
      if (!added) {
        return fail(fmt::format("there is a tree '{}' in {}, too", task::excerpt(name), known->second),
                    (folder / root.where).string(), "rename one");
      }
      auto program = compile(*document, name, *skills_);
      if (!program) return std::unexpected(in_folder(folder, program.error()));
      programs.emplace(name, *std::move(program));
    }
  }
  programs_ = std::move(programs);
  return {};
}

std::vector<std::string> Library::names() const {
  std::vector<std::string> names;
  for (const auto& [name, program] : programs_) names.push_back(name);
  return names;
}

std::shared_ptr<const Program> Library::find(std::string_view name) const {
  const auto found = programs_.find(name);
  return found == programs_.end() ? nullptr : found->second;
}

Expected<std::shared_ptr<const Program>> Library::program(const task::TreeRequest& request) const {
  std::shared_ptr<const Program> program;
  if (request.xml.empty()) {
    program = find(request.name);
    if (program == nullptr) {
      return fail(
          fmt::format("the world has no tree '{}'", task::excerpt(request.name)), "/tree/name",
          programs_.empty() ? "it has none; send the XML along" : fmt::format("it has {}", fmt::join(names(), ", ")));
    }
  } else {
    const auto document = read_document(request.xml, "/tree/xml");
    if (!document) return std::unexpected(document.error());
    auto compiled = compile(*document, request.name, *skills_, kMaxSent);
    if (!compiled) return compiled;
    program = *std::move(compiled);
  }
  std::size_t bytes = 0;
  for (const auto& [name, value] : request.inputs.items()) {
    bytes += bytes_of(value);
    if (!program->root.contains(name)) {
      return fail(fmt::format("the tree reads and writes no '{}'", task::excerpt(name)), "/tree/inputs",
                  "leave it out, or name an entry of its main tree");
    }
  }
  if (bytes > Blackboard::kMaxBytes) {
    return fail(fmt::format("their texts and lists have {} bytes, {} are taken", bytes, Blackboard::kMaxBytes),
                "/tree/inputs", "send less");
  }
  return program;
}

}  // namespace pons::bridge::tree
