#include "pons/wire/interface_types.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <map>

#include "pons/core/random.hpp"
#include "pons/wire/test_golden.hpp"

namespace pons::wire {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// The files that Pons' own structs are made of.
Expected<InterfaceText> own_file(const std::string& interface) {
  const std::size_t kind = interface.find('/') + 1;
  const std::string extension = interface.substr(kind, interface.rfind('/') - kind);
  for (const char* const folder : {"ros2/interfaces/", "ros2/dialects/", "ros2/"}) {
    const std::string path = folder + interface + "." + extension;
    if (std::ifstream stream(path, std::ios::binary); stream)
      return InterfaceText{std::string(std::istreambuf_iterator<char>(stream), {}), path};
  }
  return fail("there is no " + interface);
}

// ---- as the structs are ----

template <typename T>
void expect_same(const Expected<T>& got, const Expected<T>& wanted) {
  ASSERT_EQ(got.has_value(), wanted.has_value());
  if (wanted) {
    EXPECT_EQ(*got, *wanted);
  } else {
    EXPECT_EQ(got.error().line(), wanted.error().line());
  }
}

// Either takes them, and makes the same of them, or neither does, and says the same.
void expect_alike(const KnownType& known, const KnownType& read, std::span<const std::byte> bytes) {
  const auto json = known.to_json(bytes);
  expect_same(read.to_json(bytes), json);
  if (json) expect_same(read.to_cdr(*json), known.to_cdr(*json));
}

void expect_read_as_built(InterfaceTypes& types, Random& random, const Golden& golden) {
  if (golden.name.ends_with("_Event")) return;
  SCOPED_TRACE(golden.name);
  const KnownType* const known = known_type(golden.name);
  const auto read = types.type(golden.name);
  ASSERT_TRUE(read) << read.error().line();
  EXPECT_EQ(read->name, known->name);
  EXPECT_EQ(read->hash, known->hash);
  EXPECT_EQ(read->empty(), known->empty());
  const std::vector<std::byte>& bytes = golden.bytes;
  expect_alike(*known, *read, bytes);
  EXPECT_EQ(read->to_cdr(read->to_json(bytes).value()).value(), bytes);
  for (std::size_t length = 0; length < bytes.size(); ++length)
    expect_alike(*known, *read, std::span(bytes).first(length));
  // Other values, and lengths that cannot be true.
  for (int i = 0; i < 30; ++i) {
    std::vector<std::byte> other = bytes;
    for (int k = 0; k < 4; ++k) {
      other[random.below(other.size())] = static_cast<std::byte>(random.below(k < 2 ? 3 : 256));
    }
    expect_alike(*known, *read, other);
  }
}

TEST(InterfaceTypesTest, EachFileReadAtRunTimeIsTheStructThatIsMadeOfIt) {
  InterfaceTypes types(own_file);
  Random random(59);
  for (const Golden& each : read_golden()) expect_read_as_built(types, random, each);
}

TEST(InterfaceTypesTest, JsonThatDoesNotFitIsRefusedAlike) {
  InterfaceTypes types(own_file);
  const auto refuses = [&](const std::string& name, std::string_view json) {
    const auto wanted = known_type(name)->to_cdr(Json::parse(json));
    EXPECT_FALSE(wanted) << name << json;
    expect_same(types.type(name)->to_cdr(Json::parse(json)), wanted);
  };
  refuses("geometry_msgs/msg/PoseArray", R"({"poses":[{},{"position":{"q":1}}]})");
  refuses("lifecycle_msgs/srv/ChangeState_Request", R"({"transition":{"id":256}})");
  refuses("unique_identifier_msgs/msg/UUID", R"({"uuid":[1,2]})");
  refuses("sensor_msgs/msg/CompressedImage", R"({"data":"?"})");
  refuses("std_msgs/msg/Bool", R"({"data":1})");
  refuses("std_msgs/msg/String", R"([])");
}

// ---- somebody's own ----

class OwnFiles : public ::testing::Test {
 protected:
  Expected<KnownType> type(const std::string& name) {
    InterfaceTypes types([this](const std::string& interface) -> Expected<InterfaceText> {
      const auto found = files_.find(interface);
      if (found == files_.end()) return own_file(interface);
      return InterfaceText{found->second, interface};
    });
    return types.type(name);
  }
  std::string refused(const std::string& text) {
    files_["a/msg/B"] = text;
    const auto read = type("a/msg/B");
    return read ? "no error" : read.error().line();
  }
  std::map<std::string, std::string> files_;
};

TEST_F(OwnFiles, DefaultsConstantsCommentsAndBounds) {
  files_["a/srv/Sort"] =
      "# what to sort\r\n"
      "uint8 MOST=300  # a constant is not sent\r\n"
      "string  name \"a # b\"   # a text\r\n"
      "int64[3] at [0x10, -2, 0b11]\n"
      "bool[2] yes [True, 0]\n"
      "float32 scale -1.5e0\n"
      "string<=4 short\n"
      "geometry_msgs/Point[<=2] points\n"
      "bool[] marks\n"
      "a/Mark[2] two\n"
      "---\n";
  files_["a/msg/Mark"] = "byte[2] id\nuint16 weight 7";
  const auto request = type("a/srv/Sort_Request"), response = type("a/srv/Sort_Response");
  ASSERT_TRUE(request) << request.error().line();
  ASSERT_TRUE(response) << response.error().line();
  EXPECT_EQ(request->empty().dump(),
            R"({"name":"a # b","at":[16,-2,3],"yes":[true,false],"scale":-1.5,"short":"","points":[],"marks":[],)"
            R"("two":[{"id":[0,0],"weight":7},{"id":[0,0],"weight":7}]})");
  EXPECT_EQ(response->empty().dump(), R"({"structure_needs_at_least_one_member":0})");
  const Json some = Json::parse(R"({"marks":[true,false,true],"points":[{"y":1}],"two":[{"weight":9},{}]})");
  const auto bytes = request->to_cdr(some);
  ASSERT_TRUE(bytes) << bytes.error().line();
  const auto back = request->to_json(*bytes);
  ASSERT_TRUE(back) << back.error().line();
  EXPECT_EQ((*back)["marks"], some["marks"]);
  EXPECT_EQ((*back)["points"].dump(), R"([{"x":0.0,"y":1.0,"z":0.0}])");
  EXPECT_EQ((*back)["two"].dump(), R"([{"id":[0,0],"weight":9},{"id":[0,0],"weight":7}])");
  for (std::size_t length = 0; length < bytes->size(); ++length)
    EXPECT_FALSE(request->to_json(std::span(*bytes).first(length))) << length;
  const auto refuses = [&](std::string_view json) {
    const auto put = request->to_cdr(Json::parse(json));
    return put ? "no error" : put.error().line();
  };
  EXPECT_EQ(refuses(R"({"short":"abcde"})"), "short: is 5 long; at most 4 fit");
  EXPECT_EQ(refuses(R"({"points":[{},{},{}]})"), "points: is 3 long; at most 2 fit");
  EXPECT_EQ(refuses(R"({"two":[{}]})"), "two: has 1 elements; write 2");
}

TEST_F(OwnFiles, EachMistakeIsNamedWithFileAndLine) {
  EXPECT_EQ(refused("float64 x\n"), "no error");
  EXPECT_THAT(refused("\nflot64 x"), AllOf(HasSubstr("a/msg/B:2: there is no a/msg/flot64")));
  EXPECT_THAT(refused("float64"), HasSubstr("a/msg/B:1: 'float64' is neither a field nor a constant; write TYPE NAME"));
  EXPECT_THAT(refused("float64 1x"), HasSubstr("neither a field nor a constant"));
  EXPECT_THAT(refused("float64[ x"), HasSubstr("a/msg/B:1: 'float64[' is no type"));
  EXPECT_THAT(refused("float64[<=] x"), HasSubstr("is no type"));
  EXPECT_THAT(refused("a/b/c/d x"), HasSubstr("is no type"));
  EXPECT_THAT(refused("float64[0] x"), HasSubstr("has no elements"));
  EXPECT_THAT(refused("float64<=3 x"), HasSubstr("only a string has one"));
  EXPECT_THAT(refused("string<=3[] x"), HasSubstr("leave out the inner bound"));
  EXPECT_THAT(refused("wstring x"), HasSubstr("make it a string"));
  EXPECT_THAT(refused("int8 x\nint8 x"), HasSubstr("a/msg/B:2: there are two 'x'"));
  EXPECT_THAT(refused("int8 x 1.5"), HasSubstr("a/msg/B:1: '1.5' is no value for it"));
  EXPECT_THAT(refused("int8 x 200"), HasSubstr("a/msg/B:1: its default: x 200 is out of range; write a whole number"));
  EXPECT_THAT(refused("int8[2] x [1]"), HasSubstr("its default: x has 1 elements; write 2"));
  EXPECT_THAT(refused("int8[2] x 1"), HasSubstr("the default of several is a list"));
  EXPECT_THAT(refused("geometry_msgs/Point x 1"), HasSubstr("a message has no default"));
  EXPECT_THAT(refused("int8 x\n---\nint8 y"), HasSubstr("a/msg/B: it has 2 parts; divide it by --- into 1"));
  files_["a/srv/C"] = "int8 x";
  EXPECT_THAT(type("a/srv/C_Request").error().line(), HasSubstr("it has 1 parts; divide it by --- into 2"));
  EXPECT_THAT(type("a/srv/C_Goal").error().line(), HasSubstr("divide it"));
}

TEST_F(OwnFiles, NoFileMakesATypeWithoutEnd) {
  files_["a/msg/C"] = "int8 x\nB[] b";
  EXPECT_THAT(refused("C c"), HasSubstr("a/msg/C:2: a/msg/B contains itself"));
  EXPECT_THAT(refused("uint8[4000000000] x"), HasSubstr("a/msg/B:1: a/msg/B takes more than 256 KiB"));
  files_["a/msg/C"] = "float64[30000] x";
  EXPECT_THAT(refused("int8 x\nC[2] c"), HasSubstr("a/msg/B:2: a/msg/B takes more than 256 KiB"));
  EXPECT_EQ(refused("C[] c"), "no error");
}

}  // namespace
}  // namespace pons::wire
