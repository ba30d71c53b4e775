// Every type's bytes, held against those that other implementations of CDR write: see golden.py.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <string>
#include <utility>

#include "pons/wire/test_fill.hpp"
#include "pons/wire/types/all_types.hpp"

namespace pons::wire {
namespace {

struct Golden {
  std::string hash, bytes;  // hexadecimal
};

std::map<std::string, Golden, std::less<>> read_golden() {
  std::map<std::string, Golden, std::less<>> golden;
  std::ifstream file("pons/wire/golden.txt");
  std::string name;
  for (Golden one; file >> name >> one.hash >> one.bytes;) golden[name] = one;
  return golden;
}

std::string hexadecimal(const std::vector<std::byte>& bytes) {
  std::string text;
  for (const std::byte byte : bytes) text += fmt::format("{:02x}", std::to_integer<unsigned>(byte));
  return text;
}

// The same numbers the other way round are what a big-endian writer sends: its reader turns them back.
template <Message T>
void check(const Golden& golden) {
  SCOPED_TRACE(T::kName);
  EXPECT_EQ(golden.hash, T::kHash);
  const T message = filled<T>();
  std::vector<std::byte> bytes;
  ASSERT_TRUE(encode(message, bytes));
  EXPECT_EQ(hexadecimal(bytes), golden.bytes);
  T read;
  const auto decoded = decode(bytes, read);
  ASSERT_TRUE(decoded) << decoded.error().line();
  EXPECT_EQ(read, message);
  ASSERT_TRUE(decode(bytes, read)) << "over what was there";
  EXPECT_EQ(read, message);
}

// Cut anywhere, it is refused, or read as what was left of it is.
template <Message T>
void check_cut() {
  std::vector<std::byte> bytes;
  ASSERT_TRUE(encode(filled<T>(), bytes));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    T read;
    const auto decoded = decode(std::span(bytes).first(size), read);
    ASSERT_FALSE(decoded) << T::kName << " cut after " << size;
    EXPECT_THAT(decoded.error().line(), testing::HasSubstr(T::kName));
  }
}

template <Message T>
void check_with(const std::map<std::string, Golden, std::less<>>& golden) {
  const auto found = golden.find(T::kName);
  if (found == golden.end()) return void(ADD_FAILURE() << "no bytes of " << T::kName);
  check<T>(found->second);
}

// One after the other by loops: clang folds no more than 256.
template <typename... Each>
void check_all(Types<Each...>) {
  const auto golden = read_golden();
  EXPECT_EQ(golden.size(), sizeof...(Each)) << "golden.py writes one line a type";
  for (auto* const check_one : {&check_with<Each>...}) check_one(golden);
}

template <typename... Each>
void check_all_cut(Types<Each...>) {
  for (auto* const check_one : {&check_cut<Each>...}) check_one();
}

TEST(GoldenTest, EveryTypesBytesAndHashAreThoseOfOthers) { check_all(AllTypes{}); }

TEST(GoldenTest, EveryTypeThatIsCutIsRefused) { check_all_cut(AllTypes{}); }

}  // namespace
}  // namespace pons::wire
