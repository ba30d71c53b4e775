#include "pons/world/manifest.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <system_error>
#include <unordered_map>

#include "pons/world/csv.hpp"

namespace pons::world {
namespace {

constexpr std::array<std::string_view, 8> kColumns{"parcel_id", "destination", "kind",    "length_m",
                                                   "width_m",   "height_m",    "mass_kg", "priority"};
enum Column : std::size_t { kId, kDestination, kKind, kLength, kWidth, kHeight, kMass, kPriority };

constexpr std::array kKinds{ParcelKind::kBox, ParcelKind::kMailer, ParcelKind::kTube, ParcelKind::kBag};
constexpr std::size_t kMaxIdLength = 14;
constexpr double kMinHeight = 0.005;  // m; thinner is no body for the simulator
constexpr double kMaxSide = 1.0;      // m
constexpr double kMinMass = 0.001;    // kg
constexpr double kMaxMass = 100;      // kg

// One record on its way to a row.
class Row {
 public:
  Row(const CsvReader& reader, const std::vector<std::string>& fields, const std::array<std::size_t, 8>& order)
      : reader_(reader), fields_(fields), order_(order) {}

  [[nodiscard]] const std::string& text(Column column) const { return fields_[order_[column]]; }

  [[nodiscard]] std::unexpected<Error> refuse(Column column, std::string what, std::string mend) const {
    return fail(std::move(what), fmt::format("{}:{}", reader_.where(), kColumns[column]), std::move(mend));
  }

  [[nodiscard]] Expected<double> number(Column column, double low, double high) const {
    const std::string& word = text(column);
    double value = 0;
    const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
    const std::string mend = fmt::format("write a number from {} to {}, with a point", low, high);
    if (code != std::errc{} || end != word.data() + word.size() || !std::isfinite(value)) {
      return refuse(column, fmt::format("'{}' is not a finite number", printable(word)), mend);
    }
    if (value < low || value > high) return refuse(column, fmt::format("{} is out of range", value), mend);
    return value;
  }

  [[nodiscard]] Expected<int> priority() const {
    const std::string& word = text(kPriority);
    int value = 0;
    const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (code != std::errc{} || end != word.data() + word.size() || value < 0 || value > 100) {
      return refuse(kPriority, fmt::format("'{}' is not a priority", printable(word)),
                    "write a whole number from 0 to 100");
    }
    return value;
  }

 private:
  const CsvReader& reader_;
  const std::vector<std::string>& fields_;
  const std::array<std::size_t, 8>& order_;
};

Expected<std::string> read_id(const Row& row) {
  const std::string& id = row.text(kId);
  const bool fits = !id.empty() && id.size() <= kMaxIdLength && std::ranges::all_of(id, [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
  });
  if (!fits) {
    return row.refuse(kId, fmt::format("'{}' is not a parcel id", printable(id)),
                      "use 1 to 14 of A-Z, 0-9 and - (what the label holds)");
  }
  return id;
}

Expected<std::string> read_destination(const Row& row, const World& world) {
  const std::string& name = row.text(kDestination);
  const Place* place = world.place(name);
  if (place != nullptr && place->kind == PlaceKind::kChute) return name;
  std::vector<std::string> chutes = world.place_names();
  std::erase_if(chutes, [&](const std::string& known) { return world.place(known)->kind != PlaceKind::kChute; });
  return row.refuse(kDestination, fmt::format("there is no chute '{}' in {}", printable(name), world.name),
                    fmt::format("choose from {}", fmt::join(chutes, ", ")));
}

Expected<ParcelKind> read_kind(const Row& row) {
  const std::string& word = row.text(kKind);
  for (const ParcelKind kind : kKinds) {
    if (name(kind) == word) return kind;
  }
  return row.refuse(kKind, fmt::format("there is no kind '{}'", printable(word)), "choose from box, mailer, tube, bag");
}

Expected<ManifestRow> read_row(const Row& row, const World& world) {
  ManifestRow read;
  const auto keep = [](auto value, auto& into) -> std::optional<Error> {
    if (!value) return value.error();
    into = std::move(*value);
    return std::nullopt;
  };
  const double label = world.arrivals.label_m;
  std::optional<Error> error = keep(read_id(row), read.parcel_id);
  if (!error) error = keep(read_destination(row, world), read.destination);
  if (!error) error = keep(read_kind(row), read.kind);
  if (!error) error = keep(row.number(kLength, label, kMaxSide), read.size_m.x());
  if (!error) error = keep(row.number(kWidth, label, kMaxSide), read.size_m.y());
  if (!error) error = keep(row.number(kHeight, kMinHeight, kMaxSide), read.size_m.z());
  if (!error) error = keep(row.number(kMass, kMinMass, kMaxMass), read.mass_kg);
  if (!error) error = keep(row.priority(), read.priority);
  if (error) return std::unexpected(std::move(*error));
  return read;
}

// Where in a record each of kColumns stands.
Expected<std::array<std::size_t, 8>> read_header(const CsvReader& reader, const std::vector<std::string>& fields) {
  const std::string mend = fmt::format("the columns are {}, separated by commas", fmt::join(kColumns, ","));
  if (fields.size() == 1) {
    for (const char separator : {';', '\t', '|'}) {
      if (fields[0].find(separator) == std::string::npos) continue;
      return fail(
          fmt::format("the columns are separated by {}", separator == '\t' ? "tabs" : fmt::format("'{}'", separator)),
          reader.where(), mend);
    }
  }
  std::array<std::size_t, 8> order{};
  std::array<bool, 8> seen{};
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto found = std::ranges::find(kColumns, fields[i]);
    if (found == kColumns.end())
      return fail(fmt::format("unknown column '{}'", printable(fields[i])), reader.where(), mend);
    const auto column = static_cast<std::size_t>(found - kColumns.begin());
    if (seen[column]) return fail(fmt::format("column '{}' is there twice", *found), reader.where(), mend);
    seen[column] = true;
    order[column] = i;
  }
  for (std::size_t column = 0; column < kColumns.size(); ++column) {
    if (!seen[column]) return fail(fmt::format("column '{}' is missing", kColumns[column]), reader.where(), mend);
  }
  return order;
}

}  // namespace

std::string_view name(ParcelKind kind) {
  switch (kind) {
    case ParcelKind::kBox:
      return "box";
    case ParcelKind::kMailer:
      return "mailer";
    case ParcelKind::kTube:
      return "tube";
    case ParcelKind::kBag:
      return "bag";
  }
  return "";
}

Expected<Manifest> read_manifest(const std::filesystem::path& file, const World& world) {
  auto reader = CsvReader::open(file);
  if (!reader) return std::unexpected(reader.error());
  std::vector<std::string> fields;
  auto more = reader->next(fields);
  if (!more) return std::unexpected(more.error());
  if (!*more) return fail("the file is empty", file.string(), fmt::format("begin with {}", fmt::join(kColumns, ",")));
  const auto order = read_header(*reader, fields);
  if (!order) return std::unexpected(order.error());

  Manifest manifest;
  std::unordered_map<std::string, std::size_t> lines;  // only looked up, never walked through
  while (true) {
    more = reader->next(fields);
    if (!more) return std::unexpected(more.error());
    if (!*more) break;
    if (fields.size() != kColumns.size()) {
      return fail(fmt::format("{} fields instead of {}", fields.size(), kColumns.size()), reader->where(),
                  "a field that holds a comma needs quotes");
    }
    if (manifest.size() == kMaxParcels) {
      return fail(fmt::format("more than {} rows", kMaxParcels), reader->where(), "split the file");
    }
    auto row = read_row(Row(*reader, fields, *order), world);
    if (!row) return std::unexpected(row.error());
    const auto [first, is_new] = lines.emplace(row->parcel_id, reader->line());
    if (!is_new) {
      return fail(fmt::format("parcel_id '{}' is also on line {}", row->parcel_id, first->second),
                  fmt::format("{}:{}", reader->where(), kColumns[kId]), "give each parcel its own id");
    }
    manifest.push_back(std::move(*row));
  }
  if (manifest.empty()) return fail("there is a header and no row", file.string(), "add a row for each parcel");
  return manifest;
}

}  // namespace pons::world
