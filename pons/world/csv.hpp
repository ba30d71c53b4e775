// Comma-separated values by RFC 4180, read a record at a time with a ceiling on what one record may hold.
#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"

namespace pons::world {

// Well-formed UTF-8 without NUL (Unicode 15, table 3-7: no overlong forms, no surrogates).
[[nodiscard]] bool is_utf8(std::string_view bytes);

// Fit for one line of an error message: at most 60 bytes, control characters and broken UTF-8 replaced by '?'.
[[nodiscard]] std::string printable(std::string_view text);

// Lines end in LF or CRLF; a byte-order mark is skipped, and so are lines without a word.
class CsvReader {
 public:
  static constexpr std::size_t kMaxRecordBytes = std::size_t{1} << 20;

  // Errors: no such file, not a plain file, not readable, UTF-16.
  [[nodiscard]] static Expected<CsvReader> open(const std::filesystem::path& file);

  // The next record; false at the end of the file. Errors name file and line: not UTF-8, a record above
  // kMaxRecordBytes, a quote out of place or never closed, a bare carriage return.
  [[nodiscard]] Expected<bool> next(std::vector<std::string>& fields);

  // The line (from 1) on which the last record began.
  [[nodiscard]] std::size_t line() const { return record_line_; }
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  // "orders.csv:12"
  [[nodiscard]] std::string where() const;

 private:
  static constexpr int kEnd = -1;

  CsvReader(std::filesystem::path file, std::ifstream stream);
  [[nodiscard]] int peek();
  int take();
  [[nodiscard]] Expected<void> read_record(std::vector<std::string>& fields);
  [[nodiscard]] Expected<void> read_quoted(std::string& field);
  [[nodiscard]] Expected<void> read_plain(std::string& field);
  [[nodiscard]] Expected<void> grow(std::string& field, int byte);
  [[nodiscard]] bool at_line_end();
  [[nodiscard]] bool is_utf16();
  void skip_byte_order_mark();

  std::filesystem::path file_;
  std::ifstream stream_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0, end_ = 0;  // the unread part of the buffer
  std::size_t line_ = 1, record_line_ = 1;
  std::size_t record_bytes_ = 0;
};

}  // namespace pons::world
