#include "pons/sim/bare_step.hpp"

#include "pons/sim/cell.hpp"
#include "pons/sim/simulation.hpp"

namespace pons::sim {

struct BareStep::Impl {
  const Cell& cell;
  ModelPtr model;
  DataPtr data;
  Time stepped;
  body::SetPoints set_points;
};

BareStep::BareStep(const Simulation& simulation)
    : impl_(new Impl{*simulation.cell_, ModelPtr(mj_copyModel(nullptr, simulation.cell_->composed.model.get())),
                     DataPtr(mj_makeData(simulation.cell_->composed.model.get())), Time{}, body::SetPoints{}}) {
  copy();
}

BareStep::~BareStep() = default;

void BareStep::copy() {
  const Cell& cell = impl_->cell;
  mj_copyModel(impl_->model.get(), cell.composed.model.get());
  mj_copyData(impl_->data.get(), cell.composed.model.get(), cell.data.get());
  impl_->stepped = cell.stepped;
  impl_->set_points = cell.arm().set_points;
}

void BareStep::advance_to(Time time) {
  const Cell& cell = impl_->cell;
  while (impl_->stepped + cell.step_length <= time) {
    const std::vector<int>& actuator = cell.composed.arms.front().actuator;
    for (std::size_t i = 0; i < actuator.size(); ++i) {
      const double torque = impl_->set_points.power ? impl_->set_points.torque_nm[static_cast<Eigen::Index>(i)] : 0;
      impl_->data->ctrl[actuator[i]] = torque;
    }
    mj_step(impl_->model.get(), impl_->data.get());
    impl_->stepped += cell.step_length;
  }
}

void BareStep::write(const body::SetPoints& set_points) { impl_->set_points = set_points; }

std::uint64_t BareStep::state_digest() const { return digest_of(impl_->model.get(), impl_->data.get()); }

}  // namespace pons::sim
