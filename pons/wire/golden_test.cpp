// Every type's bytes, held against those that other implementations of CDR write: see golden.py.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "pons/wire/test_fill.hpp"
#include "pons/wire/test_golden.hpp"
#include "pons/wire/types/all_types.hpp"

namespace pons::wire {
namespace {

// What is asked of a type, without the type: assertions are compiled once, not once a type, which takes minutes.
struct Tested {
  std::string_view name, hash;
  Expected<std::vector<std::byte>> (*write_filled)();
  // Into a new message, and again over what was there then; whether that is the filled one each time.
  Expected<bool> (*read_filled)(std::span<const std::byte> bytes);
};

template <Message T>
Expected<std::vector<std::byte>> write_filled() {
  std::vector<std::byte> bytes;
  if (auto put = encode(filled<T>(), bytes); !put) return std::unexpected(put.error());
  return bytes;
}

template <Message T>
Expected<bool> read_filled(std::span<const std::byte> bytes) {
  const T wanted = filled<T>();
  T read;
  bool same = true;
  for (int i = 0; i < 2; ++i) {
    if (auto taken = decode(bytes, read); !taken) return std::unexpected(taken.error());
    same = same && read == wanted;
  }
  return same;
}

template <typename... Each>
std::vector<Tested> listed(Types<Each...>) {
  return {Tested{Each::kName, Each::kHash, &write_filled<Each>, &read_filled<Each>}...};
}

void check(const Tested& type, const Golden& golden) {
  SCOPED_TRACE(type.name);
  EXPECT_EQ(golden.name, type.name);
  EXPECT_EQ(golden.hash, type.hash);
  const auto bytes = type.write_filled();
  ASSERT_TRUE(bytes) << bytes.error().line();
  EXPECT_EQ(*bytes, golden.bytes);
  const auto same = type.read_filled(golden.bytes);
  ASSERT_TRUE(same) << same.error().line();
  EXPECT_TRUE(*same);
}

// Cut anywhere, it is refused.
void check_cut(const Tested& type, std::span<const std::byte> bytes) {
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const auto read = type.read_filled(bytes.first(size));
    ASSERT_FALSE(read) << type.name << " cut after " << size;
    EXPECT_THAT(read.error().line(), testing::HasSubstr(std::string(type.name)));
  }
}

TEST(GoldenTest, EveryTypesBytesAndHashAreThoseOfOthers) {
  const std::vector<Tested> types = listed(AllTypes{});
  const std::vector<Golden> golden = read_golden();
  ASSERT_EQ(golden.size(), types.size()) << "golden.py writes one line a type, in the order of their names";
  for (std::size_t i = 0; i < types.size(); ++i) check(types[i], golden[i]);
}

TEST(GoldenTest, EveryTypeThatIsCutIsRefused) {
  for (const Tested& type : listed(AllTypes{})) check_cut(type, type.write_filled().value());
}

}  // namespace
}  // namespace pons::wire
