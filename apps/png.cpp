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

}  // namespace pons::apps
