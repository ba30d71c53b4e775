#include "pons/sim/gl_context.hpp"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>
#include <fmt/format.h>

#include <cstdlib>
#include <string>

namespace pons::sim {
namespace {

constexpr const char* kMend =
    "install libegl1 and libgl1-mesa-dri (tools/setup does), or point PONS_EGL at an EGL library";

}  // namespace

struct GlContext::Egl {
  void* library = nullptr;
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLConfig config = nullptr;
  decltype(&eglCreateContext) create_context = nullptr;
  decltype(&eglDestroyContext) destroy_context = nullptr;
  decltype(&eglMakeCurrent) make_current = nullptr;
  decltype(&eglGetError) get_error = nullptr;
  decltype(&eglBindAPI) bind = nullptr;
  decltype(&eglGetProcAddress) get_proc = nullptr;

  template <typename Function>
  Function find(const char* symbol) const {
    return reinterpret_cast<Function>(dlsym(library, symbol));
  }
  [[nodiscard]] Expected<void> open();
};

Expected<void> GlContext::Egl::open() {
  const char* asked = std::getenv("PONS_EGL");
  const std::string file = asked != nullptr && *asked != '\0' ? asked : "libEGL.so.1";
  // Never unloaded: drivers do not survive that. RTLD_GLOBAL, so that MuJoCo finds eglGetProcAddress.
  library = dlopen(file.c_str(), RTLD_NOW | RTLD_GLOBAL);
  if (library == nullptr) return fail(fmt::format("no OpenGL for the cameras: {}", dlerror()), file, kMend);
  get_proc = find<decltype(get_proc)>("eglGetProcAddress");
  const auto initialize = find<decltype(&eglInitialize)>("eglInitialize");
  const auto choose = find<decltype(&eglChooseConfig)>("eglChooseConfig");
  bind = find<decltype(bind)>("eglBindAPI");
  create_context = find<decltype(create_context)>("eglCreateContext");
  destroy_context = find<decltype(destroy_context)>("eglDestroyContext");
  make_current = find<decltype(make_current)>("eglMakeCurrent");
  get_error = find<decltype(get_error)>("eglGetError");
  if (!get_proc || !initialize || !choose || !bind || !create_context || !destroy_context || !make_current ||
      !get_error) {
    return fail("no OpenGL for the cameras: not an EGL library", file, kMend);
  }
  const auto platform_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(get_proc("eglGetPlatformDisplayEXT"));
  if (platform_display != nullptr) {
    display = platform_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  }
  if (display == EGL_NO_DISPLAY || initialize(display, nullptr, nullptr) != EGL_TRUE) {
    return fail(fmt::format("no OpenGL driver for the cameras (EGL error {:#x})", get_error()), file, kMend);
  }
  const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
  EGLint count = 0;
  if (choose(display, wanted, &config, 1, &count) != EGL_TRUE || count == 0 || bind(EGL_OPENGL_API) != EGL_TRUE) {
    return fail(fmt::format("EGL offers no desktop OpenGL (error {:#x})", get_error()), file, kMend);
  }
  return {};
}

Expected<std::unique_ptr<GlContext>> GlContext::create() {
  auto egl = std::make_shared<Egl>();
  if (auto opened = egl->open(); !opened) return std::unexpected(opened.error());
  std::unique_ptr<GlContext> context(new GlContext);
  context->context_ = egl->create_context(egl->display, egl->config, EGL_NO_CONTEXT, nullptr);
  if (context->context_ == EGL_NO_CONTEXT) {
    return fail(fmt::format("no OpenGL context (EGL error {:#x})", egl->get_error()), "libEGL.so.1", kMend);
  }
  context->egl_ = std::move(egl);
  return context;
}

GlContext::~GlContext() {
  if (egl_ == nullptr) return;
  release();
  egl_->destroy_context(egl_->display, context_);
}

Expected<void> GlContext::make_current() {
  egl_->bind(EGL_OPENGL_API);  // of the thread, not of the display
  if (egl_->make_current(egl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_TRUE) return {};
  return fail(fmt::format("the OpenGL context is not to be had (EGL error {:#x})", egl_->get_error()), "camera",
              "use a camera's finish() on one thread at a time");
}

void GlContext::release() { egl_->make_current(egl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT); }

GlContext::Address GlContext::address(const char* name) const { return egl_->get_proc(name); }

}  // namespace pons::sim
