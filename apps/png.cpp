#include "apps/png.hpp"

#include <png.h>
#include <string>

#include "pons/record/file.hpp"

namespace pons::apps {

Expected<void> write_png(const std::filesystem::path& file, int width, int height, std::span<const std::uint8_t> rgb) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = 0;
  if (png_image_write_to_memory(&image, nullptr, &size, 0, rgb.data(), 0, nullptr) == 0) {
    return fail(std::string("cannot draw the picture: ") + image.message, file.string());
  }
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, rgb.data(), 0, nullptr) == 0) {
    return fail(std::string("cannot draw the picture: ") + image.message, file.string());
  }
  return record::write_whole(file, std::string_view(bytes).substr(0, size));
}

// Many a second, mostly noise: of depth, what more effort makes is larger, and takes six times as long.
Expected<void> append_png(int width, int height, std::span<const std::uint16_t> grey, std::vector<std::uint8_t>& png) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_LINEAR_Y;
  image.flags = PNG_IMAGE_FLAG_FAST;
  const std::size_t before = png.size();
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  png.resize(before + size);
  if (png_image_write_to_memory(&image, png.data() + before, &size, 0, grey.data(), 0, nullptr) == 0)
    return fail(std::string("cannot draw the picture: ") + image.message, "PNG");
  png.resize(before + size);
  return {};
}

}  // namespace pons::apps
