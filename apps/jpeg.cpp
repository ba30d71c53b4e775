#include "apps/jpeg.hpp"

#include <fmt/format.h>
#include <turbojpeg.h>

#include <memory>

namespace pons::apps {
namespace {

constexpr int kQuality = 90;

struct Destroy {
  void operator()(void* compressor) const { tjDestroy(compressor); }
};

}  // namespace

Expected<void> encode_jpeg(std::span<const std::uint8_t> rgb, int width, int height, std::vector<std::uint8_t>& jpeg) {
  const auto refused = [&](const char* why) {
    return fail(fmt::format("cannot be made a JPEG: {}", why),
                fmt::format("a picture of {} × {} pixels", width, height), "give the camera another size");
  };
  if (width <= 0 || height <= 0 || rgb.size() != 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    return refused("its bytes are not 3 a pixel");
  const std::unique_ptr<void, Destroy> compressor(tjInitCompress());
  if (!compressor) return refused(tjGetErrorStr2(nullptr));
  const unsigned long room = tjBufSize(width, height, TJSAMP_420);
  if (room == static_cast<unsigned long>(-1)) return refused(tjGetErrorStr2(nullptr));
  jpeg.resize(room);
  unsigned char* to = jpeg.data();
  unsigned long size = room;
  if (tjCompress2(compressor.get(), rgb.data(), width, 0, height, TJPF_RGB, &to, &size, TJSAMP_420, kQuality,
                  TJFLAG_NOREALLOC) != 0)
    return refused(tjGetErrorStr2(compressor.get()));
  jpeg.resize(size);
  return {};
}

}  // namespace pons::apps
