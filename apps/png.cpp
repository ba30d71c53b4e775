#include "apps/png.hpp"

#include <png.h>
#include <system_error>

namespace pons::apps {

Expected<void> write_png(const std::filesystem::path& file, int width, int height, std::span<const std::uint8_t> rgb) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB;
  const std::filesystem::path part = file.string() + ".part";
  if (png_image_write_to_file(&image, part.c_str(), 0, rgb.data(), 0, nullptr) == 0) {
    std::error_code ignored;
    std::filesystem::remove(part, ignored);
    return fail(std::string("cannot write the picture: ") + image.message, file.string(),
                "name a file in a folder that exists and that you may write to");
  }
  std::error_code error;
  std::filesystem::rename(part, file, error);
  if (error) return fail("cannot write the picture: " + error.message(), file.string());
  return {};
}

}  // namespace pons::apps
