// An occupancy grid from the two files that ROS's map_server writes and reads.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <string>

#include "pons/world/grid.hpp"
#include "pons/world/yaml.hpp"

namespace pons::world {
namespace {

constexpr int kMostCells = 4096;  // a side

[[noreturn]] void refuse(const std::filesystem::path& file, std::string what) {
  throw LoadError{
      {std::move(what), file.string(), "write it as map_saver does: P5, width, height, 255, then the bytes"}};
}

// The next number of a PGM's head: white space and comments before it are passed over.
std::optional<int> number(std::istream& in) {
  for (int next = in.peek(); next == '#' || (next >= 0 && std::isspace(next) != 0); next = in.peek()) {
    if (next == '#')
      in.ignore(1 << 16, '\n');
    else
      in.get();
  }
  int value = 0;
  if (!(in >> value)) return std::nullopt;
  return value;
}

struct Picture {
  int width = 0, height = 0;
  std::string grey;  // row by row, the top row first
};

Picture read_pgm(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) refuse(file, "cannot be read");
  std::string magic(2, '\0');
  in.read(magic.data(), 2);
  if (magic != "P5") refuse(file, "is no binary PGM picture");
  const auto width = number(in), height = number(in), white = number(in);
  if (!width || !height || !white) refuse(file, "the picture's head is broken");
  if (*width < 2 || *height < 2 || *width > kMostCells || *height > kMostCells)
    refuse(file, fmt::format("is {} by {} cells; 2 to {} a side are possible", *width, *height, kMostCells));
  if (*white != 255) refuse(file, fmt::format("white is {}, not 255", *white));
  in.get();  // one white space ends the head
  Picture picture{*width, *height,
                  std::string(static_cast<std::size_t>(*width) * static_cast<std::size_t>(*height), 0)};
  in.read(picture.grey.data(), static_cast<std::streamsize>(picture.grey.size()));
  if (in.gcount() != static_cast<std::streamsize>(picture.grey.size())) refuse(file, "ends before its last row");
  return picture;
}

}  // namespace

Grid Grid::load(const std::filesystem::path& yaml) {
  const YamlMap map(read_yaml(yaml), {"image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh"},
                    {"mode"});
  const auto image = map["image"].existing_file(yaml.parent_path());
  const double resolution_m = map["resolution"].number(0.001, 1);
  const Vector3 origin = map["origin"].vector(1e4);
  if (origin.z() != 0) map["origin"].refuse("is turned", "turn the picture, and write 0 as the third number");
  const bool negate = map["negate"].integer(0, 1) == 1;
  const double occupied = map["occupied_thresh"].number(0, 1), free = map["free_thresh"].number(0, 1);
  if (free >= occupied) map["free_thresh"].refuse("is not below occupied_thresh", "lower it; map_saver writes 0.196");
  if (map.has("mode") && map["mode"].text() != "trinary") map["mode"].refuse("is not trinary", "leave it out");

  const Picture picture = read_pgm(image);
  const auto width = static_cast<std::size_t>(picture.width);
  std::vector<Ground> ground(picture.grey.size());
  for (std::size_t i = 0; i < ground.size(); ++i) {
    const double grey = static_cast<unsigned char>(picture.grey[i]) / 255.0;
    const double share = negate ? grey : 1 - grey;  // of being occupied: dark cells are
    const std::size_t row = static_cast<std::size_t>(picture.height) - 1 - i / width;
    ground[row * width + i % width] =
        share > occupied ? Ground::kOccupied : (share < free ? Ground::kFree : Ground::kUnknown);
  }
  if (std::ranges::find(ground, Ground::kOccupied) == ground.end())
    refuse(image, "nothing is occupied, and without anything to see nobody knows where they are");
  return {picture.width, picture.height, resolution_m, origin.head<2>(), std::move(ground)};
}

}  // namespace pons::world
