#include "pons/world/csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <system_error>
#include <utility>

namespace pons::world {
namespace {

constexpr std::size_t kBufferBytes = 64 * 1024;
constexpr std::size_t kPrintableBytes = 60;

// How many bytes the character that begins `bytes` has; 0 when it is malformed.
std::size_t utf8_length(std::string_view bytes) {
  const auto at = [&](std::size_t i) { return i < bytes.size() ? static_cast<unsigned char>(bytes[i]) : 0U; };
  const auto continues = [&](std::size_t i, unsigned low = 0x80, unsigned high = 0xBF) {
    return at(i) >= low && at(i) <= high;
  };
  const unsigned lead = at(0);
  if (lead == 0) return 0;
  if (lead < 0x80) return 1;
  if (lead >= 0xC2 && lead <= 0xDF) return continues(1) ? 2 : 0;
  if (lead >= 0xE0 && lead <= 0xEF) {
    const unsigned low = lead == 0xE0 ? 0xA0 : 0x80;
    const unsigned high = lead == 0xED ? 0x9F : 0xBF;
    return continues(1, low, high) && continues(2) ? 3 : 0;
  }
  if (lead >= 0xF0 && lead <= 0xF4) {
    const unsigned low = lead == 0xF0 ? 0x90 : 0x80;
    const unsigned high = lead == 0xF4 ? 0x8F : 0xBF;
    return continues(1, low, high) && continues(2) && continues(3) ? 4 : 0;
  }
  return 0;
}

bool is_blank(std::string_view text) { return text.find_first_not_of(" \t") == std::string_view::npos; }

}  // namespace

bool is_utf8(std::string_view bytes) {
  while (!bytes.empty()) {
    const std::size_t length = utf8_length(bytes);
    if (length == 0) return false;
    bytes.remove_prefix(length);
  }
  return true;
}

std::string printable(std::string_view text) {
  std::string shown;
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    if (shown.size() + length > kPrintableBytes) return shown + "…";
    const bool plain = length > 1 || (length == 1 && text[0] >= ' ' && text[0] != 0x7f);
    shown += plain ? text.substr(0, length) : "?";
    text.remove_prefix(length == 0 ? 1 : length);
  }
  return shown;
}

CsvReader::CsvReader(std::filesystem::path file, std::ifstream stream)
    : file_(std::move(file)), stream_(std::move(stream)), buffer_(kBufferBytes) {}

Expected<CsvReader> CsvReader::open(const std::filesystem::path& file) {
  std::error_code code;
  const auto status = std::filesystem::status(file, code);
  if (!std::filesystem::exists(status)) return fail("there is no such file", file.string(), "check the name");
  if (!std::filesystem::is_regular_file(status)) return fail("is not a plain file", file.string(), "name a CSV file");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return fail("cannot be read", file.string(), "check its permissions");
  CsvReader reader(file, std::move(stream));
  if (reader.is_utf16()) {
    return fail("the text is UTF-16", file.string(), "save the file as UTF-8 (in a spreadsheet: CSV UTF-8)");
  }
  reader.skip_byte_order_mark();
  return reader;
}

std::string CsvReader::where() const { return fmt::format("{}:{}", file_.string(), record_line_); }

int CsvReader::peek() {
  if (begin_ == end_) {
    stream_.read(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
    begin_ = 0;
    end_ = static_cast<std::size_t>(stream_.gcount());
    if (end_ == 0) return kEnd;
  }
  return static_cast<unsigned char>(buffer_[begin_]);
}

int CsvReader::take() {
  const int byte = peek();
  if (byte == kEnd) return kEnd;
  ++begin_;
  ++record_bytes_;
  if (byte == '\n') ++line_;
  return byte;
}

void CsvReader::skip_byte_order_mark() {
  // The first fill holds at least three bytes when the file does.
  if (peek() != kEnd && std::string_view(buffer_.data(), end_).starts_with("\xEF\xBB\xBF")) begin_ += 3;
}

bool CsvReader::is_utf16() {
  if (peek() == kEnd) return false;
  const std::string_view begin(buffer_.data(), end_);
  return begin.starts_with("\xFF\xFE") || begin.starts_with("\xFE\xFF");
}

bool CsvReader::at_line_end() { return peek() == '\n' || peek() == '\r' || peek() == kEnd; }

Expected<void> CsvReader::grow(std::string& field, int byte) {
  if (record_bytes_ > kMaxRecordBytes) {
    return fail("the line is longer than 1 MiB", where(), "this is not a manifest, or a quote is not closed");
  }
  field.push_back(static_cast<char>(byte));
  return {};
}

Expected<void> CsvReader::read_quoted(std::string& field) {
  take();
  while (true) {
    const int byte = take();
    if (byte == kEnd) return fail("a quote is opened and never closed", where(), "close it with \"");
    if (byte == '"') {
      if (peek() != '"') break;
      take();
    }
    if (auto grown = grow(field, byte); !grown) return grown;
  }
  if (peek() != ',' && !at_line_end()) {
    return fail("text follows a closing quote", where(), "write a quote inside quotes twice");
  }
  return {};
}

Expected<void> CsvReader::read_plain(std::string& field) {
  while (peek() != ',' && !at_line_end()) {
    const int byte = take();
    if (byte == '"') return fail("a quote stands inside a field", where(), "put the whole field in quotes");
    if (auto grown = grow(field, byte); !grown) return grown;
  }
  return {};
}

Expected<void> CsvReader::read_record(std::vector<std::string>& fields) {
  fields.clear();
  record_line_ = line_;
  record_bytes_ = 0;
  while (true) {
    std::string field;
    auto read = peek() == '"' ? read_quoted(field) : read_plain(field);
    if (!read) return read;
    if (!is_utf8(field)) {
      return fail("the text is not UTF-8", where(), "save the file as UTF-8 (in a spreadsheet: CSV UTF-8)");
    }
    fields.push_back(std::move(field));
    const int byte = take();
    if (byte == '\r' && take() != '\n') {
      return fail("a carriage return without a line feed", where(), "save with LF or CRLF line ends");
    }
    if (byte != ',') return {};
    if (record_bytes_ > kMaxRecordBytes)
      return fail("the line is longer than 1 MiB", where(), "this is not a manifest");
  }
}

Expected<bool> CsvReader::next(std::vector<std::string>& fields) {
  while (peek() != kEnd) {
    if (auto read = read_record(fields); !read) return std::unexpected(read.error());
    // Spreadsheets end a table with rows of nothing but separators.
    if (!std::ranges::all_of(fields, is_blank)) return true;
  }
  fields.clear();
  return false;
}

}  // namespace pons::world
