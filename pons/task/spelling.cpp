#include "pons/task/spelling.hpp"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace pons::task {

// One row of the table at a time.
std::size_t edits(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, diagonal + 1, row[j] + 1});
    }
  }
  return row.back();
}

std::string nearest(std::string_view word, std::span<const std::string> names) {
  std::string meant;
  std::size_t fewest = (word.size() + 2) / 3 + 1;  // a slip in three characters: "foo" is not "book"
  for (const std::string& name : names) {
    const std::size_t distance = edits(word, name);
    if (distance < fewest) fewest = distance, meant = name;
  }
  return meant;
}

}  // namespace pons::task
