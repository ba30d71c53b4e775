// Debian and the wheels each bring a Boost, an Eigen and a tinyxml2. Two in one process share symbols of different
// layouts: this program links what the application links and looks at what the loader made of it. Fast DDS brings
// Debian's tinyxml2 and never calls it (docs/decisions/0045): there may be that one, after the wheels'.
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <regex>
#include <set>
#include <string>

namespace pons {
namespace {

using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::StartsWith;

static_assert(EIGEN_WORLD_VERSION == 3 && EIGEN_MAJOR_VERSION == 4 && EIGEN_MINOR_VERSION == 1,
              "this is not the wheels' Eigen 3.4.1");

// Absolute paths of shared libraries named in a text, links resolved.
[[nodiscard]] std::set<std::string> libraries_in(const std::string& text) {
  static const std::regex path(R"((/\S+\.so(?:\.[0-9]+)*)(?=\s|$))");
  std::set<std::string> found;
  for (auto match = std::sregex_iterator(text.begin(), text.end(), path); match != std::sregex_iterator(); ++match) {
    found.insert(std::filesystem::weakly_canonical(match->str(1)).string());
  }
  return found;
}

[[nodiscard]] std::set<std::string> named(const std::set<std::string>& libraries, const std::string& stem) {
  std::set<std::string> found;
  for (const std::string& library : libraries) {
    if (std::filesystem::path(library).filename().string().starts_with(stem)) found.insert(library);
  }
  return found;
}

[[nodiscard]] std::set<std::string> boost_versions(const std::set<std::string>& libraries) {
  std::set<std::string> versions;
  for (const std::string& library : named(libraries, "libboost_")) {
    versions.insert(library.substr(library.find(".so") + 3));
  }
  return versions;
}

void expect_one_of_each(const std::set<std::string>& libraries) {
  EXPECT_THAT(boost_versions(libraries), SizeIs(1));
  const std::string wheels = std::filesystem::canonical(PONS_PREFIX).string() + "/";
  const std::set<std::string> xml = named(libraries, "libtinyxml2");
  EXPECT_THAT(xml, SizeIs(named(libraries, "libfastrtps").empty() ? 1 : 2));
  EXPECT_EQ(std::ranges::count_if(xml, [&](const std::string& each) { return each.starts_with(wheels); }), 1);
  for (const char* stem : {"libboost_", "libpinocchio", "libcoal", "liburdfdom"}) {
    EXPECT_THAT(named(libraries, stem), Not(IsEmpty())) << stem;
    for (const std::string& library : named(libraries, stem)) {
      EXPECT_TRUE(library.starts_with(wheels)) << library << " is not of the wheels in " << wheels;
    }
  }
}

[[nodiscard]] std::string read(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(OneWorld, InThisProcess) {
  // Mesa and what it brings are loaded when a display is opened, as the camera does.
  // Stays open, as the renderer leaves it: a driver that is unloaded leaks a little.
  const EGLDisplay display = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  ASSERT_EQ(eglInitialize(display, nullptr, nullptr), EGLBoolean{EGL_TRUE});
  const std::set<std::string> libraries = libraries_in(read("/proc/self/maps"));
  EXPECT_THAT(named(libraries, "libmujoco"), SizeIs(1));
  EXPECT_THAT(named(libraries, "libopencv_core"), SizeIs(1));
  expect_one_of_each(libraries);
  // Who asks for it, gets the wheels'.
  Dl_info found{};
  ASSERT_NE(::dladdr(::dlsym(RTLD_DEFAULT, "_ZN8tinyxml211XMLDocument5ParseEPKcm"), &found), 0);
  EXPECT_THAT(std::filesystem::canonical(found.dli_fname).string(),
              StartsWith(std::filesystem::canonical(PONS_PREFIX).string()));
}

TEST(OneWorld, SeesASecondOne) {
  const auto libraries = libraries_in(
      "7f0-7f1 r-xp 0 08:01 1 /opt/a/libboost_thread.so.1.90.0\n7f2-7f3 r-xp 0 08:01 2 "
      "/usr/x/libboost_thread.so.1.74.0\n"
      "7f4-7f5 r--p 0 08:01 3 /usr/x/libtinyxml2.so.9\n");
  EXPECT_THAT(boost_versions(libraries), SizeIs(2));
  EXPECT_THAT(named(libraries, "libtinyxml2"), SizeIs(1));
}

#ifdef PONS_BINARY
TEST(OneWorld, InTheProgram) {
  // The loader lists what it would load and runs nothing.
  const std::string command = "LD_TRACE_LOADED_OBJECTS=1 '" PONS_BINARY "'";
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
  ASSERT_NE(pipe, nullptr);
  std::string text;
  for (std::array<char, 4096> part{}; std::fgets(part.data(), part.size(), pipe.get()) != nullptr;) text += part.data();
  expect_one_of_each(libraries_in(text));
  // The loader looks in this order.
  EXPECT_LT(text.find("libtinyxml2.so.11 "), text.find("libtinyxml2.so.9 ")) << text;
}
#endif

}  // namespace
}  // namespace pons
