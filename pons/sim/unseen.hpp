// Which parts of a scene a camera cannot see, so that the driver is not asked to draw them: it would find out only
// pixel by pixel. Not a pixel changes. Private to pons/sim.
#pragma once

#include "pons/sim/mujoco_kit.hpp"

namespace pons::sim {

// Takes out of `scene` what lies outside of the picture, and what a large box stands before in whole. `aspect` is the
// picture's width over its height. `model` is what the scene was made of.
void leave_out_unseen(const mjModel* model, const mjvGLCamera& camera, float aspect, mjvScene& scene);

}  // namespace pons::sim
