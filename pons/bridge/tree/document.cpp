#include "pons/bridge/tree/document.hpp"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <set>
#include <sstream>

#include "pons/task/json_text.hpp"

namespace pons::bridge::tree {
namespace {

namespace fs = std::filesystem;

// Tags that only say of what sort the node is that their ID names.
constexpr std::array kSorts{"Action", "Condition", "Control", "Decorator"};

// RFC 3629. Nor is a zero byte text: what comes behind it would not be read.
bool is_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
    const unsigned char lead = byte(i++);
    if (lead == 0 || (lead >= 0x80 && lead < 0xC2) || lead > 0xF4) return false;
    const std::size_t more = lead < 0x80 ? 0 : (lead < 0xE0 ? 1 : (lead < 0xF0 ? 2 : 3));
    if (more > text.size() - i) return false;
    if (more >= 2 && ((lead == 0xE0 && byte(i) < 0xA0) || (lead == 0xED && byte(i) > 0x9F) ||
                      (lead == 0xF0 && byte(i) < 0x90) || (lead == 0xF4 && byte(i) > 0x8F)))
      return false;
    for (const std::size_t end = i + more; i < end; ++i) {
      if ((byte(i) & 0xC0) != 0x80) return false;
    }
  }
  return true;
}

// Finds an attribute that is no text once its references, like &#xD800;, are resolved.
class NoText final : public tinyxml2::XMLVisitor {
 public:
  bool VisitEnter(const tinyxml2::XMLElement& element, const tinyxml2::XMLAttribute* attribute) override {
    for (; attribute != nullptr; attribute = attribute->Next()) {
      if (!is_utf8(attribute->Value())) line = element.GetLineNum();
    }
    return line == 0;
  }

  int line = 0;
};

class Reader {
 public:
  explicit Reader(fs::path folder) : folder_(std::move(folder)) {}

  Expected<void> read(std::string_view text, const std::string& where);
  Expected<void> read_file(const fs::path& file);

  Document document;

 private:
  Expected<void> include(const tinyxml2::XMLElement& element, const fs::path& from, const std::string& where);
  Expected<void> tree(const tinyxml2::XMLElement& element, const std::string& file, bool only);
  Expected<Element> node(const tinyxml2::XMLElement& element, const std::string& file, int depth);
  Expected<void> models(const tinyxml2::XMLElement& element, const std::string& file);

  fs::path folder_;  // that files may be included from; empty: none
  fs::path from_;    // of the file that is read
  std::set<fs::path> read_;
  std::map<std::pair<std::string, std::string>, std::size_t> ports_;  // where each is in its model, by the two's names
  bool first_ = true;
};

std::string place(const tinyxml2::XMLElement& element, const std::string& file) {
  return fmt::format("{}:{}", file, element.GetLineNum());
}

std::string tag_of(const tinyxml2::XMLElement& element) { return task::excerpt(element.Name()); }

Expected<std::string> required(const tinyxml2::XMLElement& element, const char* name, const std::string& file) {
  const char* const value = element.Attribute(name);
  if (value == nullptr || *value == '\0')
    return fail(fmt::format("<{}> has no {}", tag_of(element), name), place(element, file), "add the attribute");
  return value;
}

Expected<void> Reader::read_file(const fs::path& file) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(file, error);
  if (error) return fail("this is no file name", file.string(), "name the XML file of a tree");
  if (!read_.insert(whole).second) return {};
  const auto size = fs::file_size(whole, error);
  if (error) return fail("this file cannot be read", file.string(), "name the XML file of a tree");
  if (size > kMaxXmlBytes)
    return fail(fmt::format("this file has {} bytes, {} are read", size, kMaxXmlBytes), file.string(), "divide it");
  std::ifstream stream(whole, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  const fs::path before = std::exchange(from_, whole.parent_path());
  auto done = read(text.str(), file.filename().string());
  from_ = before;
  return done;
}

Expected<void> Reader::read(std::string_view text, const std::string& where) {
  if (text.size() > kMaxXmlBytes)
    return fail(fmt::format("the text has {} bytes, {} are read", text.size(), kMaxXmlBytes), where, "divide it");
  if (!is_utf8(text)) return fail("this is no UTF-8", where, "save it as UTF-8");
  if (text.find_first_not_of(" \t\r\n") == text.npos) return fail("there is nothing in it", where, "write a tree");
  tinyxml2::XMLDocument xml;
  if (xml.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
    return fail(fmt::format("this is no XML: {}", task::excerpt(xml.ErrorStr(), 200)),
                fmt::format("{}:{}", where, xml.ErrorLineNum()), "write it with Groot2, or look at that line");
  }
  NoText no_text;
  xml.Accept(&no_text);
  if (no_text.line != 0)
    return fail("a character that there is not", fmt::format("{}:{}", where, no_text.line), "look at its references");
  const tinyxml2::XMLElement* const root = xml.RootElement();
  if (root == nullptr || std::string_view(root->Name()) != "root")
    return fail("the outermost tag is not <root>", where, "write it as BehaviorTree.CPP 4 does");
  const char* const format = root->Attribute("BTCPP_format");
  if (format == nullptr || std::string_view(format) != "4") {
    return fail("<root> does not say BTCPP_format=\"4\"", place(*root, where),
                "convert_v3_to_v4.py of BehaviorTree.CPP brings older trees over");
  }
  const char* const main = root->Attribute("main_tree_to_execute");
  if (std::exchange(first_, false) && main != nullptr) document.main = main;
  // First what it includes, wherever that stands: what two files say of one port, this one says last.
  for (auto* child = root->FirstChildElement("include"); child != nullptr;
       child = child->NextSiblingElement("include")) {
    if (auto done = include(*child, from_, where); !done) return done;
  }
  int trees = 0;
  for (auto* child = root->FirstChildElement("BehaviorTree"); child != nullptr;
       child = child->NextSiblingElement("BehaviorTree"))
    ++trees;
  for (auto* child = root->FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
    const std::string_view tag = child->Name();
    Expected<void> done;
    if (tag == "include") continue;
    if (tag == "BehaviorTree") {
      done = tree(*child, where, trees == 1);
    } else if (tag == "TreeNodesModel") {
      done = models(*child, where);
    } else {
      done = fail(fmt::format("<{}> has no place here", tag_of(*child)), place(*child, where),
                  "<root> holds <include>, <BehaviorTree> and <TreeNodesModel>");
    }
    if (!done) return done;
  }
  return {};
}

Expected<void> Reader::include(const tinyxml2::XMLElement& element, const fs::path& from, const std::string& where) {
  if (folder_.empty())
    return fail("a tree that is sent names no files", place(element, where), "write all its trees into one text");
  if (element.Attribute("ros_pkg") != nullptr)
    return fail("ROS packages are not looked into", place(element, where), "copy the file beside this one");
  const auto path = required(element, "path", where);
  if (!path) return std::unexpected(path.error());
  std::error_code error;
  const fs::path file = fs::weakly_canonical(from / *path, error);
  const auto outside = std::ranges::mismatch(folder_, file).in1;
  if (error || outside != folder_.end()) {
    return fail(fmt::format("'{}' does not lie beside this file", task::excerpt(*path)), place(element, where),
                "include what is in its folder or below");
  }
  return read_file(file);
}

Expected<void> Reader::tree(const tinyxml2::XMLElement& element, const std::string& file, bool only) {
  const char* const id = element.Attribute("ID");
  if (id == nullptr && !only) return fail("this tree has no ID", place(element, file), "name it");
  const auto* const root = element.FirstChildElement();
  if (root == nullptr || root->NextSiblingElement() != nullptr)
    return fail("a <BehaviorTree> has exactly one node in it", place(element, file), "put them into a Sequence");
  auto read = node(*root, file, 1);
  if (!read) return std::unexpected(read.error());
  const std::string name = id != nullptr ? id : "BehaviorTree";
  if (!document.trees.emplace(name, *std::move(read)).second)
    return fail(fmt::format("the tree '{}' is there twice", task::excerpt(name)), place(element, file), "rename one");
  return {};
}

Expected<Element> Reader::node(const tinyxml2::XMLElement& element, const std::string& file, int depth) {
  Element read;
  read.tag = element.Name();
  read.where = place(element, file);
  if (depth > kMaxXmlDepth)
    return fail(fmt::format("more than {} nodes inside one another", kMaxXmlDepth), read.where, "use a SubTree");
  const bool sort = std::ranges::find(kSorts, read.tag) != kSorts.end();
  if (sort || read.tag == "SubTree") {
    const auto id = required(element, "ID", file);
    if (!id) return std::unexpected(id.error());
    (sort ? read.tag : read.id) = *id;
  } else if (element.Attribute("ID") != nullptr) {
    return fail(fmt::format("<{}> has an ID", tag_of(element)), read.where,
                "write <Action ID=…/>, or leave the ID out: the tag is the name");
  }
  for (auto* attribute = element.FirstAttribute(); attribute != nullptr; attribute = attribute->Next()) {
    if (std::string_view(attribute->Name()) == "ID") continue;
    if (read.attribute(attribute->Name()) != nullptr)
      return fail(fmt::format("'{}' is there twice", task::excerpt(attribute->Name())), read.where, "remove one");
    read.attributes.emplace_back(attribute->Name(), attribute->Value());
  }
  for (auto* child = element.FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
    auto below = node(*child, file, depth + 1);
    if (!below) return below;
    read.children.push_back(*std::move(below));
  }
  return read;
}

// Of SubTrees only: what the other nodes' ports are, those know who have them. Of a port that is there more than once
// the last counts.
Expected<void> Reader::models(const tinyxml2::XMLElement& element, const std::string& file) {
  for (auto* model = element.FirstChildElement("SubTree"); model != nullptr;
       model = model->NextSiblingElement("SubTree")) {
    const auto id = required(*model, "ID", file);
    if (!id) return std::unexpected(id.error());
    auto& ports = document.models[*id];
    for (auto* port = model->FirstChildElement(); port != nullptr; port = port->NextSiblingElement()) {
      const std::string_view tag = port->Name();
      if (tag != "input_port" && tag != "output_port" && tag != "inout_port") continue;
      const auto name = required(*port, "name", file);
      if (!name) return std::unexpected(name.error());
      const char* const value = port->Attribute("default");
      const bool given = value != nullptr && *value != '\0';
      const auto [known, added] = ports_.try_emplace({*id, *name}, ports.size());
      if (added) ports.push_back({*name, {}});
      ports[known->second].value = given ? std::optional<std::string>(value) : std::nullopt;
    }
  }
  return {};
}

Expected<Document> finished(Document document, const std::string& where) {
  if (document.trees.empty()) return fail("there is no <BehaviorTree>", where, "draw one");
  if (document.main.empty() && document.trees.size() == 1) document.main = document.trees.begin()->first;
  if (!document.main.empty() && !document.trees.contains(document.main)) {
    return fail(fmt::format("there is no tree '{}', which main_tree_to_execute names", task::excerpt(document.main)),
                where, "name one of those that are there");
  }
  return document;
}

}  // namespace

const std::string* Element::attribute(std::string_view name) const {
  const auto found =
      std::ranges::find(attributes, name, [](const auto& pair) -> std::string_view { return pair.first; });
  return found == attributes.end() ? nullptr : &found->second;
}

Expected<Document> read_document(std::string_view text, const std::string& where) {
  Reader reader({});
  if (auto read = reader.read(text, where); !read) return std::unexpected(read.error());
  return finished(std::move(reader.document), where);
}

Expected<Document> read_document(const fs::path& file) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(file, error);
  Reader reader(whole.parent_path());
  if (auto read = reader.read_file(file); !read) return std::unexpected(read.error());
  return finished(std::move(reader.document), file.filename().string());
}

}  // namespace pons::bridge::tree
