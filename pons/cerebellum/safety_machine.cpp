#include "pons/cerebellum/safety_machine.hpp"

namespace pons::cerebellum {

std::string_view name(SafetyEvent event) {
  switch (event) {
    case SafetyEvent::kProtectiveStop:
      return "stop, category 2";
    case SafetyEvent::kEmergencyStop:
      return "stop, category 1";
    case SafetyEvent::kPowerCut:
      return "stop, category 0";
    case SafetyEvent::kStandstill:
      return "standstill";
    case SafetyEvent::kReset:
      return "reset";
    case SafetyEvent::kArm:
      return "arm";
    case SafetyEvent::kRecover:
      return "recover";
  }
  return "unknown";
}

std::string_view name(Drives drives) {
  switch (drives) {
    case Drives::kAsTheyWere:
      return "as they were";
    case Drives::kOn:
      return "on";
    case Drives::kOff:
      return "off, brakes on";
  }
  return "unknown";
}

std::string_view name(Resumes resumes) {
  switch (resumes) {
    case Resumes::kBridge:
      return "the bridge";
    case Resumes::kZone:
      return "the bridge, where the world says so, when the zone has been empty for `resume_after_s`";
    case Resumes::kPerson:
      return "a person";
  }
  return "unknown";
}

const Transition* SafetyMachine::apply(SafetyEvent event) PONS_NONBLOCKING {
  const Transition* const row = transition(state_, event);
  if (row == nullptr) return nullptr;
  state_ = row->to;
  epoch_ += row->epochs;
  if (row->drives != Drives::kAsTheyWere) powered_ = row->drives == Drives::kOn;
  return row;
}

}  // namespace pons::cerebellum
