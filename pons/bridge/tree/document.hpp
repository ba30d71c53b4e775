// Behaviour trees as text: the XML of BehaviorTree.CPP 4, as Groot2 writes it, read into plain structs. What a tag
// means is not known here.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pons/core/error.hpp"

namespace pons::bridge::tree {

inline constexpr std::size_t kMaxXmlBytes = 1024 * 1024;
inline constexpr int kMaxXmlDepth = 128;  // nodes inside one another, in one tree

struct Element {
  std::string tag;  // <pick …> or, of <Action ID="pick" …>, "pick"; of a SubTree "SubTree"
  std::string id;   // of a SubTree: the tree that it stands for
  std::vector<std::pair<std::string, std::string>> attributes;  // but for ID
  std::vector<Element> children;
  std::string where;  // "sort.xml:12"

  [[nodiscard]] const std::string* attribute(std::string_view name) const;
};

// A port that <TreeNodesModel> declares for a SubTree.
struct ModelPort {
  std::string name;
  std::optional<std::string> value;  // where none is given; without it one must be
};

struct Document {
  std::map<std::string, Element, std::less<>> trees;  // by their ID; each its one root node
  std::map<std::string, std::vector<ModelPort>, std::less<>> models;
  std::string main;  // main_tree_to_execute, or the only tree; empty when neither says which
};

// `where` is what errors call the text. Errors: not XML, too long or too deep, another format than 4, a tag out of its
// place, an attribute that is missing, a tree twice, bytes that are no UTF-8, an <include> (a text names no files).
[[nodiscard]] Expected<Document> read_document(std::string_view text, const std::string& where);
// A file and what it includes, which must lie in the file's folder or below.
[[nodiscard]] Expected<Document> read_document(const std::filesystem::path& file);

}  // namespace pons::bridge::tree
