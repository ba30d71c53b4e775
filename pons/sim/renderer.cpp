#include "pons/sim/renderer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>

namespace pons::sim {
namespace {

constexpr int kMostGeoms = 2000;

void set_look(mjvScene& scene, Look look) {
  const mjtByte on = look == Look::kPicture ? 1 : 0;
  for (const int flag : {mjRND_SHADOW, mjRND_SKYBOX, mjRND_HAZE, mjRND_REFLECTION}) scene.flags[flag] = on;
}

}  // namespace

Expected<std::unique_ptr<Renderer>> Renderer::create(const mjModel* model, int width, int height, Look look) {
  auto gl = GlContext::create();
  if (!gl) return std::unexpected(gl.error());
  if (auto current = (*gl)->make_current(); !current) return std::unexpected(current.error());
  std::unique_ptr<Renderer> renderer(new Renderer);
  renderer->gl_ = std::move(*gl);
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
    mjr_makeContext(&view, &renderer->context_, mjFONTSCALE_50);
    mjr_setBuffer(mjFB_OFFSCREEN, &renderer->context_);
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
  versions_.resize(labels.entries.size(), 0);
  for (std::size_t i = 0; i < labels.entries.size(); ++i) {
    const LabelStore::Entry& entry = labels.entries[i];
    if (entry.version == versions_[i]) continue;
    versions_[i] = entry.version;
    std::memcpy(view_.tex_data + view_.tex_adr[entry.texture], entry.pixels.data(), entry.pixels.size());
    if (std::ranges::find(changed_, entry.texture) == changed_.end()) changed_.push_back(entry.texture);
  }
}

Expected<void> Renderer::draw(std::vector<std::uint8_t>& rgb, std::vector<float>& depth) {
  if (auto current = gl_->make_current(); !current) return current;
  const mjrRect viewport{0, 0, width_, height_};
  const auto pixels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  rgb.resize(3 * pixels);
  depth.resize(pixels);
  try {
    for (const int texture : changed_) mjr_uploadTexture(&view_, &context_, texture);
    changed_.clear();
    mjr_render(viewport, &scene_, &context_);
    mjr_readPixels(rgb.data(), depth.data(), viewport, &context_);
  } catch (const std::runtime_error& error) {
    gl_->release();
    return fail(fmt::format("OpenGL failed: {}", error.what()), "camera", "check the driver");
  }
  gl_->release();
  return {};
}

}  // namespace pons::sim
