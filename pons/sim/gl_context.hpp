// An offscreen OpenGL context without a display, by EGL, which is loaded when first needed: a machine without it can
// run everything but cameras, and hears what is missing. Private to pons/sim.
#pragma once

#include <memory>

#include "pons/core/error.hpp"

namespace pons::sim {

class GlContext {
 public:
  // Error: no EGL library, or no driver behind it.
  [[nodiscard]] static Expected<std::unique_ptr<GlContext>> create();
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  // On the calling thread; a context is current on one thread at a time.
  [[nodiscard]] Expected<void> make_current();
  void release();
  // An OpenGL function by its name; null where the driver has none. Call it while the context is current.
  template <typename Function>
  [[nodiscard]] Function function(const char* name) const {
    return reinterpret_cast<Function>(address(name));
  }

 private:
  using Address = void (*)();
  [[nodiscard]] Address address(const char* name) const;
  GlContext() = default;
  struct Egl;
  std::shared_ptr<Egl> egl_;
  void* context_ = nullptr;
};

}  // namespace pons::sim
