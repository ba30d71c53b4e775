#include "pons/sim/renderer.hpp"

#include <GL/gl.h>
#include <GL/glext.h>
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "pons/sim/unseen.hpp"

namespace pons::sim {
namespace {

constexpr int kMostGeoms = 2000;
constexpr std::size_t kChannels = 4;  // of a pixel, as the driver keeps it
constexpr int kStacks = 8;            // along the axis of what is round, caps included
constexpr double kPlaneGrid_m = 20;   // spacing

void set_look(mjvScene& scene, Look look) {
  const mjtByte on = look == Look::kPicture ? 1 : 0;
  for (const int flag : {mjRND_SHADOW, mjRND_SKYBOX, mjRND_HAZE, mjRND_REFLECTION}) scene.flags[flag] = on;
}

// Lights are directional: what is flat has one shade, and finer pieces of it only cost time. The slices around a tube
// stay, because its shape is measured.
void make_context(const mjModel& view, Look look, mjrContext& context) {
  mjModel drawn = view;
  std::vector<mjtNum> sizes(view.geom_size, view.geom_size + 3 * view.ngeom);
  if (look == Look::kSensor) {
    drawn.vis.quality.numquads = 1;
    drawn.vis.quality.numstacks = kStacks;
    for (std::size_t geom = 0; geom < sizes.size() / 3; ++geom) {
      if (view.geom_type[geom] == mjGEOM_PLANE) sizes[3 * geom + 2] = kPlaneGrid_m;
    }
    drawn.geom_size = sizes.data();
  }
  mjr_makeContext(&drawn, &context, mjFONTSCALE_50);
}

// MuJoCo's buffer keeps eight bytes of depth and stencil a pixel, of which the driver clears and reads four with a
// mask. Without the stencil, which only reflections need, the same depths cost half. A driver that does not like it
// keeps what it had.
void drop_stencil(const GlContext& gl, const mjrContext& context, int width, int height) {
  const auto bind_frame = gl.function<PFNGLBINDFRAMEBUFFERPROC>("glBindFramebuffer");
  const auto bind = gl.function<PFNGLBINDRENDERBUFFERPROC>("glBindRenderbuffer");
  const auto allocate = gl.function<PFNGLRENDERBUFFERSTORAGEPROC>("glRenderbufferStorage");
  const auto attach = gl.function<PFNGLFRAMEBUFFERRENDERBUFFERPROC>("glFramebufferRenderbuffer");
  const auto check = gl.function<PFNGLCHECKFRAMEBUFFERSTATUSPROC>("glCheckFramebufferStatus");
  if (!bind_frame || !bind || !allocate || !attach || !check || context.offSamples > 0) return;
  bind_frame(GL_FRAMEBUFFER, context.offFBO);
  bind(GL_RENDERBUFFER, context.offDepthStencil);
  attach(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, 0);
  allocate(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, width, height);
  attach(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, context.offDepthStencil);
  if (check(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return;
  allocate(GL_RENDERBUFFER, GL_DEPTH32F_STENCIL8, width, height);
  attach(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, context.offDepthStencil);
}

Eigen::Vector3f vector(const float v[3]) { return {v[0], v[1], v[2]}; }

// What is hidden is then refused by its depth before it is shaded. The floor, which has a texture and is nearly always
// hidden, would cost as much as everything else together.
void front_to_back(const mjvGLCamera& camera, mjvScene& scene) {
  const Eigen::Vector3f from = vector(camera.pos), forward = vector(camera.forward);
  std::stable_sort(scene.geoms, scene.geoms + scene.ngeom, [&](const mjvGeom& a, const mjvGeom& b) {
    if ((a.type == mjGEOM_PLANE) != (b.type == mjGEOM_PLANE)) return b.type == mjGEOM_PLANE;
    return forward.dot(vector(a.pos) - from) < forward.dot(vector(b.pos) - from);
  });
}

}  // namespace

Expected<std::unique_ptr<Renderer>> Renderer::create(const mjModel* model, int width, int height, Look look) {
  auto gl = GlContext::create();
  if (!gl) return std::unexpected(gl.error());
  if (auto current = (*gl)->make_current(); !current) return std::unexpected(current.error());
  std::unique_ptr<Renderer> renderer(new Renderer);
  renderer->gl_ = std::move(*gl);
  renderer->look_ = look;
  renderer->width_ = width;
  renderer->height_ = height;
  renderer->near_m_ = static_cast<double>(model->vis.map.znear) * model->stat.extent;
  renderer->far_m_ = static_cast<double>(model->vis.map.zfar) * model->stat.extent;
  renderer->texture_data_.assign(model->tex_data, model->tex_data + model->ntexdata);
  mjModel& view = renderer->view_;
  view = *model;
  view.tex_data = renderer->texture_data_.data();
  view.vis.global.offwidth = width;
  view.vis.global.offheight = height;
  view.vis.quality.offsamples = look == Look::kPicture ? 8 : 0;
  view.vis.quality.shadowsize = look == Look::kPicture ? 4096 : 0;
  mjv_defaultOption(&renderer->option_);
  mjv_defaultScene(&renderer->scene_);
  mjr_defaultContext(&renderer->context_);
  try {
    mjv_makeScene(model, &renderer->scene_, kMostGeoms);
    make_context(view, look, renderer->context_);
    mjr_setBuffer(mjFB_OFFSCREEN, &renderer->context_);
    if (look == Look::kSensor) drop_stencil(*renderer->gl_, renderer->context_, width, height);
    renderer->context_.readPixelFormat = GL_RGBA;
  } catch (const std::runtime_error& error) {
    renderer->gl_->release();
    return fail(fmt::format("OpenGL cannot draw {} x {} pixels: {}", width, height, error.what()), "camera",
                "use a smaller picture or another driver");
  }
  set_look(renderer->scene_, look);
  renderer->gl_->release();
  return renderer;
}

Renderer::~Renderer() {
  if (gl_ == nullptr) return;
  if (gl_->make_current()) mjr_freeContext(&context_);
  mjv_freeScene(&scene_);
}

void Renderer::capture(const mjModel* model, mjData* data, int camera, const LabelStore& labels) {
  mjvCamera view;
  mjv_defaultCamera(&view);
  view.type = mjCAMERA_FIXED;
  view.fixedcamid = camera;
  mjv_updateScene(model, data, &option_, nullptr, &view, mjCAT_ALL, &scene_);
  if (look_ == Look::kSensor) {  // in a picture for people things cast shadows from outside
    const mjvGLCamera eye = mjv_averageCamera(scene_.camera, scene_.camera + 1);
    leave_out_unseen(model, eye, static_cast<float>(width_) / static_cast<float>(height_), scene_);
    front_to_back(eye, scene_);
  }
  versions_.resize(labels.entries.size(), 0);
  for (std::size_t i = 0; i < labels.entries.size(); ++i) {
    const LabelStore::Entry& entry = labels.entries[i];
    if (entry.version == versions_[i]) continue;
    versions_[i] = entry.version;
    std::memcpy(view_.tex_data + view_.tex_adr[entry.texture], entry.pixels.data(), entry.pixels.size());
    if (std::ranges::find(changed_, entry.texture) == changed_.end()) changed_.push_back(entry.texture);
  }
}

Expected<void> Renderer::draw(std::vector<std::uint8_t>& rgba, std::vector<float>& depth) {
  if (auto current = gl_->make_current(); !current) return current;
  const mjrRect viewport{0, 0, width_, height_};
  const auto pixels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  rgba.resize(kChannels * pixels);
  depth.resize(pixels);
  try {
    for (const int texture : changed_) mjr_uploadTexture(&view_, &context_, texture);
    changed_.clear();
    mjr_render(viewport, &scene_, &context_);
    mjr_readPixels(rgba.data(), depth.data(), viewport, &context_);
  } catch (const std::runtime_error& error) {
    gl_->release();
    return fail(fmt::format("OpenGL failed: {}", error.what()), "camera", "check the driver");
  }
  gl_->release();
  return {};
}

Expected<std::vector<std::uint8_t>> draw_picture(const mjModel* model, mjData* data, int camera,
                                                 const LabelStore& labels, int width, int height) {
  auto renderer = Renderer::create(model, width, height, Look::kPicture);
  if (!renderer) return std::unexpected(renderer.error());
  (*renderer)->capture(model, data, camera, labels);
  std::vector<std::uint8_t> rgba;
  std::vector<float> depth;
  if (auto drawn = (*renderer)->draw(rgba, depth); !drawn) return std::unexpected(drawn.error());
  std::vector<std::uint8_t> rgb(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  turn_over(rgba, width, height, 0, static_cast<std::size_t>(height), rgb.data());
  return rgb;
}

// Four bytes at a time: what is written over into the next pixel that one overwrites.
void turn_over(const std::vector<std::uint8_t>& rgba, int width, int height, std::size_t begin, std::size_t end,
               std::uint8_t* rgb) {
  const auto columns = static_cast<std::size_t>(width), rows = static_cast<std::size_t>(height);
  for (std::size_t row = begin; row < end; ++row) {
    const std::uint8_t* const from = rgba.data() + (rows - 1 - row) * kChannels * columns;
    std::uint8_t* const to = rgb + row * 3 * columns;
    for (std::size_t i = 0; i + 1 < columns; ++i) std::memcpy(to + 3 * i, from + kChannels * i, kChannels);
    std::memcpy(to + 3 * (columns - 1), from + kChannels * (columns - 1), 3);
  }
}

}  // namespace pons::sim
